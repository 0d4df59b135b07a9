"""pretravel qualify --tip and compensate with the maps of several tips."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from pretravel.files.star_file import read_star
from pretravel.files.touches_csv import read_touches, write_touches
from pretravel.touches import Touches
from tests.support.commands import rows, run
from tests.support.examples import EXAMPLES

SPHERE = ("--diameter", 24.9987)
TIPS = ("--tip", "a=6", "--tip", "b=6", "--kind", "harmonic")
OFFSET = np.array([10.0, -20.0, 5.0])


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """One probe twice: as tip a, and as tip b with another offset. With what qualify said."""
    place = tmp_path_factory.mktemp("star")
    one = read_touches(EXAMPLES / "sphere_touches.csv")
    touches = Touches(
        np.vstack([one.positions, one.positions - OFFSET]),
        np.vstack([one.normals] * 2),
        tips=("a",) * len(one) + ("b",) * len(one),
    )
    write_touches(place / "star.csv", touches)
    bore = read_touches(EXAMPLES / "bore_touches.csv")
    tips = tuple("ab"[k % 2] for k in range(len(bore)))
    moved = np.array([tip == "b" for tip in tips])[:, None] * OFFSET
    write_touches(place / "bore.csv", Touches(bore.positions - moved, bore.normals, tips=tips))
    write_touches(place / "one.csv", Touches(bore.positions, bore.normals))
    said = run("qualify", place / "star.csv", *SPHERE, *TIPS, "-o", place / "star.json")
    return place, said


@pytest.fixture
def folder(made: tuple[Path, str]) -> Path:
    return made[0]


@pytest.mark.long
def test_the_tips_in_their_file(made: tuple[Path, str]) -> None:
    folder, said = made
    star = read_star(folder / "star.json")
    assert star.names == ("a", "b")
    assert np.allclose(star.offset("b"), OFFSET, atol=1e-9)
    of_points, place = (
        np.diag(star.offset_covariance("b", of_points=of_points)) for of_points in (True, False)
    )
    assert np.all(of_points < 1e-6)
    # Of a place, it is what each centre states for itself: two are twice one.
    alone = star.tip("a").alone + star.tip("b").alone
    assert place == pytest.approx(np.diag(alone))
    assert np.all(place >= of_points)
    assert said.startswith("2 tips, each with its map and its offset from a")


@pytest.mark.long
def test_points_of_both_tips_are_those_of_one(folder: Path) -> None:
    """The same touches as if one probe had made them; only their u contains the offset."""
    run("compensate", folder / "bore.csv", "--map", folder / "star.json", "-o", folder / "two.csv")
    run("qualify", EXAMPLES / "sphere_touches.csv", *SPHERE, "--tip-diameter", 6,
        "--kind", "harmonic", "-o", folder / "map.json")  # fmt: skip
    run("compensate", folder / "one.csv", "--map", folder / "map.json", "-o", folder / "one_p.csv")
    two, one = rows(folder / "two.csv"), rows(folder / "one_p.csv")
    for axis in "xyz":
        got, expected = ([float(row[f"{axis}_mm"]) for row in each] for each in (two, one))
        assert np.allclose(got, expected, atol=1e-6)
    assert float(two[1]["u_um"]) > float(one[1]["u_um"])
    assert float(two[0]["u_um"]) == pytest.approx(float(one[0]["u_um"]), rel=1e-6)
    centre = [float(cell) for cell in two[0]["shared_centre_of_tip_b_um"].strip("[]").split()]
    assert centre == [0.0] * len(centre)
    out = run("measure", folder / "two.csv", "--feature", "bore", "--select", "1..12")
    assert "diameter" in out


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("--tip", "a=x"), "a tip is NAME=DIAMETER@X,Y,Z"),
        # This was a traceback, and of two diameters of one tip the last one was taken.
        (("--tip", "a=4..5"), "a tip is NAME=DIAMETER@X,Y,Z"),
        ((*TIPS, "--tip", "a=5"), "the tip a is given twice"),
        (("--tip", "a=6"), "tip 'b'; there are a"),
        ((*TIPS, "--tip", "c=6"), "no touch was made with the tip c"),
        ((*TIPS, "--tip-diameter", 6), "--tip gives the diameter"),
        ((*TIPS, "-o", "map.csv"), "the ending must be .json"),
    ],
)
def test_refused(folder: Path, words: tuple[object, ...], reason: str) -> None:
    err = " ".join(run("qualify", folder / "star.csv", *SPHERE, *words, code=2).split())
    assert reason in err


def test_files_that_are_none(folder: Path) -> None:
    content = json.loads((folder / "star.json").read_text(encoding="utf-8"))
    content["tips"][0]["center_mm"] = [1.0]
    broken = folder / "broken.json"
    broken.write_text(json.dumps(content), encoding="utf-8")
    touches = folder / "bore.csv"
    err = run("compensate", touches, "--map", broken, "-o", folder / "x.csv", code=2)
    assert "numbers of shape (3,) are needed" in err
    content["tips"][1]["map"]["tip_radius_mm"] = 3.1
    content["tips"][0]["center_mm"] = [1.0, 2.0, 3.0]
    broken.write_text(json.dumps(content), encoding="utf-8")
    assert "tip b" in run("compensate", touches, "--map", broken, "-o", folder / "x.csv", code=2)
    one = run("export", folder / "star.json", "--to", "renishaw", "-o", folder / "x.nc", code=2)
    assert "has the maps of several tips" in one
    none = run("compensate", folder / "one.csv", "--map", folder / "star.json",
               "-o", folder / "x.csv", code=2)  # fmt: skip
    assert "a column tip is needed" in none
