"""Compensated points in the format of the file's ending."""

from __future__ import annotations

from pathlib import Path

from pretravel.base import TIP_RADIUS, FloatArray, PretravelError, checked
from pretravel.files.file_format import PointsOrigin
from pretravel.files.format_registry import FORMATS
from pretravel.measurement import Points


def write_points(
    path: str | Path,
    points: Points,
    note: str = "",
    *,
    nominal_points: FloatArray | None = None,
    tip_radius: float | None = None,
) -> None:
    """Write points in the format of the path's ending, for example .csv, .nc or .qif.

    Parameters
    ----------
    path : str or Path
    points : Points
    note : str
        How the points were made, for the attributes of a NetCDF file.
    nominal_points : (n, 3) float, optional
        The targets of the touches on the nominal surface, for Fusion results. [mm]
    tip_radius : float, optional
        Of the map, for Fusion results. [mm]

    Raises
    ------
    PretravelError
        No format of points has this ending; the format needs what was not given.
    """
    if tip_radius is not None:
        checked(tip_radius, "the tip's radius", TIP_RADIUS, inputs=("tip_radius",))
    ending = Path(path).suffix.lower()
    for known in FORMATS.values():
        if known.write_points is not None and ending in known.endings:
            known.write_points(Path(path), points, PointsOrigin(note, nominal_points, tip_radius))
            return
    raise PretravelError(
        f"points cannot be written to '{path}': the ending must be {', '.join(point_endings())}"
    )


def point_endings() -> tuple[str, ...]:
    """Return the endings of the files to which points can be written."""
    return tuple(e for known in FORMATS.values() if known.write_points for e in known.endings)
