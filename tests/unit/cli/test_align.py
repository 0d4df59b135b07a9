"""pretravel align: from touches anywhere to the frame of the part, and what goes on from there."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.base.frames import parse_placement
from pretravel.drawing.alignment import aligning
from pretravel.drawing.alignment.alignment_fit import align
from pretravel.drawing.alignment.tip_centres import TipCentres
from pretravel.drawing.tasks.align import Align
from pretravel.files.map_file import read_map, write_map
from pretravel.files.placement_file import read_placement
from pretravel.files.points_reading import read_points
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.surface import Part, read_part
from tests.support.commands import both_outputs, rows, run
from tests.support.example_maps import example_map
from tests.support.examples import EXAMPLES
from tests.support.plans import DRAWING

pytestmark = pytest.mark.long  # a search for each placement

PART, TOUCHES = EXAMPLES / "bracket.step", EXAMPLES / "bracket_touches.csv"
TRUE = parse_placement("212,-48,-210,0.4,-0.3,33")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """With the map, and the placement and points that the first command makes."""
    made = tmp_path_factory.mktemp("aligned")
    write_map(made / "map.json", example_map("physical"))
    run("align", TOUCHES, "--part", PART, "--map", made / "map.json",
        "-o", made / "place.json", "--points", made / "points.csv")  # fmt: skip
    return made


def test_the_placement_is_found_from_nothing(folder: Path) -> None:
    """That of the simulation, within U of the six motions."""
    found = read_placement(folder / "place.json")
    corners = np.array([[0, 0, 0], [80, 0, 0], [0, 50, 0], [0, 0, 32.0]])
    apart = found.points(corners) - TRUE.points(corners)
    assert found.errors is not None
    factors = found.errors.factors(found.points(corners))
    u = np.sqrt(np.sum(factors**2, axis=0))
    assert np.abs(apart / u).max() < 3.0
    assert 0.1e-3 < u.min() < u.max() < 2e-3


def test_points_in_the_part_are_measured_as_the_drawing_asks(folder: Path) -> None:
    points = read_points(folder / "points.csv")
    assert points.shared is not None
    assert "alignment 1" in points.shared
    (folder / "features.toml").write_text(
        '[[feature]]\nkind = "cylinder"\nselect = "bore1-*"\nat_mm = [12.0, 12.0, 10.0]\n'
        'axis = [0.0, 0.0, 1.0]\ntolerance = "11.95..12.05"\nposition_tolerance_mm = 0.05\n'
        '[[feature]]\nkind = "cylinder"\nselect = "boss-*"\nlabel = "boss"\nnominal_mm = 14.0\n'
        'tolerance = "±0.02"\n'
    )
    text = run("measure", folder / "points.csv", "--drawing", folder / "features.toml")
    assert "boss" in text
    assert "position" in text
    assert "does not conform" not in text


def test_compensate_reads_the_placement_and_takes_normals_of_the_part(folder: Path) -> None:
    _, text = both_outputs("compensate", TOUCHES, "--map", folder / "map.json", "--nominal", PART,
               "--place", folder / "place.json", "-o", folder / "machine.csv")  # fmt: skip
    assert "the touches have no normals: the normals of the nearest" in text
    assert "deviations also contain the error of the placement, U up to" in text
    points = read_points(folder / "machine.csv")
    assert points.deviation is not None
    # The form of the part is 1 µm; the points stay in the machine's frame.
    assert np.std(points.deviation) < 2e-3
    assert points.positions[:, 2].max() < -170.0


def test_datums_and_what_they_do_not_determine(folder: Path) -> None:
    text, warned = both_outputs(
        "align", TOUCHES, "--part", PART, "--map", folder / "map.json",
        "--datum", "A=3", "--datum", "B=12,14", "-o", folder / "datums.json", "--verbose",
    )  # fmt: skip
    assert "datums A=3, B=12,14" in text
    # The other four touches of face 3 are nearly on a line: one more on it checks nothing.
    assert "nothing checks plane3-3 (face 3)" in warned
    assert "Touch again close to it" in warned
    assert "not determined" not in text
    text, warned = both_outputs(
        "align", TOUCHES, "--part", PART, "--map", folder / "map.json", "--datum", "A=3",
        "-o", folder / "of_a.json",
    )  # fmt: skip
    assert "3 of 6 motions are not determined" in text
    assert "shift along x; shift along y; turn about z" in warned
    other = shutil.copy(PART, folder / "other.step")
    place = ("--nominal", other, "--place", folder / "of_a.json", "-o", folder / "a.csv")
    _, warned = both_outputs("compensate", TOUCHES, "--map", folder / "map.json", *place)
    # Fifteen of the 79 touches lie on faces 3, 15 and 16, across which nothing is free.
    assert "leaves 3 motions as they were at the start, which move 64 of 79 points" in warned
    assert "of_a.json is the placement of bracket.step, and the nominal surface is that" in warned


def test_a_datum_without_a_motion_left_is_named_and_not_used(folder: Path) -> None:
    call = ("align", TOUCHES, "--part", PART, "--map", folder / "map.json",
            "--start", folder / "place.json", "--datum", "A=3", "--datum", "B=12,14")  # fmt: skip
    plain = run(*call)
    assert "21 of 79 touches" in plain
    for outside in ((), ("--datum-association", "outside")):
        text, warned = both_outputs(*call, "--datum", "C=1", *outside)
        # A plane and two parallel bores fix all six motions.
        assert "datum C has no motion left to fix" in warned
        assert "21 of 79 touches" in text
        assert outside or text.replace(", C=1", "") == plain
    warned = both_outputs(*call[:-1], "B=2", "--datum", "C=1")[1]
    assert "no motion left" not in warned


def test_a_start_and_a_page(folder: Path) -> None:
    start = "212.3,-48.2,-210,0,0,33.5"
    run("align", TOUCHES, "--part", PART, "--tip-diameter", 6, "--start", start,
        "-o", folder / "page.html", "--plot", folder / "part.png")  # fmt: skip
    assert "Deviations by face" in (folder / "page.html").read_text(encoding="utf-8")
    assert (folder / "part.png").stat().st_size > 10_000
    again = run("align", TOUCHES, "--part", PART, "--map", folder / "map.json",
                "--start", folder / "place.json")  # fmt: skip
    assert "79 of 79 touches" in again or "touches, best fit" in again
    told = both_outputs("align", TOUCHES, "--part", PART, "--tip-diameter", 3, "--start", start)[1]
    assert "Most points lie outside of the faces" in told
    assert "is the tip's diameter larger" in told
    radians = ("--start", "0,0,0,0,0,3.14")
    told = run("align", TOUCHES, "--part", PART, "--map", folder / "map.json", *radians, code=2)
    assert "three angles in degrees" in " ".join(told.split())


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((), "the map, or the tip's diameter, is needed"),
        (("--tip-diameter", 6, "--feed", 50), "without a map the feed is not used"),
        (("--tip-diameter", 6, "--columns", "x=1", "--from", "grbl"), "and grbl is none"),
        (("--tip-diameter", 6, "--from", "parquet"), "the file is not of format parquet"),
        (("--tip-diameter", 6, "--datum", "A"), "expected a name and its faces"),
        (("--tip-diameter", 6, "--datum", "A=99", "--start", "0,0,0"), "has no face 99"),
        (("--tip-diameter", 6, "--free", "x,q", "--start", "0,0,0"), "they are some of x,y,z"),
        (("--tip-diameter", 6, "--start", "1,2"), "expected x,y,z in mm"),
    ],
)
def test_errors_teach(options: tuple[object, ...], words: str) -> None:
    assert words in " ".join(run("align", TOUCHES, "--part", PART, *options, code=2).split())


def test_feed_and_spindle_of_touches_and_map(folder: Path, tmp_path: Path) -> None:
    """A map of one feed and orientation, touches of others."""
    made = read_map(folder / "map.json")
    made = replace(
        made, feed=50.0, delay=None, provenance=replace(made.provenance, spindle_deg=0.0)
    )
    write_map(tmp_path / "map.json", made)
    head, *lines = TOUCHES.read_text().splitlines()
    path = tmp_path / "touches.csv"
    task = Align(
        touches=(path,), part=PART, map_file=str(tmp_path / "map.json"), start=TRUE.typed()
    )
    path.write_text("\n".join([f"{head},feed_mm_min", *(f"{line},500" for line in lines)]))
    report = task.run().document()
    assert any("made at 50 mm/min, these touches at 500" in said for said in report.warnings)
    assert any("the map is of spindle 0°" in note for note in report.notes)
    path.write_text("\n".join([f"{head},spindle_deg", *(f"{line},90" for line in lines)]))
    for asked in (task.run, lambda: aligning.align(path, read_part(PART), made)):
        with pytest.raises(PretravelError, match="with the spindle turned to 90°"):
            asked()


@pytest.mark.parametrize("rows", [1, 3, 8])
def test_touches_that_cannot_say_where_a_part_lies(tmp_path: Path, rows: int) -> None:
    """Few of them, and eight in one place."""
    few = tmp_path / "few.csv"
    lines = TOUCHES.read_text().splitlines()[: rows + 1]
    if rows == 8:
        lines = [lines[0], *(f"a-{i},1,2,3" for i in range(rows))]
    few.write_text("\n".join(lines) + "\n")
    text = run("align", few, "--part", PART, "--tip-diameter", 6, code=2)
    assert "do not say where a part lies" in " ".join(text.split())


def test_targets_that_are_not_on_the_part_are_no_start(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Targets in the machine's frame, as touches of a part that a machine knows have them."""
    head, *touches = TOUCHES.read_text().splitlines()
    there = (f"{row},{row.split(',', 1)[1]}" for row in touches)
    head += ",nominal_x_mm,nominal_y_mm,nominal_z_mm"
    (tmp_path / "machine.csv").write_text("\n".join([head, *there]) + "\n")
    monkeypatch.setattr(aligning, "only_placement", lambda *_, **__: TRUE)  # the search
    _, warned = both_outputs(
        "align", tmp_path / "machine.csv", "--part", PART, "--map", folder / "map.json",
        "-o", tmp_path / "place.json",
    )  # fmt: skip
    assert "mm from the faces of bracket.step (median): they are in another frame" in warned
    found = read_placement(tmp_path / "place.json")
    assert np.abs(found.shift - TRUE.shift).max() < 0.01


def _twice(tips: TipCentres, part: Part, made: PretravelMap, *, extrapolate: bool) -> list[object]:
    return [align(tips, part, made, TRUE, extrapolate=extrapolate)] * 2


@pytest.mark.parametrize("searched", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_several_answers_are_listed_and_nothing_is_written(
    searched: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Four touches of one face leave nearly all open, which is a long search."""
    few, out = tmp_path / "few.csv", tmp_path / "place.json"
    lines = TOUCHES.read_text().splitlines()
    few.write_text("\n".join([lines[0], *lines[11:16], *lines[21:23]]) + "\n")
    if not searched:
        monkeypatch.setattr(aligning, "found_placements", _twice)
    text = run("align", few if searched else TOUCHES, "--part", PART, "--tip-diameter", 6,
               "-o", out, code=2)  # fmt: skip
    assert "placements explain the touches" in text
    assert "Give the right one as the start" in text
    assert not out.exists()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"schema": "x"}, "this is not a placement"),
        ({"version": 9}, "the version is 9"),
        ({"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 2]]}, "not perpendicular unit vectors"),
        ({"shift_mm": [1, 2]}, "the key shift_mm has the shape"),
        ({"shift_mm": ["a", 2, 3]}, "something that is not a number"),
        ({"covariance": None}, "the key covariance"),
        ({"shift_mm": [212.0, -48.0, -209.0]}, "one of them was changed"),
        ({"covarance": []}, "a placement has no key 'covarance'"),
    ],
)
def test_a_damaged_placement_is_refused(
    folder: Path, tmp_path: Path, change: dict[str, object], words: str
) -> None:
    content = json.loads((folder / "place.json").read_text()) | change
    damaged = tmp_path / "place.json"
    damaged.write_text(json.dumps(content))
    text = run("align", TOUCHES, "--part", PART, "--tip-diameter", 6, "--start", damaged, code=2)
    assert words in " ".join(text.split())


def test_a_bore_without_normals_has_the_diameter_of_that_with_normals(tmp_path: Path) -> None:
    """To 0.05 µm, the probe's lobes included."""
    write_map(tmp_path / "map.json", example_map("physical"))
    lines = (EXAMPLES / "bore_touches.csv").read_text().splitlines()
    bores = [line for line in lines if line.startswith(("label", "bore"))]
    (tmp_path / "with.csv").write_text("\n".join(bores) + "\n")
    plain = [",".join(line.split(",")[:4]) for line in bores]
    (tmp_path / "without.csv").write_text("\n".join(plain) + "\n")
    diameters = []
    for name, option in (("with", ()), ("without", ("--feature", "bore"))):
        run("compensate", tmp_path / f"{name}.csv", "--map", tmp_path / "map.json", *option,
            "-o", tmp_path / "points.csv")  # fmt: skip
        run("measure", tmp_path / "points.csv", "--feature", "bore", "--group",
            "-o", tmp_path / "features.csv")  # fmt: skip
        diameters.append(
            [
                float(row["value"])
                for row in rows(tmp_path / "features.csv")
                if row["quantity"] == "diameter"
            ]
        )
    assert len(diameters[0]) == 2
    assert diameters[1] == pytest.approx(diameters[0], abs=5e-5)


def test_coordinates_alone_are_measured_and_no_tolerance_is_decided(tmp_path: Path) -> None:
    angle = np.arange(8) * np.pi / 4
    noise = 1e-3 * np.array([1, -1, 1, -1, 1, -1, 1, -1])
    rows = [f"{(10 + e) * np.cos(a):.6f},{(10 + e) * np.sin(a):.6f},0"
            for a, e in zip(angle, noise, strict=True)]  # fmt: skip
    (tmp_path / "plain.csv").write_text("x_mm,y_mm,z_mm\n" + "\n".join(rows) + "\n")
    text, warned = both_outputs(
        "measure", tmp_path / "plain.csv", "--feature", "bore", "--tolerance", "19..21", code=3
    )
    assert "20.00000" in text
    assert "cannot be decided" in text
    assert "the points have no uncertainty" in warned
    assert "roundness" not in text


def test_tolerances_to_datums_of_a_drawing(folder: Path) -> None:
    """The bracket is made as its model: distances of bores √(53² + 2²), positions near zero."""
    drawing, table = folder / "drawing.toml", folder / "drawing.csv"
    drawing.write_text(DRAWING)
    text = run("measure", folder / "points.csv", "--drawing", drawing, "--part", PART,
               "--u-machine", 1, "-o", table, "--verbose", code=3)  # fmt: skip
    assert "1 cannot be decided (E: position to A|D|B), 4 of 5 conform" in text
    assert "the size adds" in text
    assert re.search(r"0\.05 \+ 0\.0\d\d\d \(M\) mm", text)
    found = {(row["feature"], row["quantity"]): row for row in rows(table)}
    one = found["D", "position (M) to A|B"]
    assert float(one["value"]) < float(one["expanded_u"]) + 0.002
    assert one["verdict"] == "conforms"
    together = found["D, E", "position to A"]
    assert float(together["value"]) < 0.02
    distance = found["D, E", "distance"]
    assert float(distance["value"]) == pytest.approx(np.hypot(53.0, 2.0), abs=0.005)
    assert distance["verdict"] == "conforms"


def test_what_is_wrong_in_a_drawing(folder: Path) -> None:
    drawing = folder / "wrong.toml"
    for old, new, words in (
        ('"A", "D", "B"]', '"A", "Q"]', "wrong.toml: E: datum Q is not among"),
        (
            '"position"\n  tolerance_mm = 0.001',
            '"positon"\n  tolerance_mm = 1.0',
            "'positon' is not",
        ),
        ('features = ["D", "E"]\nposition', 'features = ["D", "F"]\nposition', "no feature 'F'"),
    ):
        drawing.write_text(DRAWING.replace(old, new))
        text = run("measure", folder / "points.csv", "--drawing", drawing, "--part", PART,
                   code=2)  # fmt: skip
        assert words in text


def test_the_plan_of_another_system_is_a_drawing(folder: Path) -> None:
    plan = folder / "plan.dmi"
    plan.write_text(
        "UNITS/MM,ANGDEC\nF(bore1)=FEAT/CYLNDR,INNER,CART,12,12,10,0,0,1,12\n"
        "T(D)=TOL/DIAM,-0.02,0.02\nT(P)=TOL/POS,2D,0.05\nT(X)=TOL/CORTOL,XAXIS,0,1\n"
        "OUTPUT/FA(bore1),TA(D),TA(P),TA(X)\n"
    )
    text, warned = both_outputs("measure", folder / "points.csv", "--drawing", plan,
                                "--u-machine", 1)  # fmt: skip
    assert "conforms" in text
    assert "left out: T(X) of bore1: CORTOL is not read" in text + warned


def test_datums_from_outside_the_material(folder: Path) -> None:
    text = run("align", TOUCHES, "--part", PART, "--map", folder / "map.json", "--datum", "A=3",
               "--datum", "B=12,14", "--datum-association", "outside", "--verbose")  # fmt: skip
    assert "from outside the material" in text
    assert "the datums rest on plane" in text
