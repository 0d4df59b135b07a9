"""Parameters of G-code: numbered, named, and those that tell of the control's state."""

from __future__ import annotations

from collections.abc import Callable

from tests.support.machine_model.errors import StopError

LAST = 5602
_READ_ONLY = (*range(5400, 5410), *range(5420, 5429), *range(5021, 5030))
EQUAL = 1e-4
"""Numbers as near to each other are EQ. Seen in LinuxCNC 2.9.0~pre1; its later versions have 1e-6.
[units of the numbers]"""


class Parameters:
    """All parameters of a control.

    Attributes
    ----------
    live : dict
        Functions for parameters that tell of the control's state, by number or name.
    equal : float
        The difference below which numbers are EQ.
    """

    def __init__(self, equal: float = EQUAL) -> None:
        self.equal = equal
        self.numbered: dict[int, float] = {}
        self.globals: dict[str, float] = {}
        self.locals: list[dict[str, float]] = [{}]
        self.live: dict[int | str, Callable[[], float]] = {}

    def number(self, index: int) -> float:
        value = self.numbered.get(index)
        if value is not None:
            return value
        if index in self.live:
            return self.live[index]()
        if not 0 < index < LAST:
            raise StopError("Parameter number out of range")
        return 0.0

    def named(self, name: str) -> float:
        values = self.globals if name.startswith("_") else self.locals[-1]
        value = values.get(name)
        if value is not None:
            return value
        if name in self.live:
            return self.live[name]()
        raise StopError(f"Named parameter #<{name}> not defined")

    def exists(self, name: str) -> bool:
        values = self.globals if name.startswith("_") else self.locals[-1]
        return name in values or name in self.live

    def set_number(self, index: int, value: float) -> None:
        if not 0 < index < LAST:
            raise StopError("Parameter number out of range")
        if index in _READ_ONLY:
            raise StopError("Parameter is readonly")
        self.numbered[index] = value

    def set_named(self, name: str, value: float) -> None:
        if name in self.live:
            raise StopError(f"Cannot assign to read-only parameter #<{name}>")
        (self.globals if name.startswith("_") else self.locals[-1])[name] = value

    def expanded(self, text: str) -> str:
        """The text of an active comment, with the values of its parameters."""
        parts, at, decimals = [], 0, 6
        while at < len(text):
            character = text[at]
            if character == "%":
                shown, decimals, at = _format(text, at, decimals)
                parts.append(shown)
            elif character == "#":
                shown, at = self._shown(text, at, decimals)
                parts.append(shown)
            else:
                parts.append(character)
                at += 1
        return "".join(parts)

    def _shown(self, text: str, at: int, decimals: int) -> tuple[str, int]:
        """The value of the parameter at a place of a text, and the place after it."""
        end = at + 1
        value: float | None = None
        if text[end : end + 1] == "<":
            close = text.find(">", end)
            if close < 0:
                raise StopError("Named parameter not terminated")
            name = "".join(text[end + 1 : close].lower().split())
            value = self.named(name) if self.exists(name) else None
            end = close + 1
        else:
            while text[end : end + 1].isdigit():
                end += 1
            if end == at + 1:
                return "#", end
            value = self.number(int(text[at + 1 : end]))
        if value is None:
            return "######", end
        # The control prints smaller values as zero.
        return f"{0.0 if abs(value) < 1e-4 else value:.{decimals}f}", end


def _format(text: str, at: int, decimals: int) -> tuple[str, int, int]:
    """A format at a place of a text: what is shown for it, the decimals, the place after it."""
    after = text[at + 1 : at + 4]
    if after[:1] == "d":
        return "", 0, at + 2
    if after[:1] == "f":
        return "", 4, at + 2
    if after[:1] == ".":
        if after[1:2].isdigit() and after[2:3] == "f":
            return "", int(after[1]), at + 4
        return ".", decimals, at + 2
    return "%", decimals, at + 1
