"""From a model with PMI, and touches without normals and labels, to a line for each tolerance.

The part and its touches are those of `examples/data`: its boss is 14 mm (bracket.step), the PMI of
bracket_pmi.step asks 14 g6, 13.983 to 13.994 mm (ISO 286-1): it must fail.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pretravel
from pretravel.base.errors import PretravelError
from pretravel.drawing.tasks.measure.lines import VERDICT_LEVELS
from pretravel.drawing.tasks.measure.picture import verdicts_view
from pretravel.drawing.tolerances.drawing_on_part import differences_from_part, drawing_on_part
from pretravel.drawing.tolerances.features_file import DrawnFeature, DrawnRelation, NotDecided
from pretravel.measurement.points import Points
from pretravel.show import SpaceChart, SpaceNotes, cell_texts
from tests.support.commands import both_outputs, run
from tests.support.examples import EXAMPLES
from tests.support.feature_points import feature_points

pytestmark = pytest.mark.long  # a part is compensated first

MODEL = EXAMPLES / "bracket_pmi.step"
TOUCHES = EXAMPLES / "bracket_touches.csv"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("by_faces")
    run("qualify", EXAMPLES / "sphere_touches.csv", "--diameter", 24.9987, "--tip-diameter", 6,
        "--u-diameter", 0.1, "-o", place / "map.json")  # fmt: skip
    run("drawing", MODEL, "-o", place / "drawing.toml")
    run("align", EXAMPLES / "bracket_tip_centres.csv", "--part", MODEL, "--map",
        place / "map.json", "--points", place / "points.csv")  # fmt: skip
    return place


@pytest.fixture(scope="module")
def points(folder: Path) -> Points:
    return pretravel.read_points(folder / "points.csv")


def test_three_commands_to_the_lines(folder: Path) -> None:
    told = run("measure", folder / "points.csv", "--drawing", folder / "drawing.toml", "--part",
               MODEL, "--u-machine", 1, code=3)  # fmt: skip
    rows = told.splitlines()
    assert rows[0].startswith("1 does not conform (cylinder13: diameter)")
    assert "1 feature without a tolerance" in rows[0]
    heading = rows.index("Tolerances")
    assert rows[heading + 2].startswith("cylinder13")
    assert "✖ does not conform: too large" in rows[heading + 2]
    assert sum("✔ conforms" in row for row in rows) == 5


def test_faces_of_points(points: Points) -> None:
    """What the labels say of the same touches; plane3 is face 3, bore1 face 12, boss face 13."""
    labels = [row.partition(",")[0]
              for row in TOUCHES.read_text().splitlines()[1:]]  # fmt: skip
    assert points.face is not None
    of_label = {"plane3": 3, "plane16": 16, "bore1": 12, "bore2": 14, "boss": 13}
    for label, face in zip(labels, points.face.tolist(), strict=True):
        name = label.partition("-")[0]
        if name in of_label:
            assert face == of_label[name], label
    assert len(points[points.face == 12]) == 8


def test_python_gives_the_same(folder: Path, points: Points) -> None:
    part = pretravel.read_part(MODEL)
    drawing = pretravel.read_drawing(folder / "drawing.toml")
    result = pretravel.measure_drawing(points, drawing, part=part, u_machine=1e-3)
    assert result.report().startswith("1 does not conform (cylinder13: diameter)")
    assert [line.level for line in result.lines] == sorted(
        (line.level for line in result.lines), key=list(VERDICT_LEVELS.values()).index
    )
    diameter = result["cylinder13"]["diameter"]
    assert abs(diameter.value - 14.0) < diameter.expanded_u + 2e-3
    aligned = pretravel.align(
        EXAMPLES / "bracket_tip_centres.csv", part, pretravel.read_map(folder / "map.json")
    )
    assert np.array_equal(aligned.in_part.face, points.face)


def test_numbers_have_the_digits_of_their_u(folder: Path, points: Points) -> None:
    """Two of u; a range that was read off one more than the least of its feature."""
    drawing, part = pretravel.read_drawing(folder / "drawing.toml"), pretravel.read_part(MODEL)
    result = pretravel.measure_drawing(points, drawing, part=part, u_machine=1e-3)
    (table,) = (each for each in result.document().tables
                if [column.name for column in each.columns][:3]
                == ["feature", "quantity", "uncompensated"])  # fmt: skip
    cells = {column.name: cell_texts(column) for column in table.columns}
    row = list(zip(cells["feature"], cells["quantity"], strict=True)).index(
        ("cylinder13", "diameter")
    )
    diameter = result["cylinder13"]["diameter"]
    assert 1e-3 < diameter.u < 1e-2  # mm
    assert cells["compensated"][row] == f"{diameter.value:.4f}"
    assert cells["u"][row] == f"{1e3 * diameter.u:.1f}"
    assert all(len(text.lstrip("0.").replace(".", "")) <= 3 for text in cells["u"])
    (read_off,) = (text for feature, quantity, text in zip(
        cells["feature"], cells["quantity"], cells["compensated"], strict=True)
        if (feature, quantity) == ("cylinder13", "measured range"))  # fmt: skip
    assert len(read_off.partition(".")[2]) == 5


def test_the_picture_has_a_flag_for_what_fails(folder: Path, points: Points) -> None:
    """Above the part, whose top is at 20 mm: a bore that was touched 14 mm below it, too."""
    part = pretravel.read_part(MODEL)
    drawing = pretravel.read_drawing(folder / "drawing.toml")
    result = pretravel.measure_drawing(points, drawing, part=part, u_machine=1e-3)
    low = [
        replace(each, feature=replace(each.feature, points=replace(
            each.feature.points, positions=each.feature.points.positions - [0.0, 0.0, 5.0])))
        for each in result.features
    ]  # fmt: skip
    (chart,) = verdicts_view(part, low, result.lines).charts
    assert isinstance(chart, SpaceChart)
    notes = [mark for mark in chart.marks if isinstance(mark, SpaceNotes)]
    heights = {word.strip(): at[2] for mark in notes
               for word, at in zip(mark.texts, mark.positions, strict=True)}  # fmt: skip
    for word in ("✖ cylinder13", "? cylinder12", "? cylinder14"):
        assert heights[word] > 20.0


def test_a_face_without_touches_is_not_called_conforming(points: Points) -> None:
    rows = (
        pretravel.DrawnFeature(faces=(5,), form_tolerance=0.01),
        pretravel.DrawnFeature(faces=(3,), geometric=(
            pretravel.GeometricTolerance("parallelism", 0.01, ("face5",)),
        )),
    )  # fmt: skip
    part = pretravel.read_part(MODEL)
    result = pretravel.measure_drawing(points, pretravel.Drawing(rows), part=part)
    assert result.exit_code == 3
    assert [line.words for line in result.lines] == [
        "not measured: no touch is on face 5",
        "not measured: face5: no touch is on face 5",
    ]
    assert "0 of 2 within the tolerance" in result.report()


def test_a_drawing_of_which_nothing_was_touched_has_its_lines(
    points: Points, tmp_path: Path
) -> None:
    """All of its faces are elsewhere, or nothing of the model is decided."""
    undecided = NotDecided("face 12", "diameter", "common tolerance", "12..12.02")
    for drawing, words in (
        (pretravel.Drawing((pretravel.DrawnFeature(faces=(5,), form_tolerance=0.01),)),
         "not measured: no touch is on face 5"),
        (pretravel.Drawing(not_decided=(undecided,)), "not decided: common tolerance"),
    ):  # fmt: skip
        result = pretravel.measure_drawing(points, drawing, part=pretravel.read_part(MODEL))
        assert result.exit_code == 3
        assert [line.words for line in result.lines] == [words]
        assert "0 of 1 within the tolerance" in result.report()
        assert result.document().pictures == ()
        with pytest.raises(PretravelError, match="no feature was measured, so one"):
            result.write("output", tmp_path / "one.csv")


@pytest.mark.parametrize("drawn", [60.0, 120.0])
def test_an_angle_is_that_of_the_drawing(drawn: float) -> None:
    """Between planes whose outward normals are 120° apart, as NIST's CTC 1 has them: 60° of
    material, which was decided as 120.0003° against 59.5 to 60.5°."""
    turn = np.radians(120.0)
    flat = np.array([[x, y, 0.0] for x in (0.0, 20.0, 40.0) for y in (0.0, 20.0, 40.0)])
    about_y = np.array(
        [[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]]
    )
    up = np.tile([0.0, 0.0, 1.0], (9, 1))
    points = feature_points(
        np.vstack([flat, flat @ about_y.T + 60.0]),
        np.vstack([up, up @ about_y.T]),
        shared={"map 1": np.full(18, 1e-4)},
    )
    planes = tuple(pretravel.DrawnFeature("plane", label=f"p{k}", faces=(k,)) for k in (1, 2))
    between = DrawnRelation(("p1", "p2"), f"{drawn - 0.5}..{drawn + 0.5}", "angle", drawn)
    (line,) = pretravel.measure_drawing(
        replace(points, face=np.repeat([1, 2], 9)),
        pretravel.Drawing(planes, between=(between,)),
        u_machine=1e-4,
    ).lines
    assert line.value == pytest.approx(drawn, abs=1e-6)
    assert line.verdict.value == "conforms"


def test_a_drawing_of_another_part(folder: Path, points: Points) -> None:
    """The bore of face 12 has 12 mm, and its axis is z; face 7 is a plane, 25° from z."""
    part, drawing = pretravel.read_part(MODEL), pretravel.read_drawing(folder / "drawing.toml")
    rows = {row.name: row for row in drawing.feature}
    bore = rows["cylinder12"]
    for row, message in (
        (bore, ""),
        (replace(bore, nominal=12.01, tolerance="12..12.02"), ""),  # the model is within limits
        (replace(bore, nominal=12.2, tolerance="±0.1"), "nominal_mm is 12.2, and the diameter of"),
        (replace(bore, nominal=12.2, tolerance=None), "nominal_mm is 12.2, and the diameter of"),
        (replace(bore, axis=(0.0, 0.01, 1.0)), "axis in the drawing is 0.57° from that of face 12"),
        (replace(rows["plane7"], axis=(0.0, 0.0, 1.0)), "axis in the drawing is 25° from that"),
    ):
        told = " ".join(differences_from_part(pretravel.Drawing((row,)), part, points))
        assert message in told if message else not told, told
    for kind in ("sphere", "cone", "plane"):
        with pytest.raises(PretravelError, match=f"is a {kind}, but the kind of face 12"):
            drawing_on_part(pretravel.Drawing((DrawnFeature(kind, faces=(12,)),)), part)


class TestThePartWasChanged:
    """After the drawing or the points were made: the answer says where they differ."""

    def test_a_bore_that_was_moved(self, folder: Path, tmp_path: Path) -> None:
        moved = tmp_path / "moved.step"  # by 1 mm in y
        moved.write_text(re.sub(r"\((6[59]\.),14\.,", r"(\1,15.,", MODEL.read_text()))
        _, warned = both_outputs("measure", folder / "points.csv", "--drawing",
                                 folder / "drawing.toml", "--part", moved, code=3)  # fmt: skip
        said = "cylinder14: its place in the drawing is 1.000 mm from face 14 of moved.step"
        assert [said in row for row in warned.splitlines() if "in the drawing is" in row] == [True]

    def test_touches_of_another_face(self, folder: Path, points: Points) -> None:
        assert points.face is not None
        other = points.face.copy()
        other[points.face == 12], other[points.face == 14] = 14, 12
        drawing, part = pretravel.read_drawing(folder / "drawing.toml"), pretravel.read_part(MODEL)
        said = [
            pretravel.measure_drawing(replace(points, face=face), drawing, part=part).left_out
            for face in (points.face, other)
        ]
        # 53.04 mm between the axes, less a radius or nearly so.
        assert [sum("(median) from face 1" in each for each in one) for one in said] == [0, 2]

    def test_a_face_of_another_kind(self, folder: Path, points: Points) -> None:
        row = pretravel.DrawnFeature("cylinder", faces=(11,), label="bore")
        with pytest.raises(PretravelError, match="'bore' is a cylinder, but the kind of face 11"):
            pretravel.measure_drawing(
                points, pretravel.Drawing((row,)), part=pretravel.read_part(MODEL)
            )


def test_points_without_faces_are_refused_by_name(points: Points) -> None:
    plain = Points.plain(points.positions, points.labels)
    drawing = pretravel.Drawing((pretravel.DrawnFeature("plane", faces=(3,)),))
    with pytest.raises(PretravelError, match="do not give the faces"):
        pretravel.measure_drawing(plain, drawing)


@pytest.mark.parametrize(
    ("row", "words"),
    [
        ({"faces": (3,), "select": "a*"}, "both faces and select"),
        ({"kind": "plane"}, "neither faces nor select"),
        ({"faces": (0,)}, "counted from 1"),
    ],
)
def test_a_feature_states_its_points_once(row: dict[str, object], words: str) -> None:
    with pytest.raises(PretravelError, match=words):
        pretravel.DrawnFeature(**row)  # type: ignore[arg-type]


def test_the_former_option_warns(folder: Path) -> None:
    _, warned = both_outputs("measure", folder / "points.csv", "--features",
                             folder / "drawing.toml", "--part", MODEL, code=3)  # fmt: skip
    assert "--features is deprecated: it is called --drawing now" in warned
