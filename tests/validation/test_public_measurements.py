"""Measurements of others, which their authors published without a licence: not in the repository.

The folder of them is named by the environment variable PRETRAVEL_PUBLIC_DATA; without it these
tests are skipped. `docs/validation.md` has their figures.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError
from pretravel.base.frames import Placement
from pretravel.drawing.alignment.alignment import Alignment, radius_alone
from pretravel.drawing.alignment.alignment_fit import align
from pretravel.drawing.alignment.tip_centres import TipCentres
from pretravel.files.logs.cmm_listing import read_cmm_listing
from pretravel.measurement.association import associate
from pretravel.surface.cad.face import Face
from pretravel.surface.cad.part import Part
from pretravel.surface.placed_shape import axes_about
from pretravel.surface.shapes import Plane, Reversed
from pretravel.surface.shapes_of_revolution import Cylinder

FOLDER = Path(os.environ.get("PRETRAVEL_PUBLIC_DATA", ""))
pytestmark = pytest.mark.skipif(
    "PRETRAVEL_PUBLIC_DATA" not in os.environ, reason="the folder of public data is not named"
)
UM = 1e-3
RADIUS = 1.0
"""Of the tip, which the files do not state: of 0.5, 1, 1.5 and 2 mm the one that fits. [mm]"""
PARTS = [f"L{layer}_{side}EW_{half}" for layer in (0, 1, 2) for side in "NS" for half in (1, 2)]


def _nominal(name: str) -> dict[int, tuple[str, FloatArray, FloatArray, float]]:
    """Faces of a wheel: kind, point, direction, radius, which is negative for hollows."""
    found = {}
    layer, side = name[:2], name[3:6]
    for line in (FOLDER / "mvtx" / f"MIT{side}_{layer}.txt").read_text().splitlines():
        # One line of one file lacks the blank after its number.
        words = re.sub(r"^(\d+)([12]) (?=\d+\.)", r"\1 \2 ", line).split()
        if not words or line.startswith("#"):
            continue
        kind, values = int(words[1]), np.array([float(word) for word in words[2:9]])
        direction = values[3:6] / np.linalg.norm(values[3:6])
        radius = float(values[6]) * np.sign(kind)
        kinds = "plane" if abs(kind) == 1 else "cylinder"
        found[int(words[0])] = (kinds, values[:3], direction, radius)
    return found


def _touched(name: str) -> tuple[FloatArray, list[int], FloatArray]:
    """Tip centres that the authors used, numbers of their faces, the authors' weights."""
    text = (FOLDER / "mvtx" / f"{name}_corrected.dat").read_text()
    rows = [line.split(";") for line in text.splitlines() if line.strip()]
    sigma = np.array([float(row[8]) for row in rows])
    known = _nominal(name)
    used = [i for i, row in enumerate(rows) if sigma[i] < 100.0 and int(row[1]) in known]
    positions = np.array([[float(word) for word in row[4:7]] for row in rows])
    return positions[used], [int(rows[i][1]) for i in used], sigma[used]


def _part(name: str) -> tuple[Part, list[int]]:
    faces, numbers = [], sorted(_nominal(name))
    for number in numbers:
        kind, point, direction, radius = _nominal(name)[number]
        surface = (
            Plane(point, direction)
            if kind == "plane"
            else Cylinder(point, abs(radius), axes_about(direction))
        )
        base = Reversed(surface) if radius < 0.0 else surface
        faces.append(Face(number + 1, "", kind, base, None, False))
    return Part(name, tuple(faces), tuple(range(len(faces)))), numbers


def _aligned(name: str) -> tuple[Alignment, FloatArray, FloatArray]:
    """From each of the 24 right turns, with the known faces; the best is the answer."""
    part, numbers = _part(name)
    positions, of_face, sigma = _touched(name)
    face = np.array([numbers.index(number) for number in of_face])
    middle = np.array([_nominal(name)[number][1] for number in of_face]).mean(axis=0)
    found = []
    for turn in Rotation.create_group("O").as_matrix():
        start = Placement(turn, positions.mean(axis=0) - turn @ middle)
        try:
            found.append(align(TipCentres(positions, faces=face), part, radius_alone(RADIUS), start,
                               extrapolate=True))  # fmt: skip
        except PretravelError:
            continue
    best = min(found, key=lambda each: float(np.sum(each.residuals**2)))
    return best, positions, sigma


def _by_scipy(name: str, start: Placement, weights: FloatArray) -> tuple[Placement, FloatArray]:
    """The same least squares in a few lines: distances from planes and axes."""
    positions, of_face, _ = _touched(name)
    faces = [_nominal(name)[number] for number in of_face]
    points, directions = (np.array([face[i] for face in faces]) for i in (1, 2))
    radii = np.array([face[3] for face in faces])
    planes = np.array([face[0] == "plane" for face in faces])

    def placed(x: FloatArray) -> Placement:
        turn = Rotation.from_rotvec(x[3:]).as_matrix() @ start.rotation
        return Placement(turn, start.shift + x[:3])

    def distances(x: FloatArray) -> FloatArray:
        away = (positions - placed(x).shift) @ placed(x).rotation - points
        along = np.sum(away * directions, axis=1)
        off = np.linalg.norm(away - along[:, None] * directions, axis=1)
        return np.where(planes, along, np.sign(radii) * (off - np.abs(radii))) - RADIUS

    found = least_squares(lambda x: weights * distances(x), np.zeros(6), xtol=1e-15, ftol=1e-15)
    return placed(found.x), distances(found.x)


@pytest.mark.parametrize("name", PARTS)
def test_the_wheels_of_a_particle_detector(name: str) -> None:
    """12 parts whose frame was unknown: the placement is that of an independent least squares."""
    found, positions, _ = _aligned(name)
    assert not found.gross.any()
    assert found.scatter < 100.0 * UM  # the parts spring out by hundredths of a millimetre
    plain, distances = _by_scipy(name, found.placement, np.ones(len(positions)))
    assert found.placement.points(positions) == pytest.approx(
        plain.points(positions), abs=0.01 * UM
    )
    assert found.residuals == pytest.approx(distances, abs=0.01 * UM)


def authors_weights() -> dict[str, tuple[float, float]]:
    """By part: residuals in µm, and the largest change of a motion over U with the weights that the
    authors gave their points, for `docs/validation.md`."""
    rows = {}
    for name in PARTS:
        found, _, sigma = _aligned(name)
        weighted, _ = _by_scipy(name, found.placement, 1.0 / sigma)
        turn = weighted.rotation @ found.placement.rotation.T
        shift = weighted.shift - (turn @ (found.placement.shift - found.about) + found.about)
        change = np.concatenate([shift, Rotation.from_matrix(turn).as_rotvec()])
        over = float(np.max(np.abs(change) / (2.0 * found.standard_uncertainty)))
        rows[name] = found.scatter / UM, over
    return rows


def test_features_of_the_software_of_a_cmm() -> None:
    """Diameters, centres and forms of two circles and two planes of a listing, to its four digits.

    Points are rounded to 0.1 µm, which moves a range by up to 0.1 µm and centres by less.
    """
    features = read_cmm_listing(FOLDER / "cmm_listing.csv")
    assert [feature.name for feature in features] == ["CR4", "CR5", "PL9", "PL10"]
    for feature in features:
        stated = {result.quantity: result.actual for result in feature.results}
        circle = "D" in stated
        found = associate("circle" if circle else "plane", np.array(feature.points),
                          axis=[0.0, 0.0, 1.0] if circle else None)  # fmt: skip
        form = stated["Cirlty" if circle else "Flat"]
        assert found.form == pytest.approx(form, abs=0.15 * UM)
        if circle:
            assert found.diameter == pytest.approx(stated["D"], abs=0.1 * UM)
            assert found.point[:2] == pytest.approx([stated["X"], stated["Y"]], abs=0.1 * UM)
