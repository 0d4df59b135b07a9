"""pretravel qualify: kinds of map, errors."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.files.map_file import read_map
from tests.support.commands import both_outputs, rows, run
from tests.support.examples import PART, SPHERE
from tests.support.pictures import coloured_share
from tests.support.touches_of_days import day_of

SETUP = ("--diameter", 24.9987, "--tip-diameter", 6, "--kind", "harmonic")


def _with_a_false_trip(path: Path, *, labelled: bool) -> Path:
    """The example with its 17th touch 0.3 mm too far out; labels 101, 102, … where wanted."""
    header, *lines = SPHERE.read_text("utf-8").splitlines()
    cells = [[float(cell) for cell in line.split(",")] for line in lines]
    cells[16][:3] = [p + 0.3 * n for p, n in zip(cells[16][:3], cells[16][3:], strict=True)]
    table = [",".join(f"{cell:.7f}" for cell in row) for row in cells]
    if labelled:
        header = f"Nr,{header}"
        table = [f"{101 + i},{row}" for i, row in enumerate(table)]
    path.write_text("\n".join([header, *table]) + "\n", "utf-8")
    return path


class TestQualify:
    def test_physical_then_compensate(self, tmp_path: Path) -> None:
        text = run("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, "--kind",
                   "physical", "--verbose", "-o", tmp_path / "map.json")  # fmt: skip
        assert "Six-seat model" in text
        assert "shifts all points of a part alike" in " ".join(text.split())
        run("compensate", PART, "--map", tmp_path / "map.json", "-o", tmp_path / "points.csv")
        u = np.array([float(row["u_um"]) for row in rows(tmp_path / "points.csv")])
        assert len(u) == 140
        assert np.all((u > 0.3) & (u < 0.5))

    def test_wozniak(self, tmp_path: Path) -> None:
        text = run("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, "--kind",
                   "wozniak", "-o", tmp_path / "map.csv", "--plot",
                   tmp_path / "map.png", "--verbose")  # fmt: skip
        assert "lobes found at azimuth" in text
        assert coloured_share(tmp_path / "map.png") > 0.001

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            (["--kind", "magic"], "there are mean, sectors, wozniak, harmonic, physical, auto"),
            (["--kind", "wozniak", "--transducer", "laser"], "not one of 'contact', 'piezo'"),
            (
                ["--kind", "mean", "--lobe-azimuth", "30"],
                "only for wozniak or auto; leave it out (--lobe-azimuth",
            ),
        ],
    )
    def test_errors_teach(self, options: list[str], words: str) -> None:
        text = run("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, *options, code=2)
        assert words in text

    @pytest.mark.parametrize(
        ("labelled", "named", "wrong", "right", "noted"),
        [
            (False, "exclude it by its line, 18 (--exclude)", 17, 18, "line 18"),
            (True, "touch 117 (line 18) lies", 17, 117, "117"),
        ],
    )
    def test_a_false_trip_is_named_as_exclude_takes_it(
        self, tmp_path: Path, labelled: bool, named: str, wrong: int, right: int, noted: str
    ) -> None:
        """The running number, 17, is the line of the touch before."""
        path = _with_a_false_trip(tmp_path / "t.csv", labelled=labelled)
        assert named in run("qualify", path, *SETUP, code=2)
        assert "line 18) lies" in run("qualify", path, *SETUP, "--exclude", wrong, code=2)
        told = run("qualify", path, *SETUP, "--exclude", right)
        assert f"left out as requested: {noted}\n" in told

    @pytest.mark.long
    def test_the_feed_of_a_table_without_that_column(self, tmp_path: Path) -> None:
        first, accepted = tmp_path / "map.json", tmp_path / "new.json"
        run("qualify", SPHERE, *SETUP, "--feed", 120, "-o", first)
        assert read_map(first).feed == 120.0
        run("verify", day_of(tmp_path, 1), "--map", first, "--diameter", 24.9987, "--feed", 120,
            "--accept", accepted)  # fmt: skip
        assert read_map(accepted).feed == 120.0
        updated = tmp_path / "updated.json"
        run("qualify", SPHERE, *SETUP[:2], "--prior", first, "--feed", 120, "-o", updated)
        assert read_map(updated).feed == 120.0
        given = ("compensate", PART, "--map", first, "-o", tmp_path / "points.csv")
        assert "the touches do not (column feed_mm_min)" in both_outputs(*given)[1]
        assert both_outputs(*given, "--feed", 120)[1] == ""


def test_touches_on_two_references_are_not_one_sphere(tmp_path: Path) -> None:
    head, *lines = SPHERE.read_text().splitlines()
    for name, code in (("A", 0), ("B", 2)):
        rows = [f"{line},{'A' if row < 60 else name}" for row, line in enumerate(lines)]
        (tmp_path / "t.csv").write_text("\n".join([f"{head},reference", *rows]))
        told = run("qualify", tmp_path / "t.csv", "--diameter", 24.9987, "--kind", "mean",
                   "-o", tmp_path / "m.json", code=code)  # fmt: skip
    assert "of 2 references (column reference), A (60 touches) and B (15" in told


def test_an_axis_that_points_into_the_sphere_is_refused(tmp_path: Path) -> None:
    """Eight at each of 30, 60 and 90° from z, and the pole; at 60° the stylus would pass."""
    around = np.arange(8) * 0.25 * np.pi
    rings = [
        np.stack([np.sin(p) * np.cos(around), np.sin(p) * np.sin(around), np.cos(p) + 0 * around])
        for p in np.radians([30.0, 60.0, 90.0])
    ]
    normals = np.vstack([[[0.0, 0.0, 1.0]], np.hstack(rings).T])
    np.savetxt(tmp_path / "t.csv", np.hstack([15.48 * normals, normals]), delimiter=",",
               header="x_mm,y_mm,z_mm,nx,ny,nz", comments="")  # fmt: skip
    common = ("qualify", tmp_path / "t.csv", "--diameter", 25, "--tip-diameter", 6)
    run(*common, "--kind", "mean", "-o", tmp_path / "m.json")
    for kind in ("mean", "auto"):
        told = run(*common, "--axis", "0,0,-1", "--kind", kind, "-o", tmp_path / "m.json", code=2)
        assert "9 of 25 touches are on the side" in told
        assert "The opposite axis fits" in told
    _, warned = both_outputs("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6,
                             "--axis", "1,0,0", "--kind", "mean")  # fmt: skip
    assert "where a stylus along the probe axis would go through" in " ".join(warned.split())


def test_a_size_that_is_not_known_has_no_u(tmp_path: Path) -> None:
    told = run("qualify", SPHERE, "--unknown-size", "--u-diameter", 1, "--tip-diameter", 6,
               "-o", tmp_path / "m.json", code=2)  # fmt: skip
    assert "u diameter is not used with unknown size" in told
    told = run("qualify", SPHERE, "--reference", "s=sphere:24.9987:0.2", "--u-diameter", 1,
               "--tip-diameter", 6, "-o", tmp_path / "m.csv", code=2)  # fmt: skip
    assert "each reference gives its own" in told
