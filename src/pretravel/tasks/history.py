"""The history of a probe: a folder of touches, one file a day, or the file of its verifications."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pretravel.base.errors import InputError, PretravelError
from pretravel.files.file_dates import DatedFile, dated_file
from pretravel.files.file_format import ReadingOptions
from pretravel.files.history_drift import drift_of_entries
from pretravel.files.probe_history import Entry, read_history
from pretravel.files.several_files import read_series
from pretravel.maps.pretravel_map import PretravelMap, over_support
from pretravel.maps.provenance import QualificationSetup
from pretravel.qualification.day_terms import DayTerms, day_quantities, day_terms
from pretravel.qualification.drift_over_time import DriftOverTime, drift_over_time
from pretravel.qualification.own_touches import own_touches_warnings
from pretravel.qualification.verification import refuse_unverifiable
from pretravel.show.document import Document
from pretravel.tasks.qualify import KindWish, qualify_probe
from pretravel.tasks.reports.drift_report import DayFile, FolderDrift
from pretravel.tasks.reports.history_report import history_document
from pretravel.uncertainty.gum import COVERAGE_FACTOR

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class HistorySetup:
    """What is known of all files of a history.

    Attributes
    ----------
    reference : QualificationSetup
    options : ReadingOptions
        Of each file.
    limit : float or None
        Allowed change of the map; None: its expanded uncertainty, U = 2 u. [mm]
    wish : KindWish
        Kind of the first file's map, where none is given.
    pretravel_map : PretravelMap or None
        That all days are compared with; None: that of the first file.
    map_name : str
    """

    reference: QualificationSetup
    options: ReadingOptions
    limit: float | None = None
    wish: KindWish = field(default=KindWish())
    pretravel_map: PretravelMap | None = None
    map_name: str = ""


@dataclass(frozen=True)
class VerificationHistory:
    """The verifications of a probe with the drift that they show.

    Attributes
    ----------
    entries : tuple of Entry
    drift : DriftOverTime
    """

    entries: tuple[Entry, ...]
    drift: DriftOverTime

    def document(self, history_name: str = "") -> Document:
        """The report."""
        return history_document(self.entries, history_name=history_name, drift=self.drift)


def history_of_verifications(path: Path, limit: float | None = None) -> VerificationHistory:
    """Read the file of a probe's verifications, and determine the drift that they show.

    Parameters
    ----------
    path : Path
    limit : float, optional
        See `drift_of_entries`. [mm]

    Raises
    ------
    PretravelError
        As `read_history`; a limit that is not positive.
    """
    entries = tuple(read_history(path))
    return VerificationHistory(entries, drift_of_entries(entries, limit))


def history_of_files(paths: Sequence[Path], setup: HistorySetup) -> FolderDrift:
    """Compare the touches of many days with one map, and determine how the probe drifts.

    One file after the other is read, compared and forgotten.

    Parameters
    ----------
    paths : sequence of Path
        A file for each day or shift, in any order.
    setup : HistorySetup

    Returns
    -------
    FolderDrift
        Files that cannot be used are named in it, with the reason.

    Raises
    ------
    PretravelError
        No file can be used; a map that touches cannot be compared with; as `dated_file`.
    """
    dated = sorted((dated_file(path) for path in paths), key=lambda one: (one.moment, one.path))
    made, name = setup.pretravel_map, setup.map_name
    if made is not None:
        refuse_unverifiable(made)
    days: list[DayFile] = []
    unusable: list[tuple[DatedFile, str]] = []
    for count, file in enumerate(dated):
        _LOG.info("%s", file.path.name, extra={"done": count / len(dated)})
        try:
            if made is None:
                first, terms = _first_day(file, setup)
                made, name = first, file.path.name
            else:
                terms = _terms(file, setup, made)
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
        _allowed(made) if setup.limit is None else setup.limit,
    )
    return FolderDrift(tuple(days), tuple(unusable), drift, made, name, setup.limit is None)


def _allowed(pretravel_map: PretravelMap) -> float:
    """Expanded uncertainty of a map over its directions: smaller changes do not matter. [mm]"""
    u = over_support(pretravel_map)[2]
    return COVERAGE_FACTOR * float(np.sqrt(np.mean(u**2)))


def _first_day(file: DatedFile, setup: HistorySetup) -> tuple[PretravelMap, DayTerms]:
    readings = read_series([file.path], setup.options).in_machine_axes()
    made = qualify_probe(readings, setup.reference, setup.wish).pretravel_map
    refuse_unverifiable(made)
    return made, day_terms(readings.touches, made, setup.reference, own=True)


def _terms(file: DatedFile, setup: HistorySetup, pretravel_map: PretravelMap) -> DayTerms:
    touches = read_series([file.path], setup.options).in_machine_axes().touches
    own = bool(own_touches_warnings(touches, pretravel_map, ""))
    return day_terms(touches, pretravel_map, setup.reference, own=own)
