"""Normals of tables: their rounding, their sign, and those of a fitted sphere where none are."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    DEGREE,
    INCH,
    LARGEST_PRETRAVEL,
    MICROMETRE,
    UNIT_TOLERANCE,
    FloatArray,
    InputError,
    PretravelError,
    RowError,
)
from pretravel.files.column_names import NORMAL_ROLES
from pretravel.files.file_format import (
    FilePositions,
    FileReadings,
    NormalsFrom,
    labels_or_numbers,
)
from pretravel.files.source_file import SourceFile
from pretravel.files.touch_columns import TouchColumns

_COARSEST = 0.02
"""Largest deviation of a normal's length from one that rounding explains: two decimals."""
_MOST = 0.8
"""Share of the touches that must agree before all are taken to be of another kind."""
_FEWEST_TO_JUDGE = 5
"""Touches from which directions of travel are recognised."""
_ALONG = 0.9
"""Cosine from which the tip's centre lies along a vector from the nominal point."""
_FLAT = 0.05
"""Height of touches in a ring, as a share of their extent: they are at one height or few."""
_ACROSS = 0.3
"""Sine of 17°: a probing move at less to the surface would slide along it."""
_SMALLEST_TIP = 0.1
"""Radius of a tip, of which the smallest have 0.15. [mm]"""
_FEWEST = 9
"""Touches from which a sphere can be fitted with some left to judge it."""
_BADLY_SEEN = 20.0
"""A centre whose uncertainty is this many times that of a touch, √n times, is not determined."""
_LARGEST_TURN = 0.5 * DEGREE
"""Uncertainty of a normal that changes a map by less than 0.2 µm, where it rises 20 µm a radian."""


def stated_normals(file: SourceFile, columns: TouchColumns) -> tuple[FloatArray, tuple[str, ...]]:
    """Return the normals of a table, scaled to unit length where rounding explains the rest.

    Returns
    -------
    (n, 3) float
    tuple of str
        A warning where the normals have two decimals or less.

    Raises
    ------
    InputError
        Most of the vectors are not unit vectors. Single ones are refused by `Touches`.
    """
    table = columns.table
    names = tuple(NORMAL_ROLES)
    normals = table.numbers(*names)
    length = np.linalg.norm(normals, axis=1)
    titles = columns.title(*names)
    wrong = np.abs(length - 1.0) > _COARSEST
    if wrong.mean() > 1.0 - _MOST and len(wrong) > 2:
        row = int(np.flatnonzero(wrong)[0])
        raise file.error(
            f"the columns {titles} are not unit vectors (this one has length {length[row]:.4g}): "
            "are they angles, axes or deviations? Give the columns of the normals, or leave them "
            "out (nx=none,ny=none,nz=none)",
            table.lines[row],
            inputs=("columns",),
        )
    decimals = table.decimals(*names)
    rounding = math.sqrt(3.0) * 0.5 * 10.0**-decimals
    off = np.abs(length - 1.0)
    rounded = (off > UNIT_TOLERANCE) & (off <= min(1.05 * rounding, _COARSEST))
    if not rounded.any():
        return normals, ()
    normals[rounded] /= length[rounded, None]
    warning = (
        f"the normals ({titles}) have {decimals} decimals: their directions are rounded by up to "
        f"{rounding / DEGREE:.1f}°"
    )
    return normals, (warning,)


def refuse_inward(
    file: SourceFile,
    columns: TouchColumns,
    positions: FloatArray,
    normals: FloatArray,
    nominal: FloatArray | None,
    *,
    on_sphere: bool,
) -> None:
    """Refuse normals that all point into the part: they are directions of travel.

    They are recognised on a sphere, and where the table has the nominal points.

    Parameters
    ----------
    file : SourceFile
    columns : TouchColumns
    positions, normals : (n, 3) float
        [mm]
    nominal : (n, 3) float or None
        [mm]
    on_sphere : bool
        The touches lie on a sphere. The normals in a ring point to its axis.
    """
    if len(positions) < _FEWEST_TO_JUDGE:
        return
    if nominal is not None:
        offset = positions - nominal
        distance = np.linalg.norm(offset, axis=1)
        inward = np.sum(offset * normals, axis=1) < -_ALONG * np.maximum(distance, MICROMETRE)
    elif on_sphere:
        from_middle = positions - np.median(positions, axis=0)
        inward = np.sum(from_middle * (normals - normals.mean(axis=0)), axis=1) < 0.0
    else:
        return
    if np.mean(inward) < _MOST:
        return
    if nominal is not None and (near := float(np.median(distance))) < _SMALLEST_TIP:
        raise file.error(
            f"the positions are {near:.3f} mm (median) from their nominal points, nearer than a "
            "tip centre can be: the tip's radius was subtracted from them already. Give the "
            "positions of the tip centre at the trigger, as the machine reports them",
            columns.table.header_line or None,
        )
    titles = columns.title(*NORMAL_ROLES)
    turned = ",".join(
        f"{role}=-{columns.titles[role].removeprefix('column ')}" for role in NORMAL_ROLES
    )
    extents = np.linalg.svd(positions - positions.mean(axis=0), compute_uv=False)
    ring = ""
    if nominal is None and extents[2] < _FLAT * extents[0]:
        ring = ". Or is the reference a ring gauge? There normals point to the axis"
    raise file.error(
        f"the vectors {titles} point into the part: they are directions of travel, not outward "
        f"normals. Turn them: {turned}{ring}",
        columns.table.header_line or None,
        inputs=("columns",),
    )


def with_sphere_normals(found: FilePositions, reference_diameter: float) -> FileReadings:
    """Give positions on a sphere the normals of the sphere that is fitted to them.

    Parameters
    ----------
    found : FilePositions
    reference_diameter : float
        It tells positions that are far off from those of the sphere. [mm]

    Returns
    -------
    FileReadings
        With a warning that states the uncertainty of the normals.

    Raises
    ------
    PretravelError
        The positions do not determine the sphere.

    >>> from pretravel.base.directions import sphere_pattern_25
    >>> points = FilePositions("a.xyz", 15.5 * sphere_pattern_25(), tuple(range(1, 26)))
    >>> float(with_sphere_normals(points, 25.0).touches.normals[0, 2].round(6))
    1.0
    """
    made = contacts(found)
    tips = np.array(made.words.get("tip", ("",) * len(made.positions)))
    outward, turns = np.empty_like(made.positions), []
    for tip in dict.fromkeys(tips):  # each tip of a star sees the sphere elsewhere
        outward[tips == tip], turn = _outward(made.take(tips == tip), reference_diameter)
        turns.append(turn)
    warning = (
        "the file has no normals: the normals of the sphere fitted to the touches are used, also "
        f"as approaches (they are uncertain by {max(turns) / DEGREE:.2g}°)"
    )
    touches = made.touches(outward)
    return FileReadings(touches, found.misses(), warnings=(*found.warnings, warning))


def _outward(made: FilePositions, reference_diameter: float) -> tuple[FloatArray, float]:
    """Normals of the sphere through the touches of one tip, and their uncertainty. [rad]"""
    center, scatter, sight = _fitted_center(made, reference_diameter)
    offset = made.positions - center
    radius = np.linalg.norm(offset, axis=1)
    u_center = sight * scatter
    turn = u_center / float(np.median(radius))
    if sight > _BADLY_SEEN or turn > _LARGEST_TURN:
        raise PretravelError(
            f"{made.path}: the file has no normals, and its touches do not determine the centre "
            f"of the sphere well enough to compute them (±{u_center / MICROMETRE:.0f} µm): touch "
            "more of the sphere, or give the plan that was run",
            inputs=("plan", "columns"),
        )
    return offset / radius[:, None], turn


def one_normal(normal: npt.ArrayLike) -> NormalsFrom:
    """The same normal at all touches, as `ReadingOptions.normals_from`.

    >>> one_normal([0, 0, 1])(np.zeros((2, 3)), None).tolist()
    [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0]]
    """
    given = np.asarray(normal, dtype=np.float64)

    def everywhere(positions: FloatArray, labels: tuple[str, ...] | None) -> FloatArray:
        del labels
        return np.tile(given, (len(positions), 1))

    return everywhere


def with_surface_normals(found: FilePositions, normals_from: NormalsFrom) -> FileReadings:
    """Give positions the normals of a surface near them.

    Parameters
    ----------
    found : FilePositions
        Positions that are not contacts are left out, and named as missed.
    normals_from : callable
        As of `ReadingOptions`.

    >>> points = FilePositions("a.xyz", np.array([[0.0, 0.0, 3.0]]), (1,))
    >>> with_surface_normals(points, lambda at, labels: at / 3.0).touches.normals.tolist()
    [[0.0, 0.0, 1.0]]
    """
    made = contacts(found)
    try:
        normals = normals_from(made.positions, made.labels)
        _refuse_moves_across(made, normals)
        touches = made.touches(normals)
    except RowError as error:
        raise made.error(error.in_file, error.row) from None
    return FileReadings(touches, found.misses(), warnings=found.warnings, normals_taken=True)


def _refuse_moves_across(found: FilePositions, normals: FloatArray) -> None:
    """Refuse normals across which the file's own moves went: they touched another surface."""
    for row, axes in enumerate(found.axes or ()):
        along = normals[row][["XYZ".index(letter) for letter in axes]]
        if axes and float(np.linalg.norm(along)) < _ACROSS:
            x, y, z = normals[row]
            raise found.error(
                f"the move to this touch went along {', '.join(axes)}, and its normal is ({x:.3g}, "
                f"{y:.3g}, {z:.3g}): give the normal of the surface that was touched",
                row,
            )


def contacts(found: FilePositions) -> FilePositions:
    """The positions that are contacts.

    Raises
    ------
    InputError
        None is one.

    >>> both = FilePositions("a.log", np.eye(3)[:2], (1, 2), contact=(True, False))
    >>> contacts(both).lines
    (1,)
    """
    if found.contact is None or all(found.contact):
        return found
    if not any(found.contact):
        raise InputError("none of the readings is a contact", path=found.path)
    labels = labels_or_numbers(found.labels, len(found.positions))
    return replace(found, labels=labels).take(np.array(found.contact))


def with_ring_normals(found: FilePositions, *, pin: bool = False) -> FileReadings:
    """Give positions on an upright ring or pin the normals of the circle that is fitted to them.

    Parameters
    ----------
    found : FilePositions
    pin : bool
        Touched from outside; else from inside.

    Returns
    -------
    FileReadings
        With a warning that states it.

    Raises
    ------
    PretravelError
        The positions do not determine the circle.

    >>> walls = FilePositions("a.log", np.array([[9.0, 0, 0], [0, 9, 0], [-9, 0, 0]]), (1, 2, 3))
    >>> (with_ring_normals(walls).touches.normals[0] + 0.0).round(6).tolist()
    [-1.0, 0.0, 0.0]
    """
    made = contacts(found)
    points = made.positions[:, :2]
    from pretravel.uncertainty import algebraic_sphere

    about = points - points.mean(axis=0)
    if np.linalg.matrix_rank(about, tol=1e-3 * float(np.linalg.norm(about))) < 2:
        raise PretravelError(
            f"{found.path}: the file has no normals, and its touches do not determine the circle "
            "of the ring: touch three sides or more, or give the plan that was run",
            inputs=("plan", "columns"),
        )
    *center, radius = algebraic_sphere(about)[0].tolist()
    offset = about - center
    away = np.linalg.norm(offset, axis=1)
    far = np.flatnonzero(np.abs(away - radius) > LARGEST_PRETRAVEL)
    if len(far):
        row = int(np.argmax(np.abs(away - radius)))
        raise made.error(
            f"this touch is {abs(away[row] - radius):.3f} mm off the circle that is fitted to the "
            "touches, from which the normals are computed: leave it out, or give the plan that "
            "was run",
            row,
            inputs=("exclude", "plan"),
        )
    outward = np.column_stack([offset / away[:, None], np.zeros(len(offset))])
    shape = "pin" if pin else "ring"
    warning = (
        f"the file has no normals: they are those of the {shape} that is fitted to the touches"
    )
    touches = made.touches(outward if pin else -outward)
    return FileReadings(touches, found.misses(), warnings=(*found.warnings, warning))


_IN_MICROMETRES = 100.0
"""Diameters of the reference, from which positions in µm are apart."""


_IN_INCHES = 12.0, 60.0
"""Diameters of the reference, over which positions in mm extend where it is stated in inches."""


def _in_inches(extent: float, diameter: float) -> str:
    """A question where the diameter is about an inch's share of what the touches span.

    >>> _in_inches(28.0, 0.9842)
    '. Is the diameter of 0.9842 in inches (24.9987 mm)? It is given in mm'
    >>> _in_inches(28.0, 24.9987)
    ''
    """
    if not _IN_INCHES[0] < extent / diameter < _IN_INCHES[1]:
        return ""
    in_mm = f"{INCH * diameter:.4f} mm"
    return f". Is the diameter of {diameter:g} in inches ({in_mm})? It is given in mm"


def _fitted_center(
    found: FilePositions, reference_diameter: float
) -> tuple[FloatArray, float, float]:
    """Centre of the sphere, scatter about it, and how much worse the centre is seen. [mm]"""
    from pretravel.uncertainty import fit_sphere

    positions = found.positions
    far = (
        np.max(np.abs(positions - np.median(positions, axis=0)), axis=1) > 2.0 * reference_diameter
    )
    used = ~far
    fit = None
    for _ in range(3):
        if used.sum() < _FEWEST:
            extent = float(np.ptp(positions, axis=0).max())
            if extent > _IN_MICROMETRES * reference_diameter:
                raise PretravelError(
                    f"{found.path}: the positions are up to {extent:.4g} mm apart, on a reference "
                    f"of {reference_diameter:g} mm: if they are in µm, name the unit in the titles "
                    "of their columns (X [µm])",
                    inputs=("columns",),
                )
            if not used.any():
                raise PretravelError(
                    f"{found.path}: the file has no normals, and the touches extend over "
                    f"{extent:.1f} mm, further than on one sphere of {reference_diameter:g} mm: "
                    "give one file for each place of the sphere, or the plan that was run"
                    + _in_inches(extent, reference_diameter),
                    inputs=("plan", "columns"),
                )
            raise PretravelError(
                f"{found.path}: the file has no normals, and {int(used.sum())} touches on the "
                f"sphere are too few to compute them; at least {_FEWEST} are needed, or the plan "
                "that was run" + _in_inches(extent, reference_diameter),
                inputs=("plan", "columns"),
            )
        try:
            fit = fit_sphere(positions[used])
        except PretravelError as error:
            raise PretravelError(f"{found.path}: {error}", inputs=error.inputs) from None
        off = np.linalg.norm(positions - fit.center, axis=1)
        kept = used & (np.abs(off - np.median(off[used])) <= LARGEST_PRETRAVEL)
        if kept.sum() == used.sum() or kept.mean() < _MOST:
            break
        used = kept
    assert fit is not None
    scatter = float(np.sqrt(np.mean((off[used] - fit.radius) ** 2)))
    worst = float(np.linalg.eigvalsh(fit.cofactor[:3, :3])[-1])
    return np.asarray(fit.center), scatter, math.sqrt(used.sum() * worst)
