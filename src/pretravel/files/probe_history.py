"""The history of one probe: every verification is a line of a text file (JSON)."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pretravel.base import DEGREE, MICROMETRE, InputError, StaleTouchesError, add, locked_file
from pretravel.files.map_file import map_id
from pretravel.files.source_file import SourceFile, opened
from pretravel.maps import PretravelMap, same_tip
from pretravel.touches import Touches

if TYPE_CHECKING:
    from pretravel.qualification import Verification

_SCHEMA, HISTORY_VERSION = "pretravel verification", 1
HISTORY_ENDING = ".jsonl"
LARGEST_HISTORY = 64_000_000
"""Largest size of a file: verifications of centuries. [bytes]"""
_BEGIN = f'{{"schema": "{_SCHEMA}"'.encode()
_LONGEST_LINE = 20_000
_LONGEST_TEXT = 1000
_WAIT_FOR_WRITER = 30.0
"""Time that a writer waits for another writer. [s]"""
_COLUMNS = (
    "time", "map", "map_id", "tip_diameter_mm", "touches_file", "touches", "directions",
    "false_alarm_rate", "changed", "p_form", "p_map", "p_repeatability", "size_um", "u_size_um",
    "amplitude_percent", "u_amplitude_percent", "turn_deg", "u_turn_deg", "repeatability_um",
    "largest_um", "decision",
)  # fmt: skip
_TOUCHES_ID = "touches_id"
"""Digest of the touches; entries of earlier versions lack it."""
_UNSEEN = "unseen_turn_deg"
"""A turn that these directions cannot show; only in entries of such directions."""
_LATER = (_TOUCHES_ID, _UNSEEN)
"""What entries can lack."""
_TEXTS = ("time", "map", "map_id", "touches_file", "decision", _TOUCHES_ID)
_ALWAYS_THERE = ("tip_diameter_mm", "touches", "directions", "false_alarm_rate", "changed")
_LARGEST = 1e9
"""No number of a verification is larger. Sizes in µm, angles in degrees, counts."""


@dataclass(frozen=True)
class Entry:
    """One stored verification; the units are in the names of the columns.

    Attributes
    ----------
    number : int
        Its line in the file.
    values : mapping of str to value
    """

    number: int
    values: dict[str, float | int | str | None]

    def __getitem__(self, column: str) -> float | int | str | None:
        return self.values[column]


def add_verification(
    path: str | Path,
    result: Verification,
    *,
    pretravel_map: PretravelMap,
    map_name: str,
    touches_name: str,
    decision: str,
    time: datetime | None = None,
) -> int:
    """Add a verification to the history of a probe; make the history where there is none.

    Parameters
    ----------
    path : str or Path
        One file for each probe. Several programs may write to it at once; each waits for the
        others.
    result : Verification
    pretravel_map : PretravelMap
        The map that was verified.
    map_name, touches_name : str
    decision : str
        "kept", or "accepted NEW_MAP".
    time : datetime, optional
        The present time when not given.

    Returns
    -------
    int
        Number of the entry.

    Raises
    ------
    InputError
        The file is of another kind, or of a probe with another tip; it cannot be written, or
        another program keeps it.
    """
    moment = (time or datetime.now(UTC)).astimezone(UTC).isoformat(timespec="seconds")
    row: tuple[float | int | str, ...] = (
        moment,
        map_name,
        map_id(pretravel_map),
        2.0 * pretravel_map.tip_radius,
        touches_name,
        result.touches,
        len(result.directions),
        result.false_alarm_rate,
        bool(result.changed),
        result.p_form,
        result.p_map,
        result.p_repeatability,
        result.size.value / MICROMETRE,
        result.size.u / MICROMETRE,
        100.0 * result.amplitude.value,
        100.0 * result.amplitude.u,
        result.turn.value / DEGREE,
        result.turn.u / DEGREE,
        result.repeatability / MICROMETRE,
        result.largest / MICROMETRE,
        decision,
    )
    values = {name: _storable(value) for name, value in zip(_COLUMNS, row, strict=True)}
    values[_TOUCHES_ID] = result.touches_digest
    if result.unseen_turn is not None:
        values |= {"turn_deg": None, "u_turn_deg": None}
        values[_UNSEEN] = result.unseen_turn.angle / DEGREE
    line = json.dumps({"schema": _SCHEMA, "version": HISTORY_VERSION} | values) + "\n"
    path = Path(path)
    _refuse_without_folder(path)
    with _kept_by_us(path) as descriptor:
        content = path.read_bytes()
        whole = _without_rest(content)
        entries = _entries(SourceFile(str(path), whole))
        _refuse_other_tip(entries, path, pretravel_map)
        try:
            if len(whole) < len(content):  # of a program that was interrupted
                os.ftruncate(descriptor, len(whole))
            unended = whole and not whole.endswith(b"\n")  # by an editor
            add(descriptor, b"\n" * bool(unended) + line.encode())
        except OSError as error:
            raise InputError(f"cannot be written: {error.strerror}", path=path) from None
    return whole.count(b"\n") + bool(unended) + 1


@contextmanager
def _kept_by_us(path: Path) -> Iterator[int]:
    try:
        with locked_file(path, _WAIT_FOR_WRITER) as descriptor:
            yield descriptor
    except BlockingIOError:
        raise InputError("another program keeps the history", path=path) from None


def check_history(path: str | Path, pretravel_map: PretravelMap) -> None:
    """Check that a verification can be added to a history, before anything else is written.

    Parameters
    ----------
    path : str or Path
        A history that does not exist yet will be made.
    pretravel_map : PretravelMap
        The map that was verified.

    Raises
    ------
    InputError
        As `add_verification` does, and `read_history`.
    """
    path = Path(path)
    _refuse_without_folder(path)
    if path.exists():
        _refuse_other_tip(_entries(opened(path)), path, pretravel_map)


def _refuse_without_folder(path: Path) -> None:
    if not path.parent.is_dir():
        raise InputError(
            f"the history cannot be made: the folder {path.parent} does not exist", path=path
        )


def _refuse_other_tip(entries: list[Entry], path: Path, pretravel_map: PretravelMap) -> None:
    if not entries:
        return
    tip_diameter = float(entries[-1]["tip_diameter_mm"] or 0.0)
    if not same_tip(tip_diameter, 2.0 * pretravel_map.tip_radius):
        raise InputError(
            f"this history is of a probe with a tip of {tip_diameter:g} mm; that of the map has "
            f"a tip of {2.0 * pretravel_map.tip_radius:g} mm. Keep one history for each probe",
            path=path,
        )


def refuse_known_touches(
    path: str | Path,
    touches: Touches,
    *,
    again_at_once: bool = False,
    of_files: Collection[str] = (),
) -> None:
    """Refuse touches that the history has already: of an old log, because no new one was written.

    Parameters
    ----------
    path : str or Path
        A history that does not exist yet has no touches.
    touches : Touches
    again_at_once : bool
        Whether those of the last entry may be used once more, for another decision.
    of_files : collection of str
        Digests of the touches of each file, where they were several.

    Raises
    ------
    StaleTouchesError
        With the entry that has them.
    """
    path = Path(path)
    if not path.exists():
        return
    entries = _entries(opened(path))
    for entry in entries[:-1] if again_at_once else entries:
        if entry[_TOUCHES_ID] in (touches.digest, *of_files):
            which = "" if entry[_TOUCHES_ID] == touches.digest else " of one of the files"
            raise StaleTouchesError(
                f"these touches{which} are in the history already, from {entry['touches_file']} on "
                f"{entry['time']}. The control has written no new log (wrong folder, disk full "
                "or read-only), or an old file was copied: touch the reference again. To test "
                "the same touches once more, leave out the history; to take an entry back, delete "
                "its line in the file",
                path=path,
                line=entry.number,
            )


def replaced_since(path: str | Path, pretravel_map: PretravelMap) -> tuple[str, ...]:
    """A sentence where the history has a successor of the map.

    Parameters
    ----------
    path : str or Path
        A history that does not exist yet has none.
    pretravel_map : PretravelMap
    """
    own, path = map_id(pretravel_map), Path(path)
    entries = _entries(opened(path)) if path.exists() else []
    rows = [row for row, entry in enumerate(entries) if entry["map_id"] == own]
    accepted = [row for row in rows if str(entries[row]["decision"]).startswith("accepted ")]
    if accepted:
        at = entries[accepted[-1]]
        new = str(at["decision"]).partition(" ")[2]
    else:
        known = {entry["map_id"] for entry in entries[: rows[-1] + 1]} if rows else {own}
        after = [entry for entry in entries if rows and entry["map_id"] not in known]
        if not after:
            return ()
        at, new = after[0], str(after[0]["map"])
    said = (
        f"the history has a later map of this probe, {new} ({str(at['time'])[:10]}): the probe is "
        "compared with the state before that map. Verify with the later one"
    )
    return (said,)


def read_history(path: str | Path) -> list[Entry]:
    """All verifications of a probe, oldest first.

    Where a map was accepted with the touches of an earlier entry, that entry is left out: the
    touches of a day count once.

    Raises
    ------
    InputError
        There is no such file, it is of another kind, or it is empty; a verification is in it
        twice.
    """
    if not Path(path).is_file():
        raise InputError(
            "there is no such history; the first verification that is given this file makes it",
            path=path,
        )
    entries = _entries(opened(path))
    if not entries:
        raise InputError("the history contains no verification yet", path=path)
    accepted = {
        entry[_TOUCHES_ID]: entry.number
        for entry in entries
        if entry[_TOUCHES_ID] and str(entry["decision"]).startswith("accepted ")
    }
    once = [entry for entry in entries if entry.number >= accepted.get(entry[_TOUCHES_ID], 0)]
    return sorted(once, key=lambda entry: (_moment(str(entry["time"])), entry.number))


def _without_rest(content: bytes) -> bytes:
    """The content without the begin of a line that an interrupted program left at its end."""
    end = content.rfind(b"\n") + 1
    rest = content[end:]
    begins = rest.startswith(_BEGIN[: len(rest)])
    return content[:end] if begins and not rest.endswith(b"}") else content


def _entries(file: SourceFile) -> list[Entry]:
    """The entries in the order of the file."""
    if len(file.content) > LARGEST_HISTORY:
        raise file.error(
            f"the file has {len(file.content) / 1e6:.0f} MB; a history has at most "
            f"{LARGEST_HISTORY / 1e6:.0f}"
        )
    lines = _without_rest(file.content).split(b"\n")
    first: dict[bytes, int] = {}
    for number, line in enumerate(lines, 1):
        if line.strip() and first.setdefault(line.strip(), number) != number:
            raise file.error(
                f"this line is line {first[line.strip()]} once more: one verification would count "
                "twice. Remove it",
                number,
            )
    return [_entry(file, number, line) for number, line in enumerate(lines, 1) if line.strip()]


def _entry(file: SourceFile, number: int, line: bytes) -> Entry:
    """A line after a check: any program can write to the file."""
    try:
        if len(line) > _LONGEST_LINE:
            raise ValueError
        found = json.loads(line)
        if not isinstance(found, dict) or found.pop("schema", None) != _SCHEMA:
            raise ValueError
    except (ValueError, RecursionError):
        raise file.error("this is not the history of a probe", number) from None
    version = found.pop("version", None)
    if version != HISTORY_VERSION:
        raise file.error(
            f"the history's format has version {version!r:.60}; this pretravel reads "
            f"{HISTORY_VERSION}",
            number,
        )
    found = dict.fromkeys(_LATER) | found
    if set(found) != {*_COLUMNS, *_LATER}:
        wrong = sorted(set(found) ^ {*_COLUMNS, *_LATER})[0]
        what = "has an unknown key" if wrong in found else "lacks the key"
        raise file.error(f"the entry is damaged: it {what} {wrong!r:.60}", number)
    for name, value in found.items():
        if not _fits(name, value):
            raise file.error(f"the entry is damaged: {name} is {value!r:.60}", number)
    return Entry(number, {name: found[name] for name in (*_COLUMNS, *_LATER)})


def _storable(value: float | int | str) -> float | int | str | None:
    """What is not known (nan, or infinite) becomes null; a name of a file becomes Unicode."""
    if isinstance(value, str):
        return value.encode(errors="replace").decode()[:_LONGEST_TEXT]
    return value if math.isfinite(value) else None


def _fits(name: str, value: Any) -> bool:
    """Whether a value is one that a verification has."""
    if name == _TOUCHES_ID and value is None:
        return True
    if name in _TEXTS:
        return isinstance(value, str) and _is_text(value) and (name != "time" or _is_time(value))
    if name == "changed":
        return isinstance(value, bool)
    if value is None:
        return name not in _ALWAYS_THERE
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return False
    if not abs(value) <= _LARGEST:
        return False
    if name == "false_alarm_rate":
        return 0.0 < value < 1.0
    return value >= 0.0 or not name.startswith(("u_", "p_", "touches", "tip"))


def _is_text(value: str) -> bool:
    try:
        value.encode()
    except UnicodeEncodeError:
        return False
    return len(value) <= _LONGEST_TEXT


def _is_time(text: str) -> bool:
    try:
        _moment(text)
    except (ValueError, OverflowError):
        return False
    return True


def _moment(text: str) -> datetime:
    found = datetime.fromisoformat(text)
    return found.replace(tzinfo=found.tzinfo or UTC).astimezone(UTC)
