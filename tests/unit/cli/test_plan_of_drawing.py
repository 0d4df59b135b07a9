"""The touches that a drawing needs, on the bracket: how many, where the stylus reaches, the order.

Faces: 3 the top (A), 2 and 1 sides (B, C), 12 a bore of 12 mm, 13 a boss with 14 g6.
"""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest

from pretravel.drawing import InspectionRegion
from pretravel.drawing.tasks.plan.needed import MOST_OF_FEATURE, ReachingStylus, needed_touches
from pretravel.drawing.tolerances.features_file import Drawing, DrawnFeature, DrawnRelation
from pretravel.drawing.tolerances.tolerance_frame import GeometricTolerance
from pretravel.surface import read_part
from tests.support.commands import rows, run
from tests.support.examples import EXAMPLES

MODEL = EXAMPLES / "bracket_pmi.step"
PART = read_part(MODEL)
STYLUS = ReachingStylus(1.5, 0.75)


def planned(*features: DrawnFeature, stylus: ReachingStylus = STYLUS, u: float = 1e-3):  # type: ignore[no-untyped-def]
    return needed_touches(Drawing(features), PART, stylus, u, InspectionRegion())


@pytest.mark.long
def test_datums_first_and_each_feature_together(tmp_path: Path) -> None:
    run("drawing", MODEL, "-o", tmp_path / "drawing.toml")
    told = run("plan", MODEL, "--drawing", tmp_path / "drawing.toml", "--tip-diameter", 3,
               "-o", tmp_path / "plan.csv")  # fmt: skip
    assert "narrowest tolerance" in told
    faces = [row["face"] for row in rows(tmp_path / "plan.csv")]
    order = [faces[0], *(b for a, b in itertools.pairwise(faces) if a != b)]
    assert order[:3] == ["3", "2", "1"]
    assert len(order) == len(set(faces))  # nobody comes back to a face


def test_a_narrower_tolerance_has_more_touches() -> None:
    """U = 2 · 2 u / √n of a plane is a tenth of T: n = (40 u / T)²; at most sixty."""
    wide = planned(DrawnFeature(faces=(4,), form_tolerance=0.1))
    narrow = planned(DrawnFeature(faces=(4,), form_tolerance=0.008))
    tight = planned(DrawnFeature(faces=(4,), form_tolerance=0.001))
    assert len(wide.plan) < 15
    assert 25 <= len(narrow.plan) <= 36
    assert len(tight.plan) <= 2 * MOST_OF_FEATURE
    assert narrow.rows[0][2] <= 0.1 * 0.008
    assert any("of the tolerance" in each for each in tight.warnings)


def test_what_the_stylus_does_not_reach_is_left_out() -> None:
    """Face 8 is an undercut below the top; a tip of 14 mm does not enter a bore of 12 mm."""
    bore = DrawnFeature(faces=(12,), tolerance="11.9..12.1")
    plane = DrawnFeature(faces=(3,), form_tolerance=0.05)
    assert set(planned(bore, plane).plan.face.tolist()) == {3, 12}
    large = planned(bore, plane, stylus=ReachingStylus(7.0, 3.5))
    assert 12 not in large.plan.face
    assert "face12: the stylus along +z reaches no place on it; nor does it" in large.warnings[0]


def test_a_direction_that_reaches_what_is_hidden_is_named() -> None:
    """The underside is open along -z, the undercut slope (8) to the side."""
    under = DrawnFeature(label="under", faces=(5,), form_tolerance=0.05)
    slope = DrawnFeature(faces=(8,), form_tolerance=0.05)
    found = planned(DrawnFeature(faces=(3,), form_tolerance=0.05), under, slope)
    assert found.warnings == (
        ("under (face 5): the stylus along +z reaches no place on it; along -z it reaches it: "
          "turn the part, or take a stylus in this direction"),
        ("face8: the stylus along +z reaches no place on it; along +x it reaches it: "
          "turn the part, or take a stylus in this direction"),
    )  # fmt: skip


def test_a_datum_is_touched_as_its_tolerance_needs() -> None:
    own = GeometricTolerance("perpendicularity", 0.01, ("face3",))
    found = planned(DrawnFeature(faces=(2,), geometric=(own,)))
    assert list(dict.fromkeys(found.plan.face.tolist())) == [3, 2]
    assert [row[3] for row in found.rows] == [0.01, 0.01]
    assert np.all(found.plan.normal @ np.array([0.0, 0.0, 1.0]) > -1e-6)


def test_the_touches_of_each_feature_determine_it() -> None:
    """Rows at the ends of a face are within the margin of its edges, and were left out: one row of
    a plane, one ring of a bore were left, which determine neither."""
    found = planned(
        DrawnFeature(faces=(2,), form_tolerance=0.1),
        DrawnFeature(faces=(12,), tolerance="11.9..12.1"),
        DrawnFeature(faces=(7,), form_tolerance=0.1),
    )
    assert found.warnings == ()
    heights = {
        face: np.unique(found.plan.point[found.plan.face == face, 2].round(3)) for face in (2, 12)
    }
    assert len(heights[2]) >= 2
    assert len(heights[12]) == 3
    assert heights[12][0] < 2.0  # near the lower end, 1 mm from the edge
    assert heights[12][-1] > 18.0


def test_too_few_places_are_said() -> None:
    """A margin of 9.5 mm leaves one row of a face that is 20 mm high."""
    plane = DrawnFeature(faces=(2,), form_tolerance=0.1)
    found = needed_touches(Drawing((plane,)), PART, STYLUS, 1e-3, InspectionRegion(v=(5.0, 5.001)))
    assert any("do not determine it" in each for each in found.warnings)


def test_an_angle_and_one_limit_alone_need_touches() -> None:
    """Planes at an angle to 0.01°, and a bore with one limit: all are touched.

    An angle is a zone along the shorter face: 0.01° of 50 to 120 mm is 9 to 21 µm.
    """
    drawing = Drawing(
        (
            DrawnFeature(faces=(3,), label="top"),
            DrawnFeature(faces=(2,), label="side"),
            DrawnFeature(faces=(12,), label="bore", tolerance="11.9.."),
        ),
        between=(DrawnRelation(("top", "side"), "89.995..90.005", "angle", 90.0),),
    )
    found = needed_touches(drawing, PART, STYLUS, 1e-3, InspectionRegion())
    widths = {name: width for name, _, _, width in found.rows}
    assert set(widths) == {"top", "side", "bore"}
    assert widths["top"] == widths["side"]
    assert 9e-3 < widths["top"] < 21e-3
    assert np.isnan(widths["bore"])
