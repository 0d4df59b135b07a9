"""The history of one probe: every verification, in one SQLite file."""

from __future__ import annotations

import hashlib
import math
import os
import sqlite3
import time as clock
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from pretravel.base.errors import InputError
from pretravel.base.units import DEGREE, MICROMETRE
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.qualification.verification import Verification

_APPLICATION = 0x70726574  # "pret": identifies our files
_VERSION = 1
_SAME_TIP = 0.05
"""The tip diameters of one probe in repeated qualifications differ by less. [mm]"""
_WAIT_FOR_WRITER = 30.0
"""Time that a writer waits for another writer. [s]"""
_WAIT_FOR_JOURNAL = 5.0
"""Time until a journal counts as left behind: one entry is written in milliseconds. [s]"""
_NO_FOLDER = "the history cannot be made: the folder {folder} does not exist"
_COLUMNS = (
    "time", "map", "map_id", "tip_diameter_mm", "touches_file", "touches", "directions",
    "false_alarm_rate", "changed", "p_form", "p_map", "p_repeatability", "size_um", "u_size_um",
    "amplitude_percent", "u_amplitude_percent", "turn_deg", "u_turn_deg", "repeatability_um",
    "largest_um", "decision",
)  # fmt: skip


_TEXTS = ("time", "map", "map_id", "touches_file", "decision")
_ALWAYS_THERE = ("tip_diameter_mm", "touches", "directions", "false_alarm_rate", "changed")
_TABLE = "CREATE TABLE verification (number INTEGER PRIMARY KEY AUTOINCREMENT, {})".format(
    ", ".join(f"{name} TEXT NOT NULL" if name in _TEXTS else f"{name} REAL" for name in _COLUMNS)
)
_ENTRIES = f"SELECT number, {', '.join(_COLUMNS)} FROM verification"
_LARGEST = 1e9
"""No number of a verification is larger. Sizes in µm, angles in degrees, counts."""


@dataclass(frozen=True)
class Entry:
    """One stored verification; the units are in the names of the columns.

    Attributes
    ----------
    number : int
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
        stays locked.
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
        int(result.changed),
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
    with _history(path, create=True) as connection:
        _refuse_other_tip(connection, path, pretravel_map)
        marks = ", ".join("?" * len(_COLUMNS))
        cursor = connection.execute(
            f"INSERT INTO verification ({', '.join(_COLUMNS)}) VALUES ({marks})",
            [_storable(value) for value in row],
        )
        return int(cursor.lastrowid or 0)


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
    place = Path(path)
    if not place.parent.is_dir():
        raise InputError(_NO_FOLDER.format(folder=place.parent), path=path)
    _refuse_journal(path)
    if not place.exists() or (place.is_file() and not place.stat().st_size):
        return
    with _history(path, create=True) as connection:
        _refuse_other_tip(connection, path, pretravel_map)
        for row in connection.execute(_ENTRIES).fetchall():
            _entry(path, row)


def _refuse_other_tip(
    connection: sqlite3.Connection, path: str | Path, pretravel_map: PretravelMap
) -> None:
    last = connection.execute(f"{_ENTRIES} ORDER BY number DESC LIMIT 1").fetchone()
    if last is None:
        return
    tip_diameter = float(_entry(path, last)["tip_diameter_mm"] or 0.0)
    if abs(tip_diameter - 2.0 * pretravel_map.tip_radius) > _SAME_TIP:
        raise InputError(
            f"this history is of a probe with a tip of {tip_diameter:g} mm; that of the map has "
            f"a tip of {2.0 * pretravel_map.tip_radius:g} mm. Keep one history for each probe",
            path=path,
        )


def map_id(pretravel_map: PretravelMap) -> str:
    """Twelve digits that identify a map."""
    content = pretravel_map.coefficients.tobytes() + pretravel_map.rotation.tobytes()
    return hashlib.sha256(content).hexdigest()[:12]


def read_history(path: str | Path) -> list[Entry]:
    """All verifications of a probe, oldest first.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    list of Entry

    Raises
    ------
    InputError
        There is no such file, it is of another kind, or it is empty; an unfinished writing is
        beside it.
    """
    if not Path(path).is_file():
        raise InputError(
            "there is no such history; verify the probe with a history to make it", path=path
        )
    rows = _entries(path)
    if not rows:
        raise InputError("the history contains no verification yet", path=path)
    return [_entry(path, row) for row in rows]


def _entries(path: str | Path) -> list[tuple[object, ...]]:
    """All rows; again where another program wrote meanwhile, since reading takes no lock."""
    end = clock.monotonic() + _WAIT_FOR_WRITER
    while True:
        before = Path(path).stat()
        problem, rows = None, list[tuple[object, ...]]()
        try:
            with _history(path, create=False) as connection:
                rows = connection.execute(f"{_ENTRIES} ORDER BY time, number").fetchall()
        except InputError as error:
            problem = error
        after = Path(path).stat()
        same = (before.st_mtime_ns, before.st_size) == (after.st_mtime_ns, after.st_size)
        if problem is not None and (same or clock.monotonic() > end):
            raise problem
        if (same and not _journals(path)) or clock.monotonic() > end:
            return rows


def _journals(path: str | Path) -> list[str]:
    """What SQLite would carry out when it opens the history: an unfinished writing."""
    beside = (os.path.realpath(path) + ending for ending in ("-journal", "-wal"))
    return [each for each in beside if os.path.lexists(each)]


def _refuse_journal(path: str | Path) -> None:
    """Wait until another program has written, and refuse what an interrupted one left.

    A journal can name another file, which SQLite then deletes: none is carried out here.
    """
    end = clock.monotonic() + _WAIT_FOR_JOURNAL
    while found := _journals(path):
        if clock.monotonic() > end:
            name = Path(found[0]).name
            raise InputError(
                f"beside the history is {name}: a program was interrupted while it wrote, or still "
                "writes. In a history of your own, finish that with SQLite: sqlite3 "
                f'{Path(path).name} "PRAGMA integrity_check". In one of somebody else do not: '
                f"SQLite deletes files that such a file names; remove {name}",
                path=path,
            )
        clock.sleep(0.005)


def _address(path: str | Path, mode: str) -> str:
    """A file as SQLite's address, in which no sign of the name is part of a setting."""
    address = Path(os.path.realpath(path)).as_uri()
    if not address.startswith("file:///"):  # a share of Windows: SQLite knows no other computer
        address = address.replace("file://", "file:////", 1)
    return f"{address}?{mode}"


def _storable(value: float | int | str) -> float | int | str | None:
    """What is not known (nan, or infinite) becomes NULL, since SQLite cannot store nan."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _entry(path: str | Path, row: tuple[object, ...]) -> Entry:
    """A row of the table, after a check: any program can write to the file."""
    number, values = row[0], dict(zip(_COLUMNS, row[1:], strict=True))
    checked: dict[str, float | int | str | None] = {}
    for name, value in values.items():
        if name in _TEXTS:
            fits = isinstance(value, str) and (name != "time" or _is_time(value))
        elif value is None:
            fits = name not in _ALWAYS_THERE
        else:
            fits = _in_range(name, value)
        if not fits:
            raise InputError(
                f"entry {number} of the history is damaged: {name} is {value!r:.60}", path=path
            )
        checked[name] = value  # type: ignore[assignment]  # as it was checked
    if not isinstance(number, int):
        raise InputError(f"an entry of the history has the number {number!r:.60}", path=path)
    return Entry(number, checked)


def _in_range(name: str, value: object) -> bool:
    if not isinstance(value, (int, float)) or not abs(value) <= _LARGEST:
        return False
    if name == "changed":
        return value in (0, 1)
    if name == "false_alarm_rate":
        return 0.0 < value < 1.0
    return value >= 0.0 or not name.startswith(("u_", "p_", "touches", "tip"))


def _is_time(text: str) -> bool:
    try:
        datetime.fromisoformat(text)
    except ValueError:
        return False
    return True


@contextmanager
def _history(path: str | Path, *, create: bool) -> Iterator[sqlite3.Connection]:
    place = Path(path)
    if create and not place.parent.is_dir():
        raise InputError(_NO_FOLDER.format(folder=place.parent), path=path)
    _refuse_journal(path)
    # What is read does not change, and SQLite looks for no journal.
    address = _address(path, "mode=rwc" if create else "mode=ro&immutable=1")
    try:
        connection = sqlite3.connect(
            address, uri=True, timeout=_WAIT_FOR_WRITER, isolation_level=None
        )
    except sqlite3.Error as error:
        raise InputError(f"the history cannot be opened: {error}", path=path) from None
    try:
        # One writer at a time, from its first reading to its last writing.
        connection.execute("BEGIN IMMEDIATE" if create else "BEGIN")
        _prepare(connection, path, create=create)
        yield connection
        connection.execute("COMMIT")
    except sqlite3.OperationalError as error:
        raise InputError(f"the history cannot be used: {error}", path=path) from None
    # Damaged files can make sqlite3 raise others than its own.
    except (sqlite3.Error, UnicodeDecodeError, OverflowError, MemoryError) as error:
        raise InputError(f"this is not the history of a probe ({error})", path=path) from None
    finally:
        connection.close()


def _prepare(connection: sqlite3.Connection, path: str | Path, *, create: bool) -> None:
    (application,) = connection.execute("PRAGMA application_id").fetchone()
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    (tables,) = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
    if create and tables == 0 and application == 0:
        connection.execute(f"PRAGMA application_id = {_APPLICATION}")
        connection.execute(f"PRAGMA user_version = {_VERSION}")
        connection.execute(_TABLE)
        return
    if application != _APPLICATION:
        raise InputError("this is a database, but not the history of a probe", path=path)
    if version != _VERSION:
        raise InputError(
            f"the history's format has version {version}; this pretravel reads {_VERSION}",
            path=path,
        )
    kept = connection.execute(
        "SELECT type, sql FROM sqlite_master WHERE tbl_name = 'verification' OR type = 'trigger'"
    ).fetchall()
    # A view, a trigger or a computed column would be a program that runs here.
    if kept != [("table", _TABLE)]:
        raise InputError(
            "the history is damaged, or another program changed the form of its table", path=path
        )
