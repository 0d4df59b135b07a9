"""A drawing decided on simulated parts: how often U contains the truth, and how often it is wrong.

python benchmarks/drawing.py --sets 200

The simulator is apart from the model: numpy and linear programs alone. A block has planes A, B and
C and a bore; each face has a smooth form of its own (two to four waves of random direction and
phase, a bow), each touch noise of its own, and all touches an error of the tip's radius and of a
map in common, drawn with the standard uncertainties that the points state. The truth of a size or
a place is that of the whole surface, sampled 2000 times; that of a form the minimum zone of the
touched points, by a linear program. Datums T, U and V are A, B and C by targets, on which they
rest: three points or areas, two points or a line, and a point; their truth is that of the places
without the errors of the touches.

Errors alone make a zone of about 1.2 µm. The interval of a smaller form begins at zero, and cannot
miss it on that side; forms of 1.6 µm and more have a row of their own.
"""

from __future__ import annotations

import argparse
import math
import re
import sys
from pathlib import Path

import numpy as np
from scipy.optimize import linprog

if __package__ in (None, ""):  # run as a file
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import pretravel
from pretravel.measurement import Points

SIZES = {"A": (60.0, 40.0), "B": (60.0, 20.0), "C": (40.0, 20.0)}
RADIUS, DEPTH, CENTRE = 8.0, 16.0, np.array([30.0, 20.0])
NOISE, U_RADIUS, U_MAP = 0.0004, 0.0003, 0.0003
"""Standard deviations: of a touch, of the tip's radius, of each of two terms of a map. [mm]"""
U_MACHINE = 0.01e-3
SEEN = 4.0 * NOISE
"""A form that errors do not hide. [mm]"""
DENSE = 2000
CORNERS, AREA = ((8.0, 8.0), (52.0, 8.0), (30.0, 32.0)), 6.0
"""Targets of T, and the diameter of areas. [mm]"""
POINTS = "targets_mm = [[5.0, 0.0, -10.0, 0.0], [55.0, 0.0, -10.0, 0.0]]"
LINE = "target_lines_mm = [[5.0, 0.0, -10.0, 55.0, 0.0, -10.0]]"
"""Targets of U."""
DRAWING = """\
feature = [
  { label = "A", kind = "plane", faces = [1], at_mm = [30.0, 20.0, 0.0], axis = [0.0, 0.0, 1.0],
    form_tolerance_mm = FLAT },
  { label = "B", kind = "plane", faces = [2], at_mm = [30.0, 0.0, -10.0], axis = [0.0, -1.0, 0.0],
    geometric = [{ kind = "profile", tolerance_mm = FLAT, datums = ["A"] }] },
  { label = "C", kind = "plane", faces = [3], at_mm = [0.0, 20.0, -10.0], axis = [-1.0, 0.0, 0.0] },
  { label = "bore", kind = "cylinder", faces = [4], at_mm = [30.0, 20.0, -8.0],
    axis = [0.0, 0.0, 1.0], nominal_mm = 16.0, tolerance = "15.99..16.01",
    geometric = [{ kind = "position", tolerance_mm = 0.02, datums = ["A", "B", "C"] },
      { kind = "position", tolerance_mm = 0.02, datums = ["T", "U", "V"] }] },
  { label = "T", kind = "plane", faces = [6], at_mm = [30.0, 20.0, 0.0], axis = [0.0, 0.0, 1.0],
    association = "tangent", targets_mm = T_PLACES },
  { label = "U", kind = "surface", faces = [7], association = "tangent", U_PLACES },
  { label = "V", kind = "surface", faces = [8], association = "tangent",
    targets_mm = [[0.0, 20.0, -10.0, 0.0]] },
  { label = "ring", kind = "bore", faces = [5], axis = [0.0, 0.0, 1.0], form_tolerance_mm = FLAT },
]
"""


def wave(rng: np.random.Generator, size: float, amplitude: float):  # type: ignore[no-untyped-def]
    """A smooth form of a plane: waves and a bow. [mm]"""
    count = int(rng.integers(2, 5))
    along = rng.standard_normal((count, 2))
    along *= (2.0 * np.pi / (size * rng.uniform(0.6, 2.0, count)) / np.linalg.norm(along, axis=1))[
        :, None
    ]
    phase, height = rng.uniform(0.0, 2.0 * np.pi, count), rng.standard_normal(count)
    height *= amplitude / math.sqrt(count)
    bow = amplitude * rng.standard_normal() / size**2

    def form(at: np.ndarray) -> np.ndarray:
        middle = at - 0.5 * size
        found = np.cos(at @ along.T + phase) @ height + bow * np.sum(middle**2, axis=1)
        return np.asarray(found)

    return form


def lobes(rng: np.random.Generator, amplitude: float):  # type: ignore[no-untyped-def]
    """A smooth form of a bore over angle and height. [mm]"""
    orders = rng.integers(2, 6, 3)
    phase, height = rng.uniform(0.0, 2.0 * np.pi, 3), rng.standard_normal(3) * amplitude / 1.7
    along = rng.uniform(-0.15, 0.15, 3)

    def form(angle: np.ndarray, z: np.ndarray) -> np.ndarray:
        arg = orders * angle[:, None] + along * z[:, None] + phase
        return np.asarray(np.cos(arg) @ height)

    return form


def zone(rows: np.ndarray, offsets: np.ndarray) -> float:
    """The smallest range of offsets less a combination of the columns, by a linear program."""
    count, free = rows.shape
    unit = 1e3  # so that the program counts micrometres
    above = np.hstack([-rows, -np.ones((count, 1)), np.zeros((count, 1))])
    below = np.hstack([rows, np.zeros((count, 1)), np.ones((count, 1))])
    found = linprog(
        np.r_[np.zeros(free), 1.0, -1.0],
        A_ub=np.vstack([above, below]),
        b_ub=unit * np.r_[-offsets, offsets],
        bounds=[(None, None)] * (free + 2),
        method="highs",
    )
    return float(found.fun) / unit


def least_squares(rows: np.ndarray, offsets: np.ndarray) -> np.ndarray:
    return np.linalg.lstsq(rows, offsets, rcond=None)[0]


def simulated(rng: np.random.Generator):  # type: ignore[no-untyped-def]
    """Points of one part, and the truth of each quantity. [mm]"""
    amplitude = rng.uniform(0.0003, 0.003)
    tilt = 1e-4 * rng.standard_normal((3, 2))
    frames = {  # origin, first and second direction in the face, normal
        "A": ([0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]),
        "B": ([0, 0, -20], [1, 0, 0], [0, 0, 1], [0, -1, 0]),
        "C": ([0, 0, -20], [0, 1, 0], [0, 0, 1], [-1, 0, 0]),
    }
    truth: dict[str, float] = {}
    positions, normals, faces, planes, heights = [], [], [], {}, {}
    for number, (name, size) in enumerate(SIZES.items(), start=1):
        form = wave(rng, size[0], amplitude)
        slope, off = tilt[number - 1], 0.002 * rng.standard_normal()

        def height(at: np.ndarray, form=form, slope=slope, off=off):  # type: ignore[no-untyped-def]
            return form(at) + at @ slope + off

        heights[name] = height
        origin, first, second, normal = (np.array(v, float) for v in frames[name])
        count = int(rng.integers(10, 21))
        at = 1.0 + rng.uniform(size=(count, 2)) * (np.array(size) - 2.0)
        h = height(at)
        positions.append(origin + at[:, :1] * first + at[:, 1:] * second + h[:, None] * normal)
        normals.append(np.tile(normal, (count, 1)))
        faces += [number] * count
        dense = rng.uniform(size=(DENSE, 2)) * np.array(size)
        design = np.column_stack([dense, np.ones(DENSE)])
        planes[name] = (least_squares(design, height(dense)), at, h)
        if name == "A":
            truth["A flatness"] = zone(np.column_stack([at, np.ones(count)]), h)
    axis = _bore(rng, amplitude, planes, positions, normals, faces, truth)
    at_targets = _at_targets(rng, heights)
    truth["bore position to T|U|V"] = _position(axis, *(each for each, _ in at_targets))
    for number, (each, normal) in enumerate(at_targets, start=6):
        positions.append(each)
        normals.append(np.tile(normal, (len(each), 1)))
        faces += [number] * len(each)
    points = np.vstack(positions)
    truth["B profile to A"] = profile(planes["A"][0], points[np.array(faces) == 2])
    outward = np.vstack(normals)
    return points, outward, np.array(faces), truth


def _at_targets(rng, heights):  # type: ignore[no-untyped-def]
    """Touches of T, U and V with their normals: at points, or in areas and along a line."""
    a, b = np.array(CORNERS), np.array([[5.0, 10.0], [55.0, 10.0]])
    if rng.integers(2):
        away = 0.5 * AREA * np.sqrt(rng.uniform(size=(3, 4)))
        angle = rng.uniform(0.0, 2.0 * np.pi, (3, 4))
        a = a[:, None] + (away * np.array([np.cos(angle), np.sin(angle)])).transpose(1, 2, 0)
        a = a.reshape(-1, 2)
        b = np.column_stack([np.linspace(5.0, 55.0, 7), np.full(7, 10.0)])
    c = np.array([[20.0, 10.0]])
    return (
        (np.column_stack([a, heights["A"](a)]), (0.0, 0.0, 1.0)),
        (np.column_stack([b[:, 0], -heights["B"](b), b[:, 1] - 20.0]), (0.0, -1.0, 0.0)),
        (np.column_stack([-heights["C"](c), c[:, 0], c[:, 1] - 20.0]), (-1.0, 0.0, 0.0)),
    )


def _position(axis: np.ndarray, t: np.ndarray, u: np.ndarray, v: np.ndarray) -> float:
    """Twice the distance of the ends of an axis from its place, in the frame that rests on touches.

    T takes two turns, U the third and a shift, V the last shift.
    """
    slope = rests(np.column_stack([t[:, :2], np.ones(len(t))]), t[:, 2])
    z = np.array([-slope[0], -slope[1], 1.0]) / math.hypot(1.0, *slope[:2])
    x = np.array([1.0, 0.0, 0.0]) - z[0] * z
    x /= np.linalg.norm(x)
    y = np.cross(z, x)
    lean, off = rests(np.column_stack([u @ x, np.ones(len(u))]), -u @ y)
    origin = -off * y
    x = (x - lean * y) / math.hypot(1.0, lean)
    y = np.cross(z, x)
    away = np.column_stack([(axis - v[0]) @ x, (axis - origin) @ y]) - CENTRE
    return float(2.0 * np.linalg.norm(away, axis=1).max())


def rests(rows: np.ndarray, heights: np.ndarray) -> np.ndarray:
    """Amounts of the columns above all heights with the smallest largest gap (ISO 5459)."""
    unit, one = 1e3, np.ones((len(rows), 1))
    found = linprog(
        np.append(np.zeros(rows.shape[1]), 1.0),
        A_ub=np.vstack([np.hstack([-rows, 0.0 * one]), np.hstack([rows, -one])]),
        b_ub=unit * np.r_[-heights, heights],
        bounds=[(None, None)] * (rows.shape[1] + 1),
        method="highs",
    )
    return np.asarray(found.x[:-1]) / unit


def _bore(rng, amplitude, planes, positions, normals, faces, truth):  # type: ignore[no-untyped-def]
    form = lobes(rng, amplitude)
    shift, lean = 0.004 * rng.standard_normal(2), 1e-4 * rng.standard_normal(2)
    size = RADIUS + 0.003 * rng.standard_normal()

    def surface(angle: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Points of the bore, and their distances from its nominal axis."""
        radius = size + form(angle, z)
        ray = np.column_stack([np.cos(angle), np.sin(angle)])
        at = CENTRE + shift + (z[:, None] + 8.0) * lean + radius[:, None] * ray
        return np.column_stack([at, z]), ray

    angle, z = rng.uniform(0, 2 * np.pi, DENSE), rng.uniform(-DEPTH, 0.0, DENSE)
    at, _ = surface(angle, z)
    found = _cylinder(at)
    truth["bore diameter"] = 2.0 * found[4]
    a, b, c = (planes[name][0] for name in "ABC")
    ends, axis = [], []
    for end in (-DEPTH + 1.0, -1.0):  # the touched length
        place = np.array([*(found[:2] + (end + 8.0) * found[2:4]), end])
        axis.append(place)
        # In the frame of A|B|C: A turns it about x and y; B about z, and shifts; C shifts.
        about_x, about_y = a[1], -a[0]
        turned = place - np.cross([about_x, about_y, 0.0], place)
        b_slope_x = b[0]  # its normal is -y: height = -(y)
        about_z = -b_slope_x
        turned = turned - np.cross([0.0, 0.0, about_z], turned)
        middle_b = b @ np.array([30.0, 10.0, 1.0])
        middle_c = c @ np.array([20.0, 10.0, 1.0])
        own_b = np.array([30.0, -middle_b, -10.0])
        own_c = np.array([-middle_c, 20.0, -10.0])
        for v in (own_b, own_c):
            v -= np.cross([about_x, about_y, 0.0], v)
            v -= np.cross([0.0, 0.0, about_z], v)
        ends.append(2.0 * math.hypot(turned[0] - own_c[0] - 30.0, turned[1] - own_b[1] - 20.0))
    truth["bore position to A|B|C"] = max(ends)
    for number, heights in ((4, (-15.0, -11.0, -8.0, -5.0, -1.0)), (5, (-8.0,))):
        angles, levels = [], []
        for level in heights:
            many = 8 if number == 4 else int(rng.integers(10, 21))
            step = 2.0 * np.pi / many
            angles.append(step * np.arange(many) + rng.uniform(0.0, 0.7 * step, many))
            levels.append(np.full(many, level))
        angle, z = np.concatenate(angles), np.concatenate(levels)
        at, ray = surface(angle, z)
        positions.append(at)
        normals.append(-np.column_stack([ray, np.zeros(len(ray))]))
        faces += [number] * len(at)
        if number == 5:
            away = at[:, :2] - CENTRE
            ray = away / np.linalg.norm(away, axis=1)[:, None]
            rows = np.column_stack([ray, np.ones(len(ray))])
            truth["ring roundness"] = zone(rows, np.linalg.norm(away, axis=1) - RADIUS)
    return np.array(axis)


def _cylinder(points: np.ndarray) -> np.ndarray:
    """Centre at z = -8, slopes and radius by least squares, in small steps."""
    found = np.array([*CENTRE, 0.0, 0.0, RADIUS])
    for _ in range(6):
        z = points[:, 2] + 8.0
        away = points[:, :2] - found[:2] - z[:, None] * found[2:4]
        distance = np.linalg.norm(away, axis=1)
        ray = away / distance[:, None]
        rows = np.column_stack([ray, z[:, None] * ray, np.ones(len(ray))])
        found = found + least_squares(rows, distance - found[4])
    return found


def touched(rng: np.random.Generator, points: np.ndarray, normals: np.ndarray, faces: np.ndarray):  # type: ignore[no-untyped-def]
    """The points as a probe finds them, with what they state."""
    count = len(points)
    map_terms = [U_MAP * normals @ rng.standard_normal(3) / 1.0 for _ in range(2)]
    shared = {"tip radius": np.full(count, U_RADIUS)}
    for k, term in enumerate(map_terms, start=1):
        shared[f"map {k}"] = term
    error = NOISE * rng.standard_normal(count)
    error += sum(rng.standard_normal() * each for each in shared.values())
    variance = NOISE**2 + sum(each**2 for each in shared.values())
    found = points + error[:, None] * normals
    return Points(
        found,
        normals,
        np.zeros(count),
        variance[:, None, None] * normals[:, :, None] * normals[:, None, :],
        np.sum(found * normals, axis=1),  # of the planes, which go through the origin
        tuple(str(i + 1) for i in range(count)),
        shared,
        face=faces,
    )


FORMS = ("A flatness", "ring roundness")


def compared(seed: int) -> dict[str, tuple[float, float, float, str, float]]:
    """Truth, interval, verdict and limit of each quantity of one part."""
    rng = np.random.default_rng(seed)
    points, normals, faces, truth = simulated(rng)
    flat = f"{rng.choice([0.002, 0.004, 0.006, 0.01])}"
    size, other = (0.0, POINTS) if np.sum(faces == 7) == 2 else (AREA, LINE)
    places = [[x, y, 0.0, size] for x, y in CORNERS]
    text = DRAWING.replace("FLAT", flat).replace("T_PLACES", f"{places}").replace("U_PLACES", other)
    text = re.sub(r",\n {4,}", ", ", text)
    drawing = _drawing(text)
    result = pretravel.measure_drawing(
        touched(rng, points, normals, faces), drawing, u_machine=U_MACHINE
    )
    found = {}
    for line in result.lines:
        name = f"{line.feature} {line.characteristic}"
        if name in truth:
            feature = result[line.feature]
            quantity = feature[line.characteristic]
            found[name] = (
                truth[name],
                *quantity.interval,
                line.verdict.value,
                line.upper,
                line.lower,
            )
    return found


def profile(slope: np.ndarray, points: np.ndarray) -> float:
    """Of B to A: the smallest zone across A that has all points of B, free to shift and to turn.

    Up along the normal of A the nominal face moves by the slope of A.
    """
    offsets = points[:, 1] + slope[1] * (points[:, 2] + 10.0)
    return zone(np.column_stack([points[:, 0], np.ones(len(points))]), offsets)


def _drawing(text: str):  # type: ignore[no-untyped-def]
    from pretravel.base import temporary_folder

    with temporary_folder() as folder:
        (folder / "drawing.toml").write_text(text, encoding="utf-8")
        return pretravel.read_drawing(folder / "drawing.toml")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    args = parser.parse_args()
    rows: dict[str, list[tuple[float, float, float, str, float, float]]] = {}
    for seed in range(args.first, args.first + args.sets):
        for name, row in compared(seed).items():
            rows.setdefault(name, []).append(row)
            if name in FORMS and row[0] >= SEEN:
                rows.setdefault(f"{name} >= {1e3 * SEEN:.1f} µm", []).append(row)
    print(f"{args.sets} parts")
    for name, found in rows.items():
        inside = np.mean([low <= true <= high for true, low, high, *_ in found])
        wrong = [
            verdict for true, _, _, verdict, upper, lower in found
            if (verdict == "conforms" and not lower <= true <= upper)
            or (verdict == "does not conform" and lower <= true <= upper)
        ]  # fmt: skip
        decided = sum(row[3] != "cannot be decided" for row in found)
        mean = np.mean([high - low for _, low, high, *_ in found]) / 2e-3
        print(
            f"{name:24s} contained {100 * inside:5.1f} % of {len(found)}, half width {mean:.1f} µm "
            f"wrong {len(wrong)} of {decided} decided"
        )


if __name__ == "__main__":
    main()
