"""Compensate touches: readings and a map to surface points, and their report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from pretravel.base.frames import Placement
from pretravel.files.file_format import FileReadings
from pretravel.files.point_files import write_points
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.measurement.compensation import apply, compensation_warnings
from pretravel.measurement.point_budget import point_budget
from pretravel.measurement.point_errors import PointErrors, errors_of_points
from pretravel.measurement.points import Points, placed
from pretravel.measurement.points_summary import TouchSummary
from pretravel.show.document import Document
from pretravel.surface.cad.part import Part
from pretravel.surface.local_geometry import Surface
from pretravel.tasks.reports.points_report import points_document
from pretravel.touches import Touches, moved, with_feed


@dataclass(frozen=True)
class CompensationSetup:
    """What a compensation knows beside touches and map.

    Attributes
    ----------
    nominal : Surface, Part or None
        The contact is computed on it; None: the normals are those of the touches.
    extrapolate : bool
        Whether directions outside the map are allowed.
    placement : Placement or None
        Of the part in the machine; None: what the file states.
    frame : str
        That the touches are in: "part" or "machine".
    feed : float or None
        Of touches that do not state theirs. [mm/min]
    shared : bool
        The points state which errors they have in common.
    """

    nominal: Surface | Part | None = None
    extrapolate: bool = False
    placement: Placement | None = None
    frame: Literal["part", "machine"] = "part"
    feed: float | None = None
    shared: bool = True


@dataclass(frozen=True)
class CompensatedTouches:
    """Surface points with the touches and the map that they come from.

    Attributes
    ----------
    readings : FileReadings
    touches : Touches
        In the frame of the part.
    pretravel_map : PretravelMap
    setup : CompensationSetup
    points : Points
        In the frame of the touches as they were given.
    errors : PointErrors
        Sources of error of the points, in the frame of the part; `point_budget` makes budgets.
    warnings : tuple of str
    summary : TouchSummary
        Of the touches, which the warnings come from.
    """

    readings: FileReadings
    touches: Touches
    pretravel_map: PretravelMap
    setup: CompensationSetup
    points: Points
    errors: PointErrors
    warnings: tuple[str, ...]
    summary: TouchSummary

    def document(self, touches_name: str = "", *, warnings: Sequence[str] = ()) -> Document:
        """The report; parameters as those of `points_document`."""
        placement = self.setup.placement or self.readings.placement
        return points_document(
            self.points,
            touches_name=touches_name,
            nominal=self.setup.nominal,
            placement=placement if self.setup.frame == "machine" else None,
            warnings=[*self.readings.notes(), *self.warnings, *warnings],
            budgets=[point_budget(self.errors)],
        )

    def write(self, path: str | Path, touches_name: str, map_name: str) -> None:
        """Write the points, with the names of the files that they come from.

        Parameters
        ----------
        path : str or Path
            Its ending tells the format; see `write_points`.
        touches_name, map_name : str
        """
        made = self.pretravel_map
        source = made.provenance.source or "unknown"
        read = self.touches.reading
        reading = f"; {touches_name} was read as {read}" if read else ""
        write_points(
            path,
            self.points,
            f"{touches_name} compensated with {map_name} ({made.kind}; {source}){reading}",
            nominal_points=self.touches.nominal_points,
            tip_radius=made.tip_radius,
        )


def compensate_readings(
    readings: FileReadings,
    pretravel_map: PretravelMap,
    setup: CompensationSetup = CompensationSetup(),
) -> CompensatedTouches:
    """Compensate the touches of files to surface points.

    Parameters
    ----------
    readings : FileReadings
        From `read_series`.
    pretravel_map : PretravelMap
        In the axes of the machine.
    setup : CompensationSetup

    Returns
    -------
    CompensatedTouches

    Raises
    ------
    PretravelError
        Touches without normals or nominal, directions outside the map.
    """
    measured = with_feed(readings.touches, setup.feed)
    # A log states the rotation of its work coordinates.
    placement = readings.placement if setup.placement is None else setup.placement
    in_machine = setup.frame == "machine"
    if in_machine:
        measured = moved(measured, placement.inverse)
    seen = pretravel_map.seen_from(placement)
    points = apply(
        measured,
        seen,
        nominal=setup.nominal,
        extrapolate=setup.extrapolate,
        shared=setup.shared,
    )
    errors = errors_of_points(measured, points.normals, seen)
    summary = TouchSummary.of(measured, points, seen)
    if in_machine:
        points = placed(points, placement)
    warnings = tuple(compensation_warnings(summary, pretravel_map))
    return CompensatedTouches(
        readings, measured, pretravel_map, setup, points, errors, warnings, summary
    )
