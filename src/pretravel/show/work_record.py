"""The record of work: the command, its input files with checksums, settings and versions."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from importlib import metadata
from pathlib import Path

from pretravel.base import installed_version
from pretravel.show.document import Column, KeyFigure, Table
from pretravel.show.formatting import decimals

_OF_THE_OUTPUT = ("output", "plot", "verbose", "force")
"""Settings that say what is written, not what is computed."""
_LIBRARIES = ("numpy", "scipy")
"""Libraries whose versions can change the last digits of a result."""


@dataclass(frozen=True)
class InputFile:
    """A file that was read, with its checksum.

    Attributes
    ----------
    role : str
        The argument or option that named it.
    name : str
        As it was given.
    size : int
        [byte]
    sha256 : str
        Checksum of its content, as hexadecimal digits.
    """

    role: str
    name: str
    size: int
    sha256: str


@dataclass(frozen=True)
class StatedSetting:
    """A setting with which a result was computed.

    Attributes
    ----------
    name : str
        Of the option or field.
    value : str
        Empty: it was not given, and has no default value.
    given : bool
        Whether the user gave it; else the value is the default.
    meaning : str
        One sentence.
    """

    name: str
    value: str
    given: bool
    meaning: str = ""


@dataclass(frozen=True)
class WorkRecord:
    """The command and its input files.

    Attributes
    ----------
    command : str
        As it was typed; empty where there was none.
    inputs : tuple of InputFile
    settings : tuple of StatedSetting
    date : str
        Date and time with the time zone (ISO 8601).
    versions : tuple of pairs of str
        Software and its version.
    """

    command: str
    inputs: tuple[InputFile, ...]
    settings: tuple[StatedSetting, ...]
    date: str
    versions: tuple[tuple[str, str], ...]


def input_file(path: Path, role: str = "") -> InputFile:
    """A file with its checksum.

    Raises
    ------
    OSError
        It cannot be read.

    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "empty.csv"
    >>> _ = path.write_text("")
    >>> input_file(path).sha256[:8]
    'e3b0c442'
    """
    with path.open("rb") as file:
        checksum = hashlib.file_digest(file, "sha256").hexdigest()
    return InputFile(role, str(path), path.stat().st_size, checksum)


def record_now(
    command: str = "",
    inputs: Iterable[InputFile] = (),
    settings: Iterable[StatedSetting] = (),
) -> WorkRecord:
    """The record of a work that is done now, with this software.

    Parameters
    ----------
    command : str
    inputs : iterable of InputFile
    settings : iterable of StatedSetting

    >>> record_now("pretravel formats").versions[0][0]
    'pretravel'
    """
    return WorkRecord(
        command=command,
        inputs=tuple(inputs),
        settings=tuple(settings),
        date=datetime.now().astimezone().isoformat(timespec="seconds"),
        versions=(
            ("pretravel", installed_version()),
            ("Python", platform.python_version()),
            *((name, metadata.version(name)) for name in _LIBRARIES),
        ),
    )


def record_figures(record: WorkRecord) -> tuple[KeyFigure, ...]:
    """The command, the date, the software and the given settings of a record.

    >>> [figure.name for figure in record_figures(record_now("pretravel formats"))]
    ['command', 'date', 'software']
    """
    versions = ", ".join(f"{name} {version}" for name, version in record.versions)
    return (
        *((KeyFigure("command", record.command),) if record.command else ()),
        KeyFigure("date", record.date),
        KeyFigure("software", versions),
        *(
            KeyFigure(setting.name, setting.value, remark=setting.meaning)
            for setting in _chosen(record)
        ),
    )


def _chosen(record: WorkRecord) -> list[StatedSetting]:
    """The given settings that a result depends on, without the input files."""
    files = {entry.role for entry in record.inputs} | {entry.name for entry in record.inputs}
    return [
        setting
        for setting in record.settings
        if setting.given
        and setting.name.lstrip("-") not in _OF_THE_OUTPUT
        and not {setting.name, setting.value} & files
    ]


def inputs_table(inputs: Sequence[InputFile]) -> Table:
    """Input files with their checksums."""
    roles = Column.of("input", [entry.role or "other" for entry in inputs])
    return Table(
        (
            *((roles,) if any(entry.role for entry in inputs) else ()),
            Column.of("file", [entry.name for entry in inputs]),
            Column.of("size", [float(entry.size) for entry in inputs], "byte", decimals(0)),
            Column.of("SHA-256", [entry.sha256 for entry in inputs]),
        ),
        title="Input files",
        explanation="SHA-256: checksum of the content. A file with the same checksum is the same "
        "file.",
    )


def settings_table(settings: Sequence[StatedSetting]) -> Table:
    """Settings, given and by default."""
    return Table(
        (
            Column.of("setting", [entry.name for entry in settings]),
            Column.of("value", [entry.value or "none" for entry in settings]),
            Column.of("source", ["given" if entry.given else "default" for entry in settings]),
            Column.of("meaning", [entry.meaning for entry in settings]),
        ),
        title="Settings",
    )
