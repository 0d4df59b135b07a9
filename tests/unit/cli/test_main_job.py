"""Qualify, then compensate: files, refusals, warnings, pages; inputs are not overwritten."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy.optimize import least_squares
from typer.testing import CliRunner

from pretravel.cli import main
from pretravel.files.touches_csv import read_touches
from tests.support.commands import rows, run
from tests.support.examples import PART, SPHERE


def _share_of_sector(normals: np.ndarray, twelfth: int) -> np.ndarray:
    """One within 15° of the sector's angle, a half at its ends, zero elsewhere."""
    azimuth = np.degrees(np.arctan2(normals[:, 1], normals[:, 0]))
    off = np.abs((azimuth / 30.0 - twelfth + 6.0) % 12.0 - 6.0)
    return np.where(np.abs(off - 0.5) < 1e-6, 0.5, np.where(off < 0.5, 1.0, 0.0))


class TestMainJob:
    @pytest.mark.long
    def test_qualify_then_compensate(self, tmp_path: Path) -> None:
        saved, points = tmp_path / "map.json", tmp_path / "points.csv"
        text = run("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, "-o", saved,
                   "--plot", tmp_path / "q.png")  # fmt: skip
        assert "The probe is good: a touch repeats to 0.32 µm" in text
        assert "OUTLIER" not in text
        run("compensate", PART, "--map", saved, "-o", points, "--plot", tmp_path / "p.png")
        table = rows(points)
        names = list(table[0])
        assert names[:10] == [
            "label", "x_mm", "y_mm", "z_mm", "nx", "ny", "nz", "pretravel_um", "u_um",
            "deviation_um",
        ]  # fmt: skip
        assert all(name.startswith(("uncompensated_", "shared_")) for name in names[10:-1])
        assert names[-1] == "map"
        assert {row["map"].partition(" ")[0] for row in table} == {"map.json"}
        assert len(table) == 140
        part = rows(PART)
        for given, found in zip(part, table, strict=True):
            normal = np.array([float(given[k]) for k in ("nx", "ny", "nz")])
            reading = np.array([float(given[k]) for k in ("x_mm", "y_mm", "z_mm")])
            point = np.array([float(found[k]) for k in ("x_mm", "y_mm", "z_mm")])
            # Equation 3.36, by hand; 1e-7: normals are given with seven decimals.
            expected = reading - (3.0 - float(found["pretravel_um"]) * 1e-3) * normal
            assert np.allclose(point, expected, atol=1e-6)
        for picture in ("q.png", "p.png"):
            assert (tmp_path / picture).read_bytes()[:4] == b"\x89PNG"

    @pytest.mark.long
    @pytest.mark.parametrize("kind", ["mean", "sectors"])
    def test_other_kinds(self, kind: str, tmp_path: Path) -> None:
        saved = tmp_path / "map.json"
        run("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, "--kind", kind, "-o",
            saved)  # fmt: skip
        run("compensate", PART, "--map", saved, "-o", tmp_path / "points.nc")
        part, sphere = read_touches(PART), read_touches(SPHERE)
        with xr.open_dataset(tmp_path / "points.nc", engine="h5netcdf") as points:
            pretravel, found = points["pretravel"].to_numpy(), points["position"].to_numpy()
        # Equation 3.36 with the approach against the normal.
        by_hand = part.positions - (3.0 - pretravel[:, None]) * part.normals
        assert found == pytest.approx(by_hand, abs=1e-9)

        # The sphere by least squares; what its radius lacks is the mean pretravel.
        def distances(x: np.ndarray) -> np.ndarray:
            return np.asarray(np.linalg.norm(sphere.positions - x[:3], axis=1) - x[3])

        start = [*sphere.positions.mean(axis=0), 15.0]
        *center, radius = least_squares(distances, start, xtol=1e-15, ftol=1e-15, gtol=1e-15).x
        mean = 0.5 * 24.9987 + 3.0 - radius
        if kind == "mean":
            assert pretravel == pytest.approx(np.full(140, mean), abs=1e-9)
            return
        # A table of ten radii: the mean of the touches within 30° of the equator that lie in a
        # sector of 30°, half of those between two; opposite sectors of X and of Y together.
        of_touches = mean - distances(np.array([*center, radius]))
        near = sphere.normals[:, 2] < 0.5 + 1e-6
        expected = np.full(len(part), np.nan)
        for twelfths in ((0, 6), (3, 9), *((k,) for k in (1, 2, 4, 5, 7, 8, 10, 11))):
            weight = sum(_share_of_sector(sphere.normals, twelfth) for twelfth in twelfths) * near
            inside = sum(_share_of_sector(part.normals, twelfth) for twelfth in twelfths) == 1.0
            expected[inside] = np.average(of_touches, weights=weight)
        # Along the axis there is no azimuth, and between two sectors the table has two values.
        told = np.isfinite(expected) & (part.normals[:, 2] < 0.99)
        assert np.count_nonzero(told) > 50
        assert pretravel[told] == pytest.approx(expected[told], abs=1e-9)

    @pytest.mark.long
    def test_without_a_tip_diameter_points_are_the_same_but_for_the_height(
        self, tmp_path: Path
    ) -> None:
        """The mean pretravel is unknown then, and so are the axial gauge and the usual size of the
        lobes, which is a share of the mean: less than the noise of a touch, 0.3 µm."""
        found = []
        for extra in (["--tip-diameter", 6, "--axial-pretravel", "none"], []):
            run("qualify", SPHERE, "--diameter", 24.9987, *extra, "--kind", "harmonic", "-o",
                tmp_path / "map.json")  # fmt: skip
            run("compensate", PART, "--map", tmp_path / "map.json", "-o", tmp_path / "points.csv")
            found.append(
                [
                    [float(r[k]) for k in ("x_mm", "y_mm", "z_mm")]
                    for r in rows(tmp_path / "points.csv")
                ]
            )
        assert np.allclose(found[0], found[1], rtol=0.0, atol=0.3e-3)

    def test_refuses_directions_outside(self, tmp_path: Path) -> None:
        lines = SPHERE.read_text().splitlines()
        upper = [lines[0], *(line for line in lines[1:] if float(line.split(",")[5]) > 0.5)]
        (tmp_path / "upper.csv").write_text("\n".join(upper))
        saved = tmp_path / "map.json"
        run("qualify", tmp_path / "upper.csv", "--diameter", 24.9987, "--kind", "mean", "-o",
            saved)  # fmt: skip
        message = run("compensate", SPHERE, "--map", saved, "-o", tmp_path / "p.csv", code=2)
        assert "lie outside the map" in message
        assert not (tmp_path / "p.csv").exists()
        run("compensate", SPHERE, "--map", saved, "-o", tmp_path / "p.csv", "--extrapolate")

    def test_warns_of_another_feed(self, tmp_path: Path) -> None:
        for name, feed in (("slow.csv", 50), ("fast.csv", 500)):
            lines = SPHERE.read_text().splitlines()
            text = "\n".join([f"{lines[0]},feed_mm_min", *(f"{v},{feed}" for v in lines[1:])])
            (tmp_path / name).write_text(text)
        saved, points = tmp_path / "map.json", tmp_path / "points.csv"
        run("qualify", tmp_path / "slow.csv", "--diameter", 24.9987, "--kind", "mean", "-o",
            saved)  # fmt: skip
        result = CliRunner().invoke(
            main.app,
            ["compensate", str(tmp_path / "fast.csv"), "--map", str(saved), "-o", str(points)],
        )
        assert result.exit_code == 0
        assert "50 mm/min" in result.stderr


@pytest.mark.long
def test_pages(tmp_path: Path) -> None:
    """The page is one file that contains the numbers and a picture."""
    saved = tmp_path / "map.json"
    options = ["--diameter", 24.9987, "--tip-diameter", 6, "--kind", "harmonic"]
    run("qualify", SPHERE, *options, "-o", saved)
    pages = {
        "q.html": (["qualify", SPHERE, *options], "repeatability"),
        "c.html": (["compensate", PART, "--map", saved], "140 points"),
        "p.html": (["predict", "omp40-2"], "trigger force"),
    }
    for name, (arguments, words) in pages.items():
        run(*arguments, "-o", tmp_path / name)
        page = (tmp_path / name).read_text()
        assert words in page
        assert "data:image/" in page


class TestFilesAreSafe:
    def test_inputs_are_not_overwritten(self, tmp_path: Path) -> None:
        own = tmp_path / "own.csv"
        own.write_bytes(SPHERE.read_bytes())
        saved = tmp_path / "map.json"
        run("qualify", own, "--diameter", 24.9987, "--kind", "mean", "-o", saved)
        for arguments in (
            ["qualify", own, "--diameter", 24.9987, "-o", own],
            ["compensate", own, "--map", saved, "-o", own],
            ["compensate", own, "--map", saved, "-o", saved],
        ):
            assert "would be overwritten" in run(*arguments, code=2)
        assert own.read_bytes() == SPHERE.read_bytes()

    def test_a_bad_picture_stops_before_the_map_is_written(self, tmp_path: Path) -> None:
        saved = tmp_path / "map.json"
        arguments = ["--diameter", 24.9987, "-o", saved, "--plot", tmp_path / "picture.bmp"]
        assert "picture.bmp" in run("qualify", SPHERE, *arguments, code=2)
        assert not saved.exists()

    @pytest.mark.parametrize(
        "extra",
        [
            ["--u-diameter", "nan"],
            ["--u-diameter", "-1"],
            ["--axial-pretravel", "1e9"],
            ["--axial-pretravel", "nan"],
            ["--axis", "nan,0,1"],
            ["--axis", "0,0"],
            ["--kind", "magic"],
        ],
    )
    def test_nonsense_options(self, extra: list[str]) -> None:
        message = run("qualify", SPHERE, "--diameter", 24.9987, *extra, code=2)
        assert extra[1] in message

    def test_inches_in_compensate_are_warned_of(self, tmp_path: Path) -> None:
        head, *lines = PART.read_text().splitlines()
        inches = [head]
        for line in lines:
            values = [float(cell) for cell in line.split(",")]
            inches.append(
                ",".join(str(v if 3 <= i < 6 else v / 25.4) for i, v in enumerate(values))
            )
        (tmp_path / "inches.csv").write_text("\n".join(inches))
        saved, points = tmp_path / "map.json", tmp_path / "points.csv"
        run("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, "--kind", "mean",
            "-o", saved)  # fmt: skip
        arguments = ["compensate", tmp_path / "inches.csv", "--map", saved, "-o", points]
        result = CliRunner().invoke(main.app, [str(a) for a in arguments])
        assert "of the size of the tip radius" in result.stderr
