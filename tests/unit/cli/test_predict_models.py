"""pretravel predict with the models of other papers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.support.commands import rows, run


class TestPredict:
    @pytest.mark.parametrize("model", ["ren", "wozniak"])
    def test_models_of_the_other_papers(self, tmp_path: Path, model: str) -> None:
        run("predict", "omp40-2", "--model", model, "--azimuth", "0:350:10", "--polar", "90",
            "-o", tmp_path / "map.csv")  # fmt: skip
        found = rows(tmp_path / "map.csv")
        shares = [name for name in found[0] if name.startswith("share_")]
        for row in found:
            total = sum(float(row[name]) for name in shares)
            assert total == pytest.approx(float(row["pretravel_um"]), abs=1e-9)
        value = np.array([float(row["pretravel_um"]) for row in found])
        assert value.argmax() % 12 == 6  # opposite a rod
