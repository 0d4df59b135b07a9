"""pretravel probes: lists, prints, draws, checks."""

from __future__ import annotations

from pathlib import Path

from tests.support.commands import run


def test_probes_lists_and_prints() -> None:
    assert "omp40-2-100mm" in run("probes")
    assert run("probes", "omp40-2").startswith("name = ")
    assert "neither a probe of the catalogue" in run("probes", "tp20", code=2)


def test_probes_draws_and_checks(tmp_path: Path) -> None:
    mine, picture = tmp_path / "mine.toml", tmp_path / "probe.png"
    mine.write_text(run("probes", "omp40-2"))
    assert "a valid description" in run("probes", mine, "--plot", picture)
    assert picture.read_bytes()[:4] == b"\x89PNG"
    assert "plot is only for probe" in run("probes", "--plot", picture, code=2)
