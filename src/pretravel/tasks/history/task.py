"""The history of a probe: a folder of touches, one file a day, or the file of its verifications."""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.base import MICROMETRE, REFERENCE_DIAMETER, TIP_BALL, InputError, PretravelError
from pretravel.task import (
    PAGES,
    SILENT,
    Field,
    InModes,
    OfOneTip,
    Progress,
    Reported,
    Result,
    Ring,
    TouchTables,
    When,
    files_meant,
    output,
)

if TYPE_CHECKING:
    from pretravel.files import DatedFile, Entry, FileReadings
    from pretravel.maps import PretravelMap, QualificationSetup
    from pretravel.qualification import DayTerms, DriftOverTime
    from pretravel.show import Document
    from pretravel.tasks.history.drift_report import DayFile, FolderDrift

    _Reading = Callable[[Sequence[Path]], FileReadings]

_LOG = logging.getLogger(__name__)


def _are_verifications(places: Sequence[Path]) -> bool:
    from pretravel.files import HISTORY_ENDING

    if len(places) != 1:
        return False
    place = Path(places[0])
    return place.suffix.lower() == HISTORY_ENDING and not place.is_dir()


_VERIFICATIONS = When("places", is_so=_are_verifications, what="a file of verifications")
"""They state their reference and map."""


def _kinds() -> tuple[str, ...]:
    """Kinds of map that follow the probe closely enough to be compared with."""
    return "auto", "harmonic", "physical"


def _by_further_files(_: object) -> list[Path]:
    """The files, without outputs in the same folder, are those of `History.further_files`."""
    return []


class History(
    TouchTables,
    OfOneTip,
    Reported,
    without=dict.fromkeys((*TouchTables.__annotations__, "tip"), (_VERIFICATIONS,)),
):
    """Show how a probe drifts over time, and when its next qualification is due.

    The input is either a folder with one file of touches for each day (then give --diameter), or
    the history file that pretravel verify --history writes, which --plot shows as a control chart.
    Both need three days or more for drift and due date.
    """

    name = "history"
    example = "pretravel history logs --diameter 25 --tip-diameter 6 --limit 1 --plot drift.png"

    places: Annotated[
        tuple[Path, ...],
        Field(
            help="History file of one probe (.jsonl), or a folder with one file of touches for "
            "each day or shift. The date is that in the name of the file (2026-03-14, 20260314, "
            "14-03-2026) or of its rows, else that of its last change. Also several files, or a "
            "name with *.",
            label="History",
            positional=True,
            metavar="HISTORY",
            reads=_by_further_files,
        ),
    ]
    diameter: Annotated[
        float | None,
        Field(
            help="Calibrated diameter of the sphere (or ring), in mm.",
            without=(_VERIFICATIONS,),
            range=REFERENCE_DIAMETER,
        ),
    ] = None
    tip_diameter: Annotated[
        float | None,
        Field(
            help="Diameter of the tip, in mm.", range=TIP_BALL, without=(_VERIFICATIONS, "map_file")
        ),
    ] = None
    map_file: Annotated[
        Path | None,
        Field(
            help="Map (.json) with which every day is compared; the default is the map of the "
            "first file.",
            states="the map gives it",
            without=(_VERIFICATIONS,),
            option="--map",
            label="Map",
            reads=True,
        ),
    ] = None
    kind: Annotated[
        str | None,
        Field(
            help="Kind of the map that is made from the first file, without --map: auto, harmonic "
            "or physical.",
            without=(_VERIFICATIONS, "map_file"),
            names=_kinds,
            metavar="KIND",
        ),
    ] = None
    ring: Annotated[Ring, InModes(without=(_VERIFICATIONS,))] = False
    limit_um: Annotated[
        float | None,
        Field(
            help="Allowed change of the map, in µm: a new qualification is due when the drift "
            "exceeds it. Amplitude and turn count by the largest change of the map that they "
            "cause. Default: twice the rms u of the map, or, for a history file, twice the "
            "median u of the size.",
            range=(0.01, 1000.0),
        ),
    ] = None
    output: Annotated[
        Path | None, output("Table: .csv; or a page, .html or .pdf.", ".csv", *PAGES)
    ] = None

    def run(self, progress: Progress = SILENT) -> VerificationHistory | TouchHistory:
        """Read the history and determine the drift that it shows.

        Returns
        -------
        VerificationHistory
            Or `TouchHistory`, of files of touches.
        """
        from pretravel.files import read_series

        if self._is_of_verifications():
            return self._of_verifications(self.places[0])
        reference, old_map = self._reference()
        options = self.reading_options(
            tip_diameter=self.tip_diameter, reference_diameter=self.diameter, ring=self.ring
        )
        reading = partial(read_series, options=options, file_format=self.file_format)
        files = self.further_files()
        with progress.working(f"history of {len(files)} files"):
            return TouchHistory(self, self._drift(files, reading, reference, old_map))

    def further_files(self) -> list[Path]:
        """The file of verifications; or those with touches, without outputs of the same folder."""
        if self._is_of_verifications():
            return list(self.places)
        return [path for path in files_meant(self.places) if path not in (self.output, self.plot)]

    @property
    def limit(self) -> float | None:
        """The allowed change of the map. [mm]"""
        return None if self.limit_um is None else self.limit_um * MICROMETRE

    def _is_of_verifications(self) -> bool:
        """Whether the argument is the file of verifications, not touches."""
        return _are_verifications(self.places)

    def _of_verifications(self, path: Path) -> VerificationHistory:
        from pretravel.files import drift_of_entries, read_history

        entries = tuple(read_history(path))
        return VerificationHistory(self, entries, drift_of_entries(entries, self.limit))

    def _reference(self) -> tuple[QualificationSetup, PretravelMap | None]:
        """The reference, and the map that the days are compared with where one is given."""
        from pretravel.files import read_map
        from pretravel.maps import QualificationSetup

        tip_diameter, ring = self.tip_diameter, self.ring
        if self.diameter is None:
            raise PretravelError(
                "a history of touches needs the calibrated diameter of the reference (a file of "
                "verifications, .jsonl, does not)",
                inputs=("diameter",),
            )
        if self.map_file is None:
            return QualificationSetup(self.diameter, tip_diameter=tip_diameter, ring=ring), None
        old_map = read_map(self.map_file)
        return QualificationSetup(self.diameter, 2.0 * old_map.tip_radius, ring=ring), old_map

    def _drift(
        self,
        paths: Sequence[Path],
        reading: _Reading,
        reference: QualificationSetup,
        old_map: PretravelMap | None,
    ) -> FolderDrift:
        """Compare the touches of many days with one map.

        One file after the other is read, compared and forgotten. Files that cannot be used are
        named with the reason.
        """
        from pretravel.files import dated_file
        from pretravel.qualification import day_quantities, drift_over_time, refuse_unverifiable
        from pretravel.tasks.history.drift_report import DayFile, FolderDrift

        dated = sorted((dated_file(path) for path in paths), key=lambda one: (one.moment, one.path))
        made, name = old_map, "" if self.map_file is None else self.map_file.name
        if made is not None:
            refuse_unverifiable(made)
            _refuse_other_reference(made, reference)
        days: list[DayFile] = []
        unusable: list[tuple[DatedFile, str]] = []
        seen: dict[str, str] = {}
        for count, file in enumerate(dated):
            _LOG.info("%s", file.path.name, extra={"done": count / len(dated)})
            try:
                if file.unclear:
                    raise PretravelError(f"its name has no date, and in its rows {file.unclear}")
                readings = _readings(file, reading, seen)
                if made is None:
                    first, terms = _first_day(readings, reference, self.kind or "auto")
                    made, name = first, file.path.name
                else:
                    terms = _terms(readings, reference, made)
            except PretravelError as error:
                unusable.append((file, str(error)))
                continue
            days.append(DayFile(file, terms))
        if made is None or not days:
            shown = unusable[0][1] if unusable else "there is none"
            raise InputError(
                f"none of {len(dated)} file{'s' if len(dated) != 1 else ''} can be used. The first "
                f"one: {shown}"
            )
        _LOG.info("drift over time")
        drift = drift_over_time(
            [day.file.moment for day in days],
            day_quantities([day.terms for day in days], made),
            _allowed(made) if self.limit is None else self.limit,
        )
        return FolderDrift(tuple(days), tuple(unusable), drift, made, name, self.limit is None)


@dataclass(frozen=True, eq=False)
class VerificationHistory(Result):
    """The verifications of a probe with the drift that they show."""

    task: History
    entries: tuple[Entry, ...]
    drift: DriftOverTime

    def document(self) -> Document:
        """The report."""
        from pretravel.tasks.history.report import history_document

        name = self.task.places[0].name
        return history_document(self.entries, history_name=name, drift=self.drift)

    def write(self, output: str, path: Path) -> None:
        """Write the verifications, a row for each."""
        del output
        from pretravel.files import write_csv_table
        from pretravel.tasks.history.report import history_columns

        write_csv_table(path, history_columns(self.entries))


@dataclass(frozen=True, eq=False)
class TouchHistory(Result):
    """Files of touches of many days with the drift that they show."""

    task: History
    found: FolderDrift

    def document(self) -> Document:
        """The report."""
        from pretravel.tasks.history.drift_report import folder_document

        places = self.task.places
        if len(places) == 1:
            return folder_document(self.found, places[0].name)
        files = self.task.further_files()
        return folder_document(self.found, f"{files[0].name} … {files[-1].name}")

    def write(self, output: str, path: Path) -> None:
        """Write the days, a row for each."""
        del output
        from pretravel.files import write_csv_table
        from pretravel.tasks.history.drift_report import day_columns

        write_csv_table(path, day_columns(self.found))


def _refuse_other_reference(made: PretravelMap, reference: QualificationSetup) -> None:
    """Refuse a map from another reference: errors of both diameters would look like a change."""
    from pretravel.qualification import other_reference

    for said in other_reference(reference, made)[1]:
        raise PretravelError(
            f"{said}. If not, leave the map out: the days are then compared with the first one, "
            "and the errors of two diameters do not look like a change since then",
            inputs=("diameter", "map_file"),
        )


def _allowed(pretravel_map: PretravelMap) -> float:
    """Expanded uncertainty of a map over its directions: smaller changes do not matter. [mm]"""
    import numpy as np

    from pretravel.uncertainty import COVERAGE_FACTOR

    u = pretravel_map.over_support()[2]
    return COVERAGE_FACTOR * float(np.sqrt(np.mean(u**2)))


def _readings(file: DatedFile, reading: _Reading, seen: dict[str, str]) -> FileReadings:
    """The touches of a day, which are added to those that were seen.

    Raises
    ------
    PretravelError
        The program did not run to its end, or the touches are those of another file.
    """
    import numpy as np

    from pretravel.qualification import touch_digests

    found = reading([file.path]).in_machine_axes()
    if found.unfinished:
        raise PretravelError(found.unfinished)
    digests = touch_digests(np.round(found.touches.positions, 6))  # a copy can be sorted
    other = seen.setdefault(digests, file.path.name)
    if other != file.path.name:
        raise PretravelError(
            f"its touches are those of {other}: a copy of a file is not another day"
        )
    return found


def _first_day(
    readings: FileReadings, reference: QualificationSetup, kind: str
) -> tuple[PretravelMap, DayTerms]:
    from pretravel.qualification import day_terms, qualified, refuse_unverifiable

    try:
        found = qualified(readings.touches, reference, kind)
    except PretravelError as error:
        if "axis" not in error.inputs:
            raise
        raise PretravelError(
            f"{error}. A history takes the axis from a map: qualify the probe, and give its map",
            inputs=("map_file",),
        ) from None
    made = found.pretravel_map
    refuse_unverifiable(made)
    terms = day_terms(readings.touches, made, reference, own=True)
    said = dict.fromkeys((*found.warnings, *terms.warnings))  # of the map, and of the day
    return made, _with_notes(replace(terms, warnings=tuple(said)), readings)


def _terms(
    readings: FileReadings, reference: QualificationSetup, pretravel_map: PretravelMap
) -> DayTerms:
    from pretravel.qualification import day_terms, own_touches_warnings

    touches = readings.touches
    own = bool(own_touches_warnings(touches, pretravel_map, ""))
    return _with_notes(day_terms(touches, pretravel_map, reference, own=own), readings)


def _with_notes(terms: DayTerms, readings: FileReadings) -> DayTerms:
    return replace(terms, warnings=(*readings.notes(), *terms.warnings))
