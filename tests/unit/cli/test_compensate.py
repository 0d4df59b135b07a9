"""pretravel compensate: the same points in every format."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest
from scipy.special import stdtrit

from pretravel.base.directions import five_point_pattern
from pretravel.files.csv_table import write_csv_table
from pretravel.files.logs.fusion import read_fusion
from pretravel.files.logs.qif import read_point_sets
from pretravel.files.map_file import read_map
from pretravel.files.points_reading import read_points
from pretravel.files.source_file import SourceFile
from pretravel.files.touches_csv import read_touches, touches_table
from pretravel.measurement.compensation import apply
from pretravel.touches import Touches
from tests.support.commands import both_outputs, positions, rows, run
from tests.support.control_logs import (
    OWN_LOG,
    written,
)
from tests.support.examples import EXAMPLES, PART, SPHERE


@pytest.fixture(scope="module")
def map_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("map") / "map.json"
    run("qualify", EXAMPLES / "sphere_touches.csv", "--diameter", 24.9987, "--tip-diameter", 6,
        "--kind", "harmonic", "-o", path)  # fmt: skip
    return path


class TestCompensatedPoints:
    @pytest.mark.parametrize("ending", ["parquet", "qif", "msr"])
    def test_same_points_in_every_format(self, tmp_path: Path, map_file: Path, ending: str) -> None:

        source = EXAMPLES / "part_touches.csv"
        out = tmp_path / f"points.{ending}"
        run("compensate", source, "--map", map_file, "-o", out)
        expected = apply(read_touches(source), read_map(map_file))
        if ending == "parquet":
            import pyarrow.parquet as pq

            table = pq.read_table(str(out))
            found = np.array([table[f"{a}_mm"].to_pylist() for a in "xyz"]).T
        elif ending == "qif":
            (points,) = read_point_sets(out)
            assert all(points.compensated)
            found = points.points
        else:
            text = out.read_text(encoding="utf-8").replace("; PRETRAVEL COMPENSATED\n", "")
            readings = read_fusion(SourceFile("points.msr", text.encode()), "mm")
            # Fusion passes the comment over, and subtracts the radius along the nominal normal.
            found = readings.touches.positions - 3.0 * readings.touches.normals
        assert found == pytest.approx(expected.positions, abs=1e-12)

    def test_the_verdict_has_the_k_of_the_budget(self, tmp_path: Path) -> None:
        """A map of five touches has one degree of freedom: k = 13.97 of Student's t, not 2."""
        touches = five_point_pattern() * (15.5 - np.array([4.0, 5.2, 5.5, 4.6, 1.1]) / 1e3)[:, None]
        five = Touches(touches, five_point_pattern())
        write_csv_table(tmp_path / "five.csv", touches_table(five))
        run("qualify", tmp_path / "five.csv", "--diameter", 25, "--tip-diameter", 6, "--kind",
            "wozniak", "--transducer", "piezo", "-o", tmp_path / "map.json")  # fmt: skip
        part = EXAMPLES / "part_touches.csv"
        told = run("compensate", part, "--map", tmp_path / "map.json", "--extrapolate",
                   "--verbose", "-o", tmp_path / "p.csv")  # fmt: skip
        u = max(float(row["u_um"]) for row in rows(tmp_path / "p.csv"))
        student = stdtrit(1.0, 0.5 + 0.5 * math.erf(math.sqrt(2.0)))
        words = re.search(r"U of a point up to ([\d.]+) µm \(k = ([\d.]+)\)", told)
        assert words is not None
        assert float(words[2]) == pytest.approx(student, rel=0.02)  # a little of known sources
        assert float(words[1]) == pytest.approx(float(words[2]) * u, rel=5e-3)  # three digits
        assert f"k {words[2]}" in told

    def test_from_a_log_to_points(self, tmp_path: Path, map_file: Path) -> None:
        log = written(tmp_path, OWN_LOG, "a.log")
        run("compensate", log, "--map", map_file, "-o", tmp_path / "p.csv")
        assert positions(tmp_path / "p.csv").shape == (1, 3)


def test_normals_from_neighbouring_touches(tmp_path: Path, map_file: Path) -> None:
    """A free form, 4 mm between touches: the points with normals lie within U, and it is said."""
    source, bare = EXAMPLES / "part_touches.csv", tmp_path / "bare.csv"
    touched = rows(source)
    names = ("x_mm", "y_mm", "z_mm")
    lines = [",".join(names), *(",".join(row[name] for name in names) for row in touched)]
    bare.write_text("\n".join(lines) + "\n")
    run("compensate", source, "--map", map_file, "-o", tmp_path / "with.csv")
    _, warned = both_outputs("compensate", bare, "--map", map_file, "--feature", "surface",
                             "-o", tmp_path / "without.csv")  # fmt: skip
    assert "the normals of the neighbouring touches (z > 0) are used" in warned
    assert "which is in the covariance of the points" in warned
    assert "touches are doubtful" in warned
    found = read_points(tmp_path / "without.csv")
    apart = found.positions - read_points(tmp_path / "with.csv").positions
    along = np.abs(np.sum(apart * found.normals, axis=1))
    assert np.mean(along <= 2.0 * found.standard_uncertainty) > 0.9


class TestNormalsOutsideTheMap:
    """What a newcomer typed: directions of travel in place of normals, and then --extrapolate."""

    @pytest.mark.long
    def test_turned_normals_are_named_and_lost_triggers_refused(self, tmp_path: Path) -> None:
        saved, points = tmp_path / "map.json", tmp_path / "points.csv"
        run("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, "-o", saved)
        touches = read_touches(PART)
        turned = tmp_path / "turned.csv"
        columns = ["x_mm,y_mm,z_mm,nx,ny,nz"]
        columns += [
            ",".join(f"{value:.9f}" for value in (*position, *-normal))
            for position, normal in zip(touches.positions, touches.normals, strict=True)
        ]
        turned.write_text("\n".join(columns) + "\n")
        told = run("compensate", turned, "--map", saved, "-o", points, code=2)
        assert "their opposites lie inside" in told
        assert "--columns" in told
        # A normal along -z pulls at the stylus: the probe does not trigger.
        down = tmp_path / "down.csv"
        down.write_text("x_mm,y_mm,z_mm,nx,ny,nz\n0,0,0,0,0,-1\n0,0,0,1,0,0\n")
        told = run("compensate", down, "--map", saved, "--extrapolate", "-o", points, code=2)
        assert "the probe of this map does not trigger" in told
        slanted = tmp_path / "slanted.csv"
        slanted.write_text("x_mm,y_mm,z_mm,nx,ny,nz\n0,0,0,0.8,0,-0.6\n0,0,0,1,0,0\n")
        _, told = both_outputs("compensate", slanted, "--map", saved, "--extrapolate", "-o", points)
        assert "1 of 2 normals lie outside the map" in told
