"""Smooth shapes that the form of a surface may have, by the kind of feature."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pretravel.base import FloatArray, IntArray
from pretravel.drawing.features.form_of_part import LOBES, MANY_SHAPES, Family, Shapes
from pretravel.measurement import Association
from pretravel.uncertainty import across

_ORDERS = (2, 3, 4)  # of polynomials on a plane, beyond its tilt
_LENGTHS = {"longer than the face": 2.0, "of half the face": 1.0, "of a quarter of the face": 0.5}
"""Over which the form of a face is correlated, in halves of the face."""
_ACROSS = 9  # places in each direction of a face, from which its shapes are made
_LEAST_SHAPE = 1e-3  # variance of a shape that is kept, in relation to the largest


def families_of(kind: str, found: Association) -> tuple[Family, ...]:
    """The families of a feature's form; none of spheres and tori.

    Returns
    -------
    tuple of Family
        Lobes of round features, bows and twists of planes, lines and both sides of slots. They are
        at right angles to what the whole surface would add to size, place and direction.

    >>> from pretravel.measurement.association import associate
    >>> angle = np.arange(8) * np.pi / 4
    >>> ring = associate("circle", np.c_[np.cos(angle), np.sin(angle), 0.0 * angle])
    >>> [each.name for each in families_of("circle", ring)][:2]
    ['2 lobes', '3 lobes']
    """
    if kind in ("circle", "bore", "boss", "cylinder", "cone"):
        return _round(kind, found)
    if kind in ("plane", "line"):
        return _flat(kind, found)
    return _both_sides(found) if kind == "slot" else ()


def _round(kind: str, found: Association) -> tuple[Family, ...]:
    assert found.direction is not None
    sides = found.outward @ across(found.direction).T
    turn = np.arctan2(sides[:, 1], sides[:, 0])
    height = _to_unit(found.points @ found.direction)[:, None]
    long = kind in ("cylinder", "cone")
    lobes = []
    for count in LOBES:
        waves = np.column_stack([np.cos(count * turn), np.sin(count * turn)])
        if long:
            waves = np.hstack([waves, np.sqrt(3.0) * height * waves]) / np.sqrt(2.0)
        lobes.append(Family(f"{count} lobes", waves, 1.0 / count))
    if not long:
        return tuple(lobes)
    bow = np.sqrt(5.0) * 0.5 * (3.0 * height**2 - 1.0)
    waves = np.column_stack([np.ones(len(turn)), np.cos(turn), np.sin(turn)])
    lobes.append(Family("bow along the axis", bow * waves / np.sqrt(2.0), 0.5))
    if kind == "cylinder":  # of a cone it is another angle
        lobes.append(Family("taper", np.sqrt(3.0) * height, 0.5))
    return tuple(lobes)


def _flat(kind: str, found: Association) -> tuple[Family, ...]:
    assert found.direction is not None
    if kind == "line":
        along = [_to_unit(found.points @ found.direction)]
    else:
        along = _along_face(found.points, found.direction)
    return _of_orders(along)


def _of_orders(along: Sequence[FloatArray]) -> tuple[Family, ...]:
    names = {2: "bow and twist", 3: "wave of third order", 4: "wave of fourth order"}
    return tuple(
        Family(
            names[order],
            _polynomials(along, order, order),
            1.0 / order,
            in_parts="bow or twist" if order == 2 and len(along) == 2 else "",
        )
        for order in _ORDERS
    )


def _along_face(points: FloatArray, normal: FloatArray) -> list[FloatArray]:
    """Places along the longer and the shorter side of a plane, from -1 to 1."""
    middle = (points - points.mean(axis=0)) @ across(normal).T
    axes = np.linalg.svd(middle, full_matrices=False)[2]
    return list(map(_to_unit, (middle @ axes.T).T))


def _both_sides(found: Association) -> tuple[Family, ...]:
    """Sides that are not parallel, and the shapes of each side, independent of the other."""
    assert found.direction is not None
    upper = (found.outward @ found.direction > 0.0)[:, None]
    along = _along_face(found.points, found.direction)
    return (
        Family("sides that are not parallel", np.sqrt(1.5) * np.column_stack(along)),
        *(
            replace(each, columns=np.hstack([upper * each.columns, ~upper * each.columns]))
            for each in _of_orders(along)
        ),
    )


def families_of_faces(
    face: IntArray, curved: Sequence[int], parameters: FloatArray
) -> tuple[Family, ...]:
    """The families of a part's faces: displaced or of another size, and smooth over each.

    Parameters
    ----------
    face : (n,) int
        Of each touch.
    curved : sequence of int
        Faces that have a size: bores, bosses, balls.
    parameters : (n, 2) float
        Of the touches on their faces, from -1 to 1.

    Returns
    -------
    tuple of Family
        An error is common to the touches of a face, and independent between faces.
    """
    names = np.unique(face)
    rows = [np.flatnonzero(face == name) for name in names]
    whole = [np.ones((len(mine), 1)) for mine in rows]
    found = [Family("faces displaced", _of_faces(whole, rows, len(face)), face=face)]
    sized = [index for index, name in enumerate(names) if name in set(curved)]
    if sized:
        own = _of_faces([whole[k] for k in sized], [rows[k] for k in sized], len(face))
        found.append(Family("bores and bosses of another size", own, face=face))
    for words, length in _LENGTHS.items():
        shapes = [_correlated(parameters[mine], length) for mine in rows]
        columns = _of_faces(shapes, rows, len(face))
        found.append(Family(f"form with a correlation length {words}", columns, face=face))
    return tuple(found)


def _of_faces(shapes: Sequence[FloatArray], rows: Sequence[IntArray], count: int) -> Shapes:
    """Shapes of single faces as columns for all touches, without the zeros where there are many."""
    starts = np.cumsum([0, *(each.shape[1] for each in shapes)])
    total = int(starts[-1])
    if total > MANY_SHAPES:
        from scipy.sparse import coo_array

        row = [np.repeat(mine, own.shape[1]) for mine, own in zip(rows, shapes, strict=True)]
        column = [
            np.tile(np.arange(own.shape[1]) + start, len(own))
            for start, own in zip(starts[:-1], shapes, strict=True)
        ]
        places = (np.concatenate(row), np.concatenate(column))
        values = np.concatenate([own.ravel() for own in shapes])
        return coo_array((values, places), shape=(count, total)).tocsr()
    columns = np.zeros((count, total))
    for start, mine, own in zip(starts[:-1], rows, shapes, strict=True):
        columns[mine, start : start + own.shape[1]] = own
    return columns


def _correlated(places: FloatArray, length: float) -> FloatArray:
    """Shapes of a form whose correlation falls as exp(-(distance / length)² / 2), (n, f).

    Those of a lattice over the face (Nyström's method), so that a face of many touches takes no
    longer than its touches.
    """
    lattice = np.linspace(-1.0, 1.0, _ACROSS)

    def alike(at: FloatArray, to: FloatArray) -> FloatArray:
        return np.asarray(np.exp(-0.5 * ((at[:, None] - to) / length) ** 2))

    # The correlation is a product of one in each direction.
    sizes, vectors = np.linalg.eigh(alike(lattice, lattice))
    kept = sizes > _LEAST_SHAPE * sizes[-1]
    along = [alike(one, lattice) @ vectors[:, kept] / np.sqrt(sizes[kept]) for one in places.T]
    shapes = (along[0][:, :, None] * along[1][:, None, :]).reshape(len(places), -1)
    u, size, _ = np.linalg.svd(shapes, full_matrices=False)
    seen = size**2 > _LEAST_SHAPE * size[0] ** 2
    return np.asarray(u[:, seen] * size[seen], dtype=np.float64)


def _to_unit(values: FloatArray) -> FloatArray:
    """From -1 to 1 over the touches."""
    low, high = float(values.min()), float(values.max())
    return np.asarray((2.0 * values - low - high) / max(high - low, 1e-12))


def _polynomials(along: Sequence[FloatArray], least: int, most: int) -> FloatArray:
    """Products of Legendre polynomials of these orders together; mean square sum 1, (n, f)."""
    single = [
        np.polynomial.legendre.legvander(each, most) * np.sqrt(2.0 * np.arange(most + 1) + 1.0)
        for each in along
    ]
    if len(single) == 1:
        columns = [single[0][:, order] for order in range(least, most + 1)]
    else:
        columns = [
            single[0][:, i] * single[1][:, j]
            for i in range(most + 1)
            for j in range(most + 1 - i)
            if i + j >= least
        ]
    return np.asarray(np.column_stack(columns) / np.sqrt(len(columns)), dtype=np.float64)
