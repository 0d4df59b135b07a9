"""pretravel compensate: the same points in every format."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.compensation.compensation import apply
from pretravel.formats.logs.fusion import read_fusion
from pretravel.formats.logs.qif import read_point_sets
from pretravel.formats.touches_csv import read_touches
from tests.support.commands import positions, run
from tests.support.control_logs import (
    OWN_LOG,
    written,
)
from tests.support.examples import EXAMPLES


@pytest.fixture(scope="module")
def map_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("map") / "map.nc"
    run("qualify", EXAMPLES / "sphere_touches.csv", "--diameter", 24.9987, "--tip-diameter", 6,
        "-o", path)  # fmt: skip
    return path


class TestCompensatedPoints:
    @pytest.mark.parametrize("ending", ["parquet", "qif", "msr"])
    def test_same_points_in_every_format(self, tmp_path: Path, map_file: Path, ending: str) -> None:
        from pretravel.formats.map_file import read_map

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
            readings = read_fusion(out, "mm")
            # The evaluation by Fusion: the radius is subtracted along the nominal normal.
            found = readings.touches.positions - 3.0 * readings.touches.normals
        assert found == pytest.approx(expected.positions, abs=1e-12)

    def test_from_a_log_to_points(self, tmp_path: Path, map_file: Path) -> None:
        log = written(tmp_path, OWN_LOG, "a.log")
        run("compensate", log, "--map", map_file, "-o", tmp_path / "p.csv")
        assert positions(tmp_path / "p.csv").shape == (1, 3)
