"""Files and messages that a program writes."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import PurePosixPath


@dataclass
class Outputs:
    """What a program wrote.

    Attributes
    ----------
    folders : tuple of str or None
        Folders that exist, besides the control's own; None: all exist.
    logs : dict
        Lines of each log by name.
    messages : list
        Messages to the operator, (MSG,…) and (DEBUG,…).
    printed : list
    full : bool
        The disk is full, or read-only: the control writes nothing, and says nothing.
    """

    folders: tuple[str, ...] | None = None
    logs: dict[str, list[str]] = field(default_factory=dict)
    messages: list[str] = field(default_factory=list)
    printed: list[str] = field(default_factory=list)
    probed: dict[str, list[str]] = field(default_factory=dict)
    full: bool = False
    _log: str | None = None
    _probe_file: str | None = None
    _last_probed: str = ""

    def _can_open(self, name: str) -> bool:
        folder = str(PurePosixPath(name).parent)
        return (
            bool(name)
            and not self.full
            and (self.folders is None or folder == "." or folder in self.folders)
        )

    def open_log(self, name: str, *, append: bool = False) -> None:
        """A log that cannot be opened is not reported by LinuxCNC: its lines are lost."""
        self._log = None
        if self._can_open(name):
            self._log = name
            if not append or name not in self.logs:
                self.logs[name] = []

    def log(self, line: str) -> None:
        if self._log is not None:
            self.logs[self._log].append(line)

    def close_log(self) -> None:
        self._log = None

    def open_probe_file(self, name: str) -> None:
        self._probe_file = None
        if self._can_open(name):
            self._probe_file = name
            self.probed[name] = []
        else:
            self.messages.append(f"can't open probe file {name}")

    def probe_result(self, line: str) -> None:
        """A position that equals the last one gets no row."""
        if self._probe_file is not None and line != self._last_probed:
            self.probed[self._probe_file].append(line)
            self._last_probed = line

    def close_probe_file(self) -> None:
        self._probe_file = None
