"""What the daily check computes: today's touches against the map, and the history with today."""

from __future__ import annotations

from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from pretravel.app import Inputs, Job, ScreenState, StoredFile, TaskForm, with_file_names
from pretravel.base import MICROMETRE, temporary_folder
from pretravel.show import Document, Judgement, KeyFigure, Picture, Table, decimals
from pretravel.tasks.verify.task import VerifiedProbe, Verify

if TYPE_CHECKING:
    from pretravel.files import Entry
    from pretravel.qualification import DriftOverTime

DAILY_FORM = TaskForm(Verify, shared=("units", "axis", "feed"))
HISTORY = "history.jsonl"
"""The file in which the project keeps all days, and which the commands verify and history read."""


@dataclass(frozen=True, eq=False)
class DailyResult:
    """Today's verification, and the days with it.

    Attributes
    ----------
    made : VerifiedProbe
    entries : tuple of Entry
        All days.
    history : bytes
        The file of the history, with today.
    document : Document
    same : Verify
        As the user can do it.
    """

    made: VerifiedProbe
    entries: tuple[Entry, ...]
    history: bytes
    document: Document
    same: Verify


def check_today(inputs: Inputs) -> DailyResult:
    """Verify the probe with today's touches, and add the day to the history.

    Raises
    ------
    StaleTouchesError
        The history has these touches already, of an earlier day, or the map was made from them.
    PretravelError
        As `Verify.run`; the history is that of another probe.
    """
    from pretravel.files import (
        add_verification,
        check_history,
        read_map,
        refuse_known_touches,
        replaced_since,
        time_of_touches,
    )

    task = Verify(
        touches=inputs.files["touches"],
        map_file=inputs.file("map"),
        **DAILY_FORM.given(inputs.settings),
    )
    made = task.run()
    old_map = read_map(task.map_file)
    with temporary_folder() as folder:
        path = folder / HISTORY
        before = inputs.optional_file("history")
        content = b"" if before is None else before.read_bytes()
        content, time = _without_today(content, folder, made)
        if content:
            path.write_bytes(content)
        check_history(path, old_map)
        known = made.readings.in_machine_axes().touches
        refuse_known_touches(path, known, of_files=made.readings.digests)
        if content:
            later = replaced_since(path, old_map)
            warnings = (*made.readings.warnings, *later)
            made = replace(made, readings=replace(made.readings, warnings=warnings))
        add_verification(
            path,
            made.verification,
            pretravel_map=old_map,
            map_name=task.map_file.name,
            touches_name=task.touches_name,
            decision=task.decision,
            time=time or time_of_touches(task.files)[0],
        )
        entries, content = _entries(path), path.read_bytes()
    same = with_file_names(task, history=Path(HISTORY))
    return DailyResult(made, entries, content, _document(made, entries), same)


def _entries(path: Path) -> tuple[Entry, ...]:
    from pretravel.files import read_history

    return tuple(read_history(path))


def _without_today(
    content: bytes, folder: Path, made: VerifiedProbe
) -> tuple[bytes, datetime | None]:
    """The history without a last entry of the same touches, and its time.

    They are computed again after a new start, with another diameter or with a newer map: a day is
    one entry.
    """
    from pretravel.files import read_history

    if not content.strip():
        return b"", None
    path = folder / "before.jsonl"
    path.write_bytes(content)
    last = max(read_history(path), key=lambda entry: entry.number)
    if last["touches_id"] != made.verification.touches_digest:
        return content, None
    return without_last_day(content), datetime.fromisoformat(str(last["time"]))


def without_last_day(content: bytes) -> bytes:
    r"""A history without its last line.

    >>> without_last_day(b"one\ntwo\n")
    b'one\n'
    """
    return b"".join(line for line in content.splitlines(keepends=True)[:-1])


def _document(made: VerifiedProbe, entries: tuple[Entry, ...]) -> Document:
    """The answer of today, with the chart of all days and the date of the next qualification."""
    from pretravel.files import drift_of_entries
    from pretravel.tasks.history import drift_verdict, history_document

    today, drift = made.document(), drift_of_entries(entries)
    all_days = history_document(entries, drift=drift)
    largest = made.verification.largest / MICROMETRE
    changed, verdict = made.verification.changed, drift_verdict(drift)
    return replace(
        today,
        title="Daily check",
        verdict=f"{made.verification.touches} touches in {len(made.verification.directions)} "
        f"directions. {verdict[:1].upper()}{verdict[1:]}.",
        judgement=_judgement(made),
        figures=(
            KeyFigure("largest difference from the map", largest, "µm", decimals(1)),
            KeyFigure("qualify again", _when(changed, drift), remark=_days(len(entries))),
            *(figure for figure in today.figures if figure.name in _OF_TODAY),
            *all_days.figures,
        ),
        pictures=(*(_all_days(picture) for picture in all_days.pictures), *today.pictures),
        tables=tuple(_newest_first(table) for table in all_days.tables),
    )  # fmt: skip


def _judgement(made: VerifiedProbe) -> Judgement:
    from pretravel.files import read_map
    from pretravel.qualification import own_touches_warnings
    from pretravel.tasks.verify.report import verification_judgement

    if made.verification.changed:
        return Judgement("bad", "Changed: qualify again")
    touches = made.readings.in_machine_axes().touches
    if own_touches_warnings(touches, read_map(made.task.map_file), ""):
        return Judgement("caution", "Doubtful: touches of the map are among these")
    return verification_judgement(made.verification)


_OF_TODAY = ("likely cause", "size")
"""Figures of the verification that are shown; its report has all."""


def _days(count: int) -> str:
    return f"from {count} check{'' if count == 1 else 's'} in the history"


def _when(changed: bool, drift: DriftOverTime) -> str:
    """When the probe is to be qualified again, in a word or a date."""
    if changed:
        return "now"
    _, due = drift.first_due()
    _, early = drift.first_due(early=True)
    if due <= drift.times[-1] or early <= drift.times[-1]:
        return "now"
    moment = drift.moment(early) or drift.moment(due)
    if moment is not None:
        return moment.strftime("%Y-%m-%d")
    return "no date: no drift is seen" if drift.last else "known after checks of three days"


def _all_days(picture: Picture) -> Picture:
    return replace(picture, caption=f"All days: {picture.caption[0].lower()}{picture.caption[1:]}")


def _newest_first(table: Table) -> Table:
    """The rows of a table of days, today's first."""
    columns = tuple(replace(c, values=tuple(reversed(c.values))) for c in table.columns)
    return replace(table, columns=columns)


def _lacks(state: ScreenState) -> str:
    if state.settings.get("diameter") is None:
        return "Next: the diameter of the reference, from its certificate."
    return ""


def _to_keep(result: DailyResult) -> dict[str, tuple[StoredFile, ...]]:
    return {"history": (StoredFile(HISTORY, result.history),)}


DAILY = Job(
    "daily",
    check_today,
    "Checking",
    settings=DAILY_FORM.stored,
    files=("touches", "map", "history"),
    needs=("touches", "map"),
    lacks=_lacks,
    keeps=_to_keep,
)
