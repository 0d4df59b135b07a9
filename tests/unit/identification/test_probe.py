"""A description from a map: undetermined numbers, and probes of another kind."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from pretravel.formats.map_file import read_map
from pretravel.identification.probe_from_map import identify
from pretravel.probe.catalogue import load_probe
from pretravel.uncertainty.covariance import Covariance
from tests.support.commands import run
from tests.support.example_maps import example_map


def test_what_the_map_does_not_determine(tmp_path: Path) -> None:
    run("predict", "omp40-2", "--azimuth", "0:350:10", "--polar", "0:90:10",
        "-o", tmp_path / "map.nc")  # fmt: skip
    found = identify(
        read_map(tmp_path / "map.nc"), load_probe("omp40-2"), ["lever", "tripod_radius"]
    )
    assert any("undone by" in sentence for sentence in found.unknown)


def test_a_probe_of_another_kind_widens_u() -> None:
    """Woźniak's lobes, which no six-seat probe has, are reported; u has the size of the misfit."""
    made = example_map("wozniak")
    sharp = replace(made, covariance=Covariance.full(1e-4 * made.covariance.matrix))
    found = identify(sharp, load_probe("omp40-2-100mm"), ["rotation", "stem_diameter"])
    assert any("another kind" in sentence for sentence in found.unknown)
    true = identify(
        example_map("physical"), load_probe("omp40-2-100mm"), ["rotation", "stem_diameter"]
    )
    off = np.abs(found.values - true.values)
    assert np.all(off < 4.0 * found.standard_uncertainty + 4.0 * true.standard_uncertainty)
