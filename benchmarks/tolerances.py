"""Tolerances to datums and extreme features: does U cover the error, as it states?

python benchmarks/tolerances.py --sets 200

Probes, machine and noise are those of `benchmarks/features.py`. The part: three planes of 9 touches
as datums, three bores of 8 mm with two rings of 6 touches, one ring of 12 at another height about
the axis of the first; all displaced by known amounts; with a form from touch to touch of 0 or 1 µm.
Positions, orientations and coaxialities are those of perfect features, so that the form is an error
of theirs; a run-out and a profile are those of the touched places.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

if __package__ in (None, ""):  # run as a file
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.departures.probes import MICROMETRE
from benchmarks.features import PART_AT, Workshop, around, workshop
from pretravel.drawing.features.extreme_association import associate_by
from pretravel.drawing.features.measured_feature import measure_feature
from pretravel.drawing.tolerances.geometric_tolerances import inspect_geometry
from pretravel.drawing.tolerances.tolerance_frame import (
    GeometricResult,
    GeometricTolerance,
    PlacedFeature,
)
from pretravel.measurement.compensation import apply
from pretravel.touches import Touches

X, Y, Z = np.eye(3)
GRID = np.array([[a, b] for a in (2.0, 30.0, 58.0) for b in (2.0, 20.0, 38.0)])
RADIUS = 4.0
FORMS = {"perfect": 0.0, "form 1 µm": 1.0 * MICROMETRE}
BORES = {"D": (10.0, 10.0), "E": (50.03, 10.02), "F": (30.0, 29.97)}
PLACES = {"D": (10.0, 10.0), "E": (50.0, 10.0), "F": (30.0, 30.0)}
TILT = 0.02
"""Of bore F over its length, in y. [mm]"""
OFF = 0.02
"""Of the ring G from the axis of D, in x. [mm]"""


def _part() -> dict[str, tuple[str, np.ndarray, np.ndarray, float]]:
    """Kind, points, normals and curvature of each feature."""
    flat = np.zeros(len(GRID))
    found = {
        "A": ("plane", np.c_[GRID, flat], np.tile(Z, (9, 1)), 0.0),
        "B": ("plane", np.c_[GRID[:, 0], flat, -1.0 - GRID[:, 1] / 4.0], np.tile(-Y, (9, 1)), 0.0),
        "C": ("plane", np.c_[flat, GRID[:, 0], -1.0 - GRID[:, 1] / 4.0], np.tile(-X, (9, 1)), 0.0),
    }
    outward = np.vstack([around(6)[1], around(6)[1]])
    height = np.repeat([-9.0, -1.0], 6)[:, None]
    for name, place in BORES.items():
        lean = (height + 5.0) / 8.0 * TILT * Y if name == "F" else 0.0 * height * Y
        points = np.array([*place, 0.0]) + RADIUS * outward + height * Z + lean
        found[name] = ("cylinder", points, -outward, -1.0 / RADIUS)
    ring = around(12)[1]
    points = np.array([BORES["D"][0] + OFF, BORES["D"][1], -20.0]) + 6.0 * ring
    found["G"] = ("bore", points, -ring, -1.0 / 6.0)
    return found


def placed_features(
    shop: Workshop, form: float
) -> tuple[dict[str, PlacedFeature], dict[str, np.ndarray]]:
    """The measured features with their nominal places, and their true surface points."""
    positions, normals, rows, true = [], [], {}, {}
    start = 0
    for name, (_, points, facing, curvature) in _part().items():
        at = points + form * shop.generator.standard_normal(len(points))[:, None] * facing
        positions.append(shop.touched(PART_AT + at, facing, curvature).positions)
        normals.append(facing)
        rows[name], start, true[name] = np.arange(start, start + len(at)), start + len(at), at
    touches = Touches(np.vstack(positions), np.vstack(normals))
    points = apply(touches, shop.pretravel_map, extrapolate=True)
    found = {}
    for name, (kind, *_) in _part().items():
        axis = None if kind == "plane" else Z
        feature = measure_feature(points[rows[name]], kind, axis=axis, label=name)
        nominal = {"A": (0 * Z, Z), "B": (0 * Z, -Y), "C": (0 * Z, -X)}.get(name)
        if nominal is None:
            nominal = (np.array([*PLACES.get(name, PLACES["D"]), 0.0]), Z)
        found[name] = PlacedFeature(
            feature, PART_AT + nominal[0], nominal[1], 2.0 * RADIUS, (7.9, 8.1)
        )
    return found, true


def _asked() -> list[tuple[str, str, GeometricTolerance, float | None]]:
    """Row, features, tolerance, truth; None where it is that of the touched places."""
    apart = 2.0 * float(np.hypot(0.03, 0.02))
    to_planes = ("A", "B", "C")

    def asks(kind: str, *datums: str) -> GeometricTolerance:
        return GeometricTolerance(kind, 0.2, datums)

    return [
        ("position of a bore to A, B, C", "E", asks("position", *to_planes), apart),
        ("position to A, D, B", "E", asks("position", "A", "D", "B"), apart),
        ("pattern of three bores to A, B, C", "D E F", asks("position", *to_planes), None),
        ("coaxiality of a ring", "G", asks("coaxiality", "D"), 2.0 * OFF),
        ("perpendicularity of an axis to A", "F", asks("perpendicularity", "A"), TILT),
        ("run-out of a ring", "G", asks("run-out", "D"), None),
        ("profile of C to A, B", "C", asks("profile", "A", "B"), None),
        ("perpendicularity of B to A", "B", asks("perpendicularity", "A"), None),
    ]  # fmt: skip


def _truth(names: str, tolerance: GeometricTolerance, true: dict[str, np.ndarray]) -> float:
    """The same tolerance of the true points, without errors: datums and bores are perfect."""
    placed = {}
    for name, (kind, points, normals, _) in _part().items():
        one = points if tolerance.kind == "position" or name not in names.split() else true[name]
        exact = _exact(kind, one, normals, name)
        placed[name] = exact
    return inspect_geometry(
        [placed[name] for name in names.split()], tolerance, placed, 0.95
    ).quantity.value


def _exact(kind: str, points: np.ndarray, normals: np.ndarray, name: str) -> PlacedFeature:
    from tests.support.feature_points import feature_points

    own = feature_points(PART_AT + points, normals, own=1e-9, shared={})
    feature = measure_feature(own, kind, axis=None if kind == "plane" else Z, label=name)
    nominal = {"A": (0 * Z, Z), "B": (0 * Z, -Y), "C": (0 * Z, -X)}.get(name)
    if nominal is None:
        nominal = (np.array([*PLACES.get(name, PLACES["D"]), 0.0]), Z)
    return PlacedFeature(feature, PART_AT + nominal[0], nominal[1], 2.0 * RADIUS, (7.9, 8.1))


def _row(found: GeometricResult, truth: float) -> dict[str, float]:
    low, high = found.quantity.interval
    return {
        "error": found.quantity.value - truth,
        "u": found.quantity.u,
        "U": found.quantity.expanded_u,
        "covered": float(low - 1e-9 <= truth <= high + 1e-9),
    }


LEAN = 5e-4
"""Of plane B against a right angle to A. [rad]"""


def _touched(
    shop: Workshop, features: dict[str, tuple[str, np.ndarray, np.ndarray, float]],
    off: dict[str, np.ndarray], nominal: dict[str, tuple[np.ndarray, np.ndarray]],
) -> dict[str, PlacedFeature]:  # fmt: skip
    """Features whose points depart from these by known distances along their normals."""
    reported, facings, found = [], [], {}
    for name, (_, points, facing, curvature) in features.items():
        at = points + off.get(name, np.zeros(len(points)))[:, None] * facing
        reported.append(shop.touched(PART_AT + at, facing, curvature).positions)
        facings.append(facing)
    touches = Touches(np.vstack(reported), np.vstack(facings))
    compensated = apply(touches, shop.pretravel_map, extrapolate=True)
    ends = np.cumsum([len(each) for each in reported])
    for (name, (kind, points, *_)), end in zip(features.items(), ends, strict=True):
        mine = compensated[np.arange(end - len(points), end)]
        feature = measure_feature(mine, kind, axis=None if kind == "plane" else Z, label=name)
        point, direction = nominal[name]
        found[name] = PlacedFeature(feature, PART_AT + point, direction, 2.0 * RADIUS, (7.9, 8.1))
    return found


def _few(count: int) -> dict[str, tuple[str, np.ndarray, np.ndarray, float]]:
    """The part of `_part` with few touches: planes of 3 or 4, cylinders of two rings."""
    found = {}
    for name, (kind, points, facing, curvature) in _part().items():
        rows = np.arange(len(points))
        if kind == "plane":
            rows = np.array([0, 2, 7]) if count == 3 else np.array([0, 2, 6, 8])
        elif kind == "cylinder" and count > 3:
            turn = np.append(around(count // 2)[1], around(count - count // 2)[1], axis=0)
            height = np.repeat([-9.0, -1.0], [count // 2, count - count // 2])[:, None]
            lean = (height + 5.0) / 8.0 * TILT * Y if name == "F" else 0.0 * height * Y
            points = np.array([*BORES[name], 0.0]) + RADIUS * turn + height * Z + lean
            facing, rows = -turn, np.arange(count)
        elif kind == "bore":
            ring = around(max(count, 4))[1]
            points, facing = np.array([*BORES["D"], -20.0]) + 6.0 * ring, -ring
            rows = np.arange(len(ring))
        found[name] = (kind, points[rows], facing[rows], curvature)
    return found


def _nominal(name: str) -> tuple[np.ndarray, np.ndarray]:
    planes = {"A": (0 * Z, Z), "B": (0 * Z, -Y), "C": (0 * Z, -X)}
    return planes.get(name, (np.array([*PLACES.get(name, PLACES["D"]), 0.0]), Z))


def few_touches(shop: Workshop) -> dict[str, dict[str, float]]:
    """Forms that few touches show poorly, and distances of true zero."""
    found, rng = {}, shop.generator
    nominal = {name: _nominal(name) for name in _part()}

    def asked(
        placed: dict[str, PlacedFeature], name: str, kind: str, *datums: str
    ) -> GeometricResult:
        return inspect_geometry([placed[name]], GeometricTolerance(kind, 0.2, datums), placed, 0.95)

    # A bow of 3 µm over each plane, from its mean; the truth is the plane in its middle.
    part, off = _few(3), {}
    for name in "ABC":
        across = [i for i in range(3) if abs(nominal[name][1][i]) < 0.5]
        whole = _part()[name][1][:, across]
        half = 0.5 * np.ptp(whole, axis=0)
        flat = (part[name][1][:, across] - whole.min(axis=0) - half) / half
        off[name] = 3.0 * MICROMETRE * (0.5 * np.sum(flat**2, axis=1) - 1.0 / 3.0)
    apart = 2.0 * float(np.hypot(0.03, 0.02))
    placed = _touched(shop, part, off, nominal)
    found["position to A, B, C: planes of 3 touches, bowed 3 µm"] = _row(
        asked(placed, "E", "position", "A", "B", "C"), apart)  # fmt: skip
    for count, form in ((4, 1.0), (6, 1.0), (9, 1.0), (8, 0.0)):
        part = _few(count if count > 4 else 8)
        if count == 4:
            part["G"] = _few(4)["G"]
        off = {name: form * MICROMETRE * rng.standard_normal(len(each[1]))
               for name, each in part.items()}  # fmt: skip
        placed = _touched(shop, part, off, nominal)
        shape = "perfect" if form == 0.0 else "rough by 1 µm"
        found[f"coaxiality of true zero, {count} touches, {shape}"] = _row(
            asked(placed, "G", "coaxiality", "D"), 0.0)  # fmt: skip
        found[f"perpendicularity of an axis, {count} touches, {shape}"] = _row(
            asked(placed, "F", "perpendicularity", "A"), TILT)  # fmt: skip
    # B leans against A: its place is that of the whole face at right angles to A.
    part = _part()
    lean = LEAN * part["B"][1][:, 2]
    placed = _touched(shop, part, {"B": lean}, nominal)
    truth = 2.0 * float(np.hypot(0.03, 0.02 + lean.mean()))
    for words, point in (("a corner", 0 * Z), ("the middle", np.array([30.0, 0.0, -6.0]))):
        placed["B"] = PlacedFeature(placed["B"].feature, PART_AT + point, -Y)
        found[f"position to A, B, C: B leans 0.5 mrad, its nominal is {words}"] = _row(
            asked(placed, "E", "position", "A", "B", "C"), truth)  # fmt: skip
    return found


def one_set(number: int, kind: str, *, whole: bool = True) -> dict[str, dict[str, float]]:
    """All rows with one probe and its map; `whole` also those of usual numbers of touches."""
    shop, found = workshop(number, kind), {}
    found |= few_touches(shop)
    if not whole:
        return found
    for form_name, form in FORMS.items():
        placed, true = placed_features(shop, form)
        for name, names, tolerance, stated in _asked():
            members = [placed[each] for each in names.split()]
            result = inspect_geometry(members, tolerance, placed, 0.95)
            truth = _truth(names, tolerance, true) if stated is None else stated
            found[f"{name}, {form_name}"] = _row(result, truth)
        # Extreme features of the touched places.
        for criterion in ("inscribed", "circumscribed", "minimum-zone"):
            points = placed["G"].feature.points
            one = measure_feature(points, "bore", axis=Z, association=criterion)
            exact = associate_by(criterion, "bore", PART_AT + true["G"], axis=Z)
            size = one.quantity("diameter")
            assert exact.diameter is not None
            found[f"{criterion} diameter of a ring of 12, {form_name}"] = {
                "error": size.value - exact.diameter,
                "u": size.u,
                "U": size.expanded_u,
                "covered": float(abs(size.value - exact.diameter) <= size.expanded_u),
            }
    return found


def printed(sets: Sequence[dict[str, dict[str, float]]]) -> None:
    """The table, as Markdown."""
    print("| quantity | sets | mean error µm | u µm | χ² | covered by U % |")
    print("| --- |" + " --- |" * 5)
    for name in sets[0]:
        rows = [one[name] for one in sets]
        error, u = (np.array([row[key] for row in rows]) for key in ("error", "u"))
        covered = 100.0 * np.mean([row["covered"] for row in rows])
        chi = float(np.mean((error / np.maximum(u, 1e-12)) ** 2))
        print(
            f"| {name} | {len(rows)} | {error.mean() / MICROMETRE:+.2f} | "
            f"{u.mean() / MICROMETRE:.2f} | {chi:.2f} | {covered:.0f} |"
        )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--kind", default="physical")
    parser.add_argument("--few", action="store_true", help="only rows of few touches")
    stated = parser.parse_args()
    numbers = range(stated.first, stated.first + stated.sets)
    printed([one_set(number, stated.kind, whole=not stated.few) for number in numbers])


if __name__ == "__main__":
    main()
