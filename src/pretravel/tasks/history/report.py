"""Report of the history of a probe: all its verifications."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from pretravel.files import Entry
from pretravel.qualification import DriftOverTime
from pretravel.show import Column, Document, Picture, Table, decimals, signed_decimals
from pretravel.tasks.history.drift_report import drift_figures, drift_tables, drift_verdict
from pretravel.tasks.history.entries import decision_words, entry_value

if TYPE_CHECKING:
    from pretravel.show import View


def history_document(
    entries: Sequence[Entry], *, history_name: str = "", drift: DriftOverTime | None = None
) -> Document:
    """The report of a history: a row for each verification.

    Parameters
    ----------
    entries : sequence of Entry
    history_name : str
        Of the file.
    drift : DriftOverTime, optional
        What the entries show of it.
    """
    title = history_name or "History of a probe"
    changed = sum(bool(entry["changed"]) for entry in entries)
    unseen = sum(entry["unseen_turn_deg"] is not None for entry in entries)
    told = drift is not None and bool(drift.last)

    def drawn() -> View:
        from pretravel.tasks.history.picture import history_view

        return history_view(entries, title, drift if told else None)

    return Document(
        title=title,
        verdict=f"{title}: {len(entries)} verification{'' if len(entries) == 1 else 's'}, "
        + (f"{changed} found a change" if changed else "no change found")
        + (f", BUT {unseen} CANNOT SHOW A TURN OF THE PROBE" if unseen else "")
        + ("" if drift is None else f"; {drift_verdict(drift)}"),
        figures=drift_figures(drift) if drift is not None and told else (),
        tables=(
            _verifications_table(entries),
            *(() if drift is None else drift_tables(drift)),
        ),
        pictures=(
            Picture("Control chart, and the drift over time" if told else "Control chart", drawn),
        ),
    )


def _verifications_table(entries: Sequence[Entry]) -> Table:
    def numbers(column: str) -> list[float]:
        return [entry_value(entry, column) for entry in entries]

    times = [str(entry["time"])[:16].replace("T", " ") for entry in entries]
    verdicts = [_verdict(entry) for entry in entries]
    return Table(
        (
            Column.of("time (UTC)", times),
            Column.of("map", [str(entry["map"]) for entry in entries]),
            Column.of("verdict", verdicts),
            Column.of("size", numbers("size_um"), "µm", signed_decimals(2)),
            Column.of("amplitude", numbers("amplitude_percent"), "%", signed_decimals(1)),
            Column.of("turn", numbers("turn_deg"), "°", signed_decimals(2)),
            Column.of("repeatability", numbers("repeatability_um"), "µm", decimals(2)),
            Column.of("new map", [decision_words(str(entry["decision"])) for entry in entries]),
        )
    )


def _verdict(entry: Entry) -> str:
    if entry["unseen_turn_deg"] is not None:
        return "no change, but a turn is not seen"
    return "CHANGED" if entry["changed"] else "no change"


def history_columns(entries: Sequence[Entry]) -> dict[str, npt.ArrayLike]:
    """Columns of a file: all those of a history; not a number where something was not tested."""
    columns: dict[str, npt.ArrayLike] = {"number": [entry.number for entry in entries]}
    for name in entries[0].values:
        values = [entry[name] for entry in entries]
        if any(isinstance(value, str) for value in values):
            columns[name] = [str(value) for value in values]
        else:
            columns[name] = np.array([entry_value(entry, name) for entry in entries])
    return columns
