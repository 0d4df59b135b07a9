"""Where a part lies, from touches alone: the search from nothing, and the alignment from there."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pretravel.base import Placement, PretravelError
from pretravel.drawing.alignment.alignment import Alignment, Datum
from pretravel.drawing.alignment.alignment_fit import align as align_from
from pretravel.drawing.alignment.alignment_search import found_placements
from pretravel.drawing.alignment.tip_centres import TipCentres
from pretravel.files import ReadingOptions, one_normal, read_readings
from pretravel.maps import MapLike, PretravelMap, as_map, refuse_other_orientation
from pretravel.surface import Part
from pretravel.touches import Touches

_MOST_LISTED = 8


def align(
    touches: Touches | str | Path,
    part: Part,
    pretravel_map: MapLike,
    *,
    start: Placement | None = None,
    datums: Sequence[Datum] = (),
    extrapolate: bool = False,
) -> Alignment:
    """Determine where a part lies in the machine, from touches on its faces.

    Parameters
    ----------
    touches : Touches, str or Path
        Tip centres, in the axes of the machine; or a file of them, which needs no normals. The
        normals of `Touches` are taken as directions of approach alone.
    part : Part
    pretravel_map : PretravelMap, Qualification, str or Path
    start : Placement, optional
        Near the answer. Without it the placement is searched over all positions.
    datums : sequence of Datum, optional
        In the order of the drawing; without them the best fit on all touched faces.
    extrapolate : bool
        Also for normals outside the directions of the map.

    Returns
    -------
    Alignment
        `Alignment.in_part` has the compensated points in the frame of the part, each with the
        number of its face.

    Raises
    ------
    PretravelError
        Something else in the place of part, start or datums; no placement explains the touches,
        or several do; touches at another orientation of the
        spindle or head than the map.
    InputError
        A file that is not one of touches.
    """
    for given, expected, makes in (
        (part, Part, "read_part makes one of a file"),
        (start, Placement | None, "read_placement makes one of a file"),
        *((datum, Datum, "such as Datum('A', (3,))") for datum in datums),
    ):
        if not isinstance(given, expected):
            name = getattr(expected, "__name__", "Placement")
            raise PretravelError(f"expected a {name}, not a {type(given).__name__}: {makes}")
    pretravel_map = as_map(pretravel_map)
    stated_approaches = True
    if not isinstance(touches, Touches):
        options = ReadingOptions(normals_from=one_normal([0.0, 0.0, 1.0]))
        read = read_readings(touches, options).in_machine_axes()
        touches, stated_approaches = read.touches, not read.normals_taken
    refuse_other_orientation(touches, pretravel_map)
    tips = TipCentres.of(touches, stated_approaches=stated_approaches)
    if start is None:
        start = only_placement(tips, part, pretravel_map, extrapolate=extrapolate)
    return align_from(tips, part, pretravel_map, start, datums=datums, extrapolate=extrapolate)


def only_placement(
    tips: TipCentres, part: Part, pretravel_map: PretravelMap, *, extrapolate: bool = False
) -> Placement:
    """The one placement that explains touches.

    Raises
    ------
    PretravelError
        None explains them, or several do.
    """
    found = found_placements(tips, part, pretravel_map, extrapolate=extrapolate)
    if not found:
        raise PretravelError(
            f"no placement of {part.name} explains the touches. Is it the right part, in "
            "mm, and are these tip centres? Give an approximate placement",
            inputs=("start",),
        )
    if len(found) == 1:
        return found[0].placement
    listed = "\n".join(
        f"  {each.placement.typed()}   (residuals {1e3 * each.scatter:.1f} µm)"
        for each in found[:_MOST_LISTED]
    )
    more = "\n  …" if len(found) > _MOST_LISTED else ""
    raise PretravelError(
        f"{len(found)} placements explain the touches: the part is symmetric, or the touches "
        f"are too few to distinguish them. Give the right one as the start:\n{listed}{more}",
        inputs=("start",),
    )
