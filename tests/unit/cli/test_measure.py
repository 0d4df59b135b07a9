"""pretravel measure: from touches of a part with two bores to verdicts."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import get_args

import numpy as np
import pytest

from pretravel.drawing.features.extreme_association import KINDS_BY_CRITERION
from pretravel.drawing.tasks.measure import Criterion
from pretravel.files.map_file import write_map
from pretravel.files.points_reading import read_points
from pretravel.files.points_writing import write_points
from pretravel.measurement.compensation import apply, embed
from pretravel.touches import Touches
from tests.support.commands import both_outputs, follow, rows, run
from tests.support.example_maps import example_map
from tests.support.examples import EXAMPLES
from tests.support.feature_points import around
from tests.support.results import data_of

DIAMETERS = {"bore1": 20.010, "bore2": 19.995}
"""True diameters of the part. [mm]"""
CENTRES = {"bore1": (40.0, 30.0, -5.0), "bore2": (-40.0, 30.0, -5.0)}


@pytest.fixture(scope="module", params=["csv", "nc"])
def points_file(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Touches by a probe whose true map is the fitted one, so that compensation is exact."""
    outward, _ = around(12)
    positions = [c + 0.5 * DIAMETERS[k] * outward for k, c in CENTRES.items()]
    labels = tuple(f"{name}-{i + 1}" for name in CENTRES for i in range(12))
    touches = embed(np.vstack(positions), np.tile(-outward, (2, 1)), example_map())
    touches = Touches(touches.positions, touches.normals, labels=labels)
    path = tmp_path_factory.mktemp("points") / f"points.{request.param}"
    write_points(path, apply(touches, example_map()))
    return path


def test_two_bores_and_their_verdicts(points_file: Path, tmp_path: Path) -> None:
    out = tmp_path / "bores.csv"
    text = run("measure", points_file, "--feature", "bore", "--group", "--nominal", 20,
               "--tolerance", "+0.021/0", "--u-machine", 1, "-o", out, code=3)  # fmt: skip
    assert text.startswith("1 does not conform (bore2: diameter), 1 of 2 conforms")
    found = {row["feature"]: row for row in rows(out) if row["quantity"] == "diameter"}
    for name, diameter in DIAMETERS.items():
        row = found[name]
        assert float(row["value"]) == pytest.approx(diameter, abs=1e-7)
        # The effective radius is smaller than that of the tip by 1 to 20 µm (an OMP40-2).
        assert 2e-3 < float(row["uncompensated"]) - diameter < 40e-3
        assert float(row["u"]) > 1e-3  # that of the machine alone
        # Nine residuals leave some doubt about the form of the bore; u is mostly the machine's.
        assert float(row["expanded_u"]) == pytest.approx(2.0 * float(row["u"]), rel=5e-3)
        # 95 % at one limit: JCGM 106.
        assert float(row["guard_band"]) == pytest.approx(1.6449 * float(row["u"]), rel=5e-3)
    assert found["bore1"]["verdict"] == "conforms"
    assert found["bore2"]["verdict"] == "does not conform"
    (apart,) = (row for row in rows(out) if row["quantity"] == "distance")
    assert (apart["feature"], apart["points"]) == ("bore1, bore2", "24")
    assert float(apart["value"]) == pytest.approx(80.0, abs=1e-7)  # of the centres


def test_features_that_the_labels_name(tmp_path: Path) -> None:
    """A plane among bores has no diameter; a bore at two heights is a cylinder; top is no word."""
    compensated = tmp_path / "points.csv"
    outward, _ = around(12)
    at_two_heights = 0.5 * 12.0 * outward + np.array([0.0, 0.0, -5.0])
    at_two_heights[::2, 2] = -9.0
    bore = 0.5 * DIAMETERS["bore1"] * outward + np.array(CENTRES["bore1"])
    flat = np.array([[x, y, 0.0] for x in (-9.0, 0.0, 9.0) for y in (-9.0, 9.0)])
    groups = {"bore1": (bore, -outward), "Bore2": (at_two_heights, -outward),
              "plane1": (flat, np.tile([0.0, 0.0, 1.0], (6, 1))),
              "top": (flat, np.tile([0.0, 0.0, 1.0], (6, 1)))}  # fmt: skip
    positions, normals = (np.vstack([each[k] for each in groups.values()]) for k in (0, 1))
    labels = tuple(
        f"{name}-{i + 1}" for name, (points, _) in groups.items() for i in range(len(points))
    )
    touches = replace(embed(positions, normals, example_map()), labels=labels)
    write_points(compensated, apply(touches, example_map()))
    out = tmp_path / "features.csv"
    _, said = both_outputs(
        "measure", compensated, "--feature", "by-label", "--tolerance", "20..20.02",
        "--u-machine", 1, "-o", out, code=3,
    )  # fmt: skip
    assert "not measured, because these labels begin with no kind of feature: top" in said
    found = [(row["feature"], row["quantity"], row["verdict"]) for row in rows(out)]
    assert ("bore1", "diameter", "conforms") in found
    assert ("Bore2", "diameter", "does not conform") in found
    assert {quantity for name, quantity, _ in found if name == "Bore2"} >= {"cylindricity"}
    assert {verdict for name, _, verdict in found if name == "plane1"} == {""}


def test_labels_that_are_numbers(tmp_path: Path) -> None:
    """Touches 1 to 9 of a floor, 10 to 21 of a bore: the second is chosen by its numbers."""
    outward, _ = around(12)
    floor = np.array([[x, y, 0.0] for x in (0.0, 50.0, 90.0) for y in (0.0, 30.0, 80.0)])
    positions = np.vstack([floor, CENTRES["bore1"] + 0.5 * DIAMETERS["bore1"] * outward])
    normals = np.vstack([np.tile([0.0, 0.0, 1.0], (9, 1)), -outward])
    touches = embed(positions, normals, example_map())
    touches = Touches(touches.positions, normals, labels=tuple(str(i + 1) for i in range(21)))
    path, out = tmp_path / "points.csv", tmp_path / "bore.csv"
    write_points(path, apply(touches, example_map()))
    run("measure", path, "--feature", "bore", "--select", "10..21", "-o", out)
    found = next(row for row in rows(out) if row["quantity"] == "diameter")
    assert float(found["value"]) == pytest.approx(DIAMETERS["bore1"], abs=1e-7)
    assert "10..20, 11 points" in run("measure", path, "--feature", "bore", "--select", "10..20")
    told = run("measure", path, "--feature", "bore", code=2)
    assert "All 21 points of the file were used" in told
    assert "--select" in told


@pytest.mark.parametrize(("limit", "fails"), [("20.000..", "bore2"), ("..20.000", "bore1")])
def test_one_limit_alone(points_file: Path, tmp_path: Path, limit: str, fails: str) -> None:
    """The diameters are 20.010 mm and 19.995 mm; five u at least from the limit."""
    out = tmp_path / "bores.csv"
    run("measure", points_file, "--feature", "bore", "--group", "--tolerance", limit,
        "--u-machine", 1, "-o", out, code=3)  # fmt: skip
    found = {row["feature"]: row for row in rows(out) if row["quantity"] == "diameter"}
    for name, row in found.items():
        assert row["verdict"] == ("does not conform" if name == fails else "conforms")
        assert (row["lower"] == "") == limit.startswith("..")
        assert (row["upper"] == "") == limit.endswith("..")


@pytest.mark.long
def test_position_form_page_and_picture(points_file: Path, tmp_path: Path) -> None:
    page, picture, values = (tmp_path / f"bore.{e}" for e in ("html", "png", "json"))
    command = ["measure", points_file, "--feature", "bore", "--select", "bore1*",
               "--at", "40,30,-5", "--position-tolerance", 0.02, "--form-tolerance", 0.005,
               "--tolerance", "20.012..20.03"]  # fmt: skip
    text = run(*command, "-o", page, "--plot", picture, "--verbose", code=3)
    assert "outside the tolerance (diameter: too small by 2.0 µm, can be reworked)" in text
    assert "tip radius" in text
    assert "Gaussian association" in text
    assert page.read_text(encoding="utf-8").count("<img") == 4
    assert picture.read_bytes().startswith(b"\x89PNG")
    run(*command, "-o", values, code=3)
    found = data_of(values)
    (bore,) = found["Features"]
    assert (bore["kind"], bore["side"]) == ("bore", "inside")
    assert 2.0 <= bore["coverage_factor"] < 2.1  # nine residuals without any form
    by_name = {row["quantity"]: row for row in found["Quantities"]}
    assert by_name["position"]["verdict"] == "within the tolerance, machine not in u"
    # Between the points a larger form is not seen.
    of_points = "within the tolerance at the touched points, machine not in u"
    assert by_name["roundness"]["verdict"] == of_points
    parts = [row["u"] for row in found["Sources"] if row["quantity"] == "diameter"]
    assert by_name["diameter"]["u"] == pytest.approx(np.linalg.norm(parts))
    # Across the axis of a bore there are two directions: a matrix of 2 x 2 (JCGM 102).
    assert len(found["Covariances of positions"]) == 4
    residuals = [row["residual_mm"] for row in found["Residuals"]]
    assert [row["label"] for row in found["Residuals"]] == [f"bore1-{i + 1}" for i in range(12)]
    assert np.ptp(residuals) == pytest.approx(by_name["measured range"]["value"], abs=1e-12)
    # A perfect bore: its form is a bound, and the range has no u of its own.
    assert by_name["roundness"]["interval_from_mm"] == 0.0
    assert by_name["measured range"]["u"] is None


@pytest.mark.long
def test_without_the_machine_nothing_conforms(points_file: Path, tmp_path: Path) -> None:
    """Neither the verdict nor any file says "conforms" where u contains the probing alone."""
    command = ["measure", points_file, "--feature", "bore", "--group", "--tolerance", "20..20.021"]
    page, table, values = (tmp_path / f"bores.{e}" for e in ("html", "csv", "json"))
    text, warned = both_outputs(*command, "-o", page, code=3)
    first = text.splitlines()[0]
    assert first.startswith(
        "1 outside the tolerance (bore2: diameter), 1 of 2 within the tolerance"
    )
    assert "not a statement of conformity" in first
    assert "give the u of the machine as well (geometry" in warned
    run(*command, "-o", table, code=3)
    run(*command, "-o", values, code=3)
    for said in (text, *(file.read_text(encoding="utf-8") for file in (page, table, values))):
        assert "conforms" not in said
        assert "not conform" not in said
    stated = run(*command, "--u-machine", 1, code=3).splitlines()[0]
    assert stated == "1 does not conform (bore2: diameter), 1 of 2 conforms"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--tolerance", "+0.02/0"], "need the nominal diameter.*--nominal"),
        (["--tolerance", "20..21", "--nominal", 20], "leave out the nominal diameter.*--nominal"),
        (["--nominal", 20], "the nominal diameter needs the deviations.*--nominal, --tolerance"),
        (["--probability", 0.95], "probability decides about a tolerance, and none is given"),
        (["--form-association", "gaussian", "--tolerance", "20..21"], "and none is given"),
        (["--tolerance", "21..20"], "--tolerance 21..20: this tolerance is empty"),
        (["--tolerance", "H7"], "expected limits as 20.000..20.021"),
        (["--tolerance", "20zc6"], "zc6 at 20 mm is not in the tables here"),
        (["--tolerance", ".."], "expected limits as 20.000..20.021"),
        (["--tolerance", "20..1e999"], "this tolerance is empty"),
        (["--tolerance", "1e999.."], "expected limits as 20.000..20.021"),
        (["--tolerance", "1e999/0", "--nominal", 20], "this tolerance is empty"),
        (["--select", "hole*"], "no label of the 24 points matches 'hole.'.*--select"),
        (["--select", "bore1*", "--position-tolerance", 0.1], "nominal position .--at"),
        (["--group", "--at", "0,0,0"], "nominal position is that of one feature, and there are 2"),
        (["--group", "--u-machine", "nan"], "--u-machine nan"),
        (["--group", "--tolerance", "20..nan"], "expected limits"),
        (["--group", "--form-tolerance", "nan"], "is empty|nan"),
        (["--select", "bore1-1"], "bore1-1: a circle needs at least 3 points"),
        ([], "points of two features"),
        (["--select", "bore1*", "--tolerance", "0.787..0.788"], r"look like inches \(20.0025 mm\)"),
        (["--select", "bore1*", "--tolerance", "20000..20021"], r"look like µm \(20.0105 mm\)"),
        (["--select", "bore1*", "--tolerance", "0..10"], "a size has no limit of zero"),
        (["--nominal", 20, "--tolerance", "+21/0"], "were 21 µm meant.* Give 0.021, in mm"),
        (["--select", "bore1*", "--form-tolerance", "5"], "tolerance of the form is 5 mm"),
        (["--select", "1..12"], "matches '1..12'.* Numbers choose labels that are numbers"),
        (["--select", "bore1*", "--at", "40,30"], "x,y,z, such as 0,0,1, and 2 came: also give"),
    ],
)
def test_messages(points_file: Path, arguments: list[object], message: str) -> None:
    text = run("measure", points_file, "--feature", "bore", *arguments, code=2)
    assert re.search(message, text.replace("\n", " ")), text


@pytest.mark.long
def test_the_guide(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every command of docs/how-to/measure-a-bore.md runs, with the verdicts of known bores."""
    guide = (EXAMPLES.parents[1] / "docs/how-to/measure-a-bore.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    verdicts = []
    for block in re.findall(r"```sh\n(.*?)```", guide, flags=re.DOTALL):
        for line in block.splitlines():
            # Exit code 3: one of the two bores is too small.
            text = follow(line, code=3 if "-o bores.csv" in line else 0)
            if line.startswith("pretravel measure"):
                verdicts.append(text.splitlines()[0])
    assert verdicts[0] in guide
    assert [verdict.partition(";")[0] for verdict in verdicts[:4]] == [
        "bore1*, 12 points: conforms (roundness at the touched points only)",
        "1 does not conform (bore2: diameter), 1 of 2 conforms",
        "boss1*, 12 points: conforms",
        "top*, 9 points: conforms",
    ]
    inscribed, tangent = verdicts[4:]
    assert inscribed.startswith("bore1* (inscribed), 12 points: diameter 20.00")
    assert tangent.startswith("top* (tangent), 9 points: flatness at the touched points at most")
    # A verdict on one value states it with its U.
    assert re.fullmatch(r".*; diameter \S+ mm, U = \S+ µm \(k = 2\)", verdicts[2])
    found = {r["feature"]: r for r in rows(Path("bores.csv")) if r["quantity"] == "diameter"}
    for name, diameter in DIAMETERS.items():
        # The noise of 0.3 µm of 12 touches and another kind of map: 1 µm of the diameter.
        assert float(found[name]["value"]) == pytest.approx(diameter, abs=1e-3)


def test_a_value_without_a_lower_bound_has_no_u(points_file: Path) -> None:
    """Errors of the points alone can explain it: its bounds are not the value plus and minus U."""
    x, y, z = CENTRES["bore1"]
    told = run("measure", points_file, "--feature", "bore", "--select", "bore1*", "--u-machine", 2,
               "--at", f"{x + 0.0025},{y},{z}", "--position-tolerance", 0.1, "--tolerance",
               "19.9..20.1")  # fmt: skip
    away = both_outputs("measure", points_file, "--feature", "bore", "--select", "bore1*",
                        "--at", f"{x + 90},{y},{z}", "--position-tolerance", 1, code=3)  # fmt: skip
    assert "bore1* lies 90.0 mm from its nominal position: are" in " ".join(away[1].split())
    assert "nominal position" not in told
    lines = {row.split()[2]: row for row in told.splitlines() if "✔" in row}
    assert re.search(r" 20\.\d+ mm +4(\.\d)? µm +2 +✔", lines["diameter"])
    assert re.search(r"0\.1 mm +0\.\d+, at most 0\.\d+ mm +✔", lines["position"])


@pytest.mark.parametrize(
    ("asked", "name"),
    [((), "measured range"), (("--form-tolerance", 0.005), "measured range, minimum-zone")],
)
def test_the_noise_subtracted_is_that_of_the_range_it_names(
    points_file: Path, asked: tuple[object, ...], name: str
) -> None:
    """The bore is round: all of the range is noise. The table gives 0.01 µm."""
    told = run("measure", points_file, "--feature", "bore", "--select", "bore1*", *asked,
               "--verbose")  # fmt: skip
    (measured,) = re.findall(rf"^bore1\* +{name} .*?(0\.\d+)(?: +[-+]\d\S*)?$", told, re.MULTILINE)
    (taken,) = re.findall(
        rf"noise subtracted (\S+) µm \(all of the {name}: the errors",
        " ".join(told.split()),
    )
    assert float(taken) == pytest.approx(1e3 * float(measured), abs=0.01)


def test_touches_are_no_points(tmp_path: Path) -> None:
    path = tmp_path / "touches.csv"
    path.write_text("x_mm,y_mm,z_mm,nx,ny,nz\n1,2,3,0,0,1\n")
    assert "Compensate them" in run("measure", path, "--feature", "bore", code=2)


def test_points_of_a_predicted_map_decide_nothing(tmp_path: Path) -> None:
    """The described probe is another one: the bore of 20.010 mm seems to be 20.032 mm."""
    points = tmp_path / "points.csv"
    run("compensate", EXAMPLES / "bore_touches.csv", "--map", "omp40-2", "--tip-diameter", 6,
        "-o", points)  # fmt: skip
    text = run("measure", points, "--feature", "bore", "--select", "bore1*",
               "--tolerance", "20..20.021", "--u-machine", 1, code=3)  # fmt: skip
    assert text.startswith("bore1*, 12 points: cannot be decided")


def test_points_of_an_older_version(tmp_path: Path) -> None:
    """Their correlation is not known: the largest uncertainty of a diameter is 2 u."""
    outward, _ = around(8)
    lines = ["label,x_mm,y_mm,z_mm,nx,ny,nz,pretravel_um,u_um"]
    for i, (x, y, _) in enumerate(outward):
        lines.append(f"{i},{10 * x:.9f},{10 * y:.9f},0,{-x:.12f},{-y:.12f},0,10,0.5")
    path, out = tmp_path / "old.csv", tmp_path / "out.csv"
    path.write_text("\n".join(lines) + "\n")
    run("measure", path, "--feature", "bore", "-o", out)
    (row,) = (row for row in rows(out) if row["quantity"] == "diameter")
    assert float(row["u"]) == pytest.approx(1e-3, rel=1e-6)
    assert float(row["uncompensated"]) == pytest.approx(20.02, abs=1e-6)


def _tilted_plane(tmp_path: Path) -> Path:
    """Points of a plane that is tilted by 3:4 in the x–z plane, one of them 3 µm outside."""
    normal, along = np.array([0.6, 0.0, 0.8]), np.array([0.8, 0.0, -0.6])
    grid = [(u, v) for u in (-20.0, 0.0, 20.0) for v in (-15.0, 0.0, 15.0)]
    places = np.array([u * along + [0.0, v, 0.0] for u, v in grid])
    places[4] += 0.003 * normal
    lines = [",".join(map(str, (f"top-{i + 1}", *p, *normal, 0.2))) for i, p in enumerate(places)]
    path = tmp_path / "plane.csv"
    path.write_text("label,x_mm,y_mm,z_mm,nx,ny,nz,u_um\n" + "\n".join(lines) + "\n")
    return path


def test_the_report_shows_the_normal_of_a_plane(tmp_path: Path) -> None:
    """Not its uncertainty alone; and no empty columns of angles beside it."""
    text = run("measure", _tilted_plane(tmp_path), "--feature", "plane")
    row = next(line.split() for line in text.splitlines() if "normal" in line.split())
    assert [float(cell) for cell in row[-4:-1]] == [0.6, 0.0, 0.8]
    head = next(line for line in text.splitlines() if "direction" in line)
    assert head.split() == ["feature", "direction", "x", "y", "z", "u/°"]


def test_the_axis_of_a_cone_stands_beside_its_angle(tmp_path: Path) -> None:
    turn = np.linspace(0.0, 2.0 * np.pi, 8, endpoint=False)
    ring = np.c_[np.cos(turn), np.sin(turn), np.zeros(8)]
    slope = np.c_[0.8 * ring[:, :2], np.full(8, -0.6)]  # half angle asin 0.6
    places = np.vstack([(10.0 + 0.75 * z) * ring + [0, 0, z] for z in (0.0, 8.0)])
    rows_of = np.c_[places, np.tile(slope, (2, 1)), np.full(16, 0.2)]
    path = tmp_path / "cone.csv"
    np.savetxt(path, rows_of, "%.9f", ",", header="x_mm,y_mm,z_mm,nx,ny,nz,u_um", comments="")
    text = run("measure", path, "--feature", "cone", "--axis", "0,0,1")
    axis = next(line.split() for line in text.splitlines() if "axis" in line.split())
    assert [float(cell) for cell in axis[-4:-1]] == pytest.approx([0.0, 0.0, 1.0], abs=1e-6)
    assert any("half angle" in line and "36.8699" in line for line in text.splitlines())


def test_residuals_are_a_table(tmp_path: Path) -> None:
    """Eight points on a plane and one 3 µm out: least squares leave 8/9 of it at the middle."""
    out = tmp_path / "residuals.csv"
    run("measure", _tilted_plane(tmp_path), "--feature", "plane", "--group", "--residuals", out)
    found = rows(out)
    assert [row["label"] for row in found[:2]] == ["top-1", "top-2"]
    assert {row["feature"] for row in found} == {"top"}
    assert float(found[4]["residual_um"]) == pytest.approx(3.0 * 8 / 9, abs=1e-6)
    assert float(found[0]["residual_um"]) == pytest.approx(-3.0 / 9, abs=1e-6)
    assert float(found[4]["x_mm"]) == pytest.approx(0.6 * 0.003, abs=1e-9)


def test_the_inscribed_circle_of_a_dented_bore(points_file: Path, tmp_path: Path) -> None:
    """A pin touches a burr that least squares average out; the report says on what it rests."""
    points = read_points(points_file)
    positions = points.positions.copy()
    positions[points.labels.index("bore1-1"), 0] -= 0.02  # at the angle 0, towards the axis
    others = [i for i, label in enumerate(points.labels) if label != "bore1-7"]  # opposite to it
    path, out, values = (tmp_path / name for name in ("burr.csv", "out.csv", "out.json"))
    write_points(path, replace(points, positions=positions)[others])
    command = ["measure", path, "--feature", "bore", "--select", "bore1*", "--tolerance", "20.."]
    shown = run(*command, "--association", "inscribed", "--u-machine", 1, "-o", out, code=3)
    assert shown.startswith("bore1* (inscribed), 11 points: does not conform")
    run(*command, "--association", "inscribed", "--u-machine", 1, "-o", values, code=3)
    (feature,) = data_of(values)["Features"]
    assert feature["association"] == "inscribed"
    # On the burr and on the two places opposite that are nearest to its ray: 150° and 210°.
    assert feature["carrying_points"] == "bore1-1 bore1-6 bore1-8"
    found = {row["quantity"]: row for row in rows(out)}
    assert {row["association"] for row in found.values()} == {"inscribed"}
    # The circle through (r − 20 µm, 0) and (−r cos 30°, ± r sin 30°): its centre is on x.
    a = 0.5 * DIAMETERS["bore1"] - 0.02
    b = -0.5 * DIAMETERS["bore1"] * np.cos(np.pi / 6)
    c = 0.5 * DIAMETERS["bore1"] * np.sin(np.pi / 6)
    centre = (a**2 - b**2 - c**2) / (2.0 * (a - b))
    assert float(found["diameter"]["value"]) == pytest.approx(2.0 * (a - centre), abs=1e-6)
    assert "measured range, inscribed" in found


def test_the_association_of_each_feature_of_a_file(points_file: Path, tmp_path: Path) -> None:
    features, out = tmp_path / "features.toml", tmp_path / "out.csv"
    text = '[[feature]]\nkind = "bore"\nselect = "bore1*"\nassociation = "circumscribed"\n'
    text += '[[feature]]\nkind = "bore"\nselect = "bore2*"\n'
    features.write_text(text)
    run("measure", points_file, "--drawing", features, "-o", out)
    found = {(row["feature"], row["quantity"]): row["association"] for row in rows(out)}
    assert found["bore1*", "diameter"] == "circumscribed"
    assert found["bore2*", "diameter"] == "gaussian"
    assert found["bore1*, bore2*", "distance"] == "circumscribed, gaussian"
    run("measure", points_file, "--drawing", features, "--association", "minimum-zone", "-o", out)
    assert {row["association"] for row in rows(out) if row["feature"] == "bore2*"} == {
        "minimum-zone"
    }
    features.write_text(text.replace('"bore"\nselect = "bore2*"', '"line"\nselect = "bore2*"')
                        + 'association = "inscribed"\n')  # fmt: skip
    told = run("measure", points_file, "--drawing", features, code=2)
    assert "line 5" in told
    assert "a line has no association 'inscribed', which is for circle, bore" in told
    assert "--association" not in told


@pytest.mark.parametrize(
    ("limits", "nominal", "message"),
    [
        ("20.0..20.02", 20, ""),
        ("20.0..20.02", 21, "bore1: the nominal value is 21 mm, and the limits are 20 to 20.02 mm"),
        ("+0.02/0", 0.7875, r"look like inches \(20.2565 mm"),
    ],
)
def test_a_drawing_that_contradicts_itself_or_the_part_in_its_unit(
    points_file: Path, tmp_path: Path, limits: str, nominal: float, message: str
) -> None:
    features = tmp_path / "features.toml"
    features.write_text(
        '[[feature]]\nlabel = "bore1"\nkind = "bore"\nselect = "bore1*"\n'
        f'tolerance = "{limits}"\nnominal_mm = {nominal}\n'
    )
    told = run("measure", points_file, "--drawing", features, code=2 if message else 0)
    assert re.search(message, told), told


@pytest.mark.long
@pytest.mark.parametrize("ending", ["csv", "nc", "json", "parquet"])
def test_points_state_their_map_and_one_that_changed_is_named(ending: str, tmp_path: Path) -> None:
    points, made = tmp_path / f"points.{ending}", tmp_path / "map.json"
    bore = ("measure", points, "--feature", "bore", "--select", "bore1*")
    write_map(made, example_map())
    touches = ("compensate", EXAMPLES / "bore_touches.csv", "--map", made)
    run(*touches, "-o", points)
    stated = read_points(points).map_used
    assert re.fullmatch("map.json [0-9a-f]{12}", stated)
    assert "has changed since" not in "".join(both_outputs(*bore))
    write_map(made, replace(example_map(), coefficients=0.9 * example_map().coefficients))
    assert f"({stated[-12:]}, now" in "".join(both_outputs(*bore))
    made.unlink()
    assert "has changed since" not in "".join(both_outputs(*bore))


def test_points_of_two_maps_are_named(tmp_path: Path) -> None:
    write_map(tmp_path / "map.json", example_map())
    points = tmp_path / "points.csv"
    run("compensate", EXAMPLES / "bore_touches.csv", "--map", tmp_path / "map.json", "-o", points)
    lines = points.read_text().splitlines()
    points.write_text("\n".join([*lines[:-1], lines[-1].replace("map.json", "old.json")]))
    assert read_points(points).shared is None
    bore = ("measure", points, "--feature", "bore", "--select", "bore1*")
    assert "compensated with 2 maps: map.json" in "".join(both_outputs(*bore))
    assert "have no series 2 to choose" in run(*bore, "--series", 2, code=2)
    points.write_text("\n".join([*lines[:-1], lines[-1].rpartition(",")[0] + ","]))
    assert read_points(points).map_used.endswith(" | not stated")


def test_the_words_of_the_option_are_those_of_the_library() -> None:
    assert get_args(Criterion) == tuple(KINDS_BY_CRITERION)
