"""M. Rodrigues, An Accurate On-Machine Surfaces Measurement Using FEA Method, Concordia 2021.

Figures from Tables 2.3 and 4.1 to 4.9 (reference/*.csv). "Existing method" is Shen & Zhang
1997: six-seat statics and one cantilever.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import from_angles
from pretravel.base.units import delay_travel
from pretravel.design.studies.definition import load_study
from pretravel.design.studies.run import Workers, run_study
from pretravel.files.csv_table import CsvTable, read_csv_table
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.trigger import Trigger, predict

REFERENCE = Path(__file__).parent / "reference"


@pytest.fixture(scope="module")
def tables() -> CsvTable:
    """Tables 4.1 to 4.9, 63 directions."""
    table = read_csv_table(REFERENCE / "rodrigues_trigger_50mm.csv")
    assert len(table) == 63
    return table


def _predicted(tables: CsvTable, lever: float, model: str) -> Trigger:
    polar, azimuth = np.radians(tables.numbers("polar_deg", "azimuth_deg")).T
    probe = load_probe("omp40-2").with_lever(lever)
    return predict(probe, from_angles(polar, azimuth), model)


def _row(tables: CsvTable, polar: int, azimuth: int) -> int:
    angles = tables.numbers("polar_deg", "azimuth_deg")
    return int(np.flatnonzero((angles == (polar, azimuth)).all(axis=1))[0])


@pytest.mark.published(
    "Rodrigues 2021", "Tables 4.1 to 4.9",
    what="63 forces and distances, twice",
    ours="0.6 % (existing), 0.8 % (elements); distances 0.15 µm, −1.7 to +3.7 %",
    theirs="printed to 0.01 N, 0.1 µm",
    verdict="agrees; one misprint (1.44 N), one last digit",
)  # fmt: skip
@pytest.mark.published(
    "Rodrigues 2021", "Figures 2.12 to 2.15",
    what="preload, force on the tip, angles",
    ours="5.91 N; frames of the [nomenclature](nomenclature.md)",
    theirs="the same",
    verdict="agrees",
)  # fmt: skip
def test_tables_4_1_to_4_9_existing_forces(tables: CsvTable) -> None:
    """Lever 50 mm. Forces are printed to 0.01 N, 0.5 % of the smallest; 0.6 % is allowed.

    Two of 63 deviate more. They are treated as misprints and listed here:
    polar 40°, azimuth 50° prints 1.44 N where statics gives 1.554 (its neighbours 1.41 and 1.79,
    and its own sensing distance, fit 1.55); polar 20°, azimuth 40° prints 2.12 N for 2.134, a
    last digit wrong by one.
    """
    printed = tables.numbers("trigger_force_existing_N")[:, 0]
    ours = _predicted(tables, 50.0, "shen").force
    relative = np.abs(ours / printed - 1.0)
    misprint, last_digit = _row(tables, 40, 50), _row(tables, 20, 40)
    assert printed[misprint] == 1.44
    assert ours[misprint] == pytest.approx(1.554, abs=5e-4)
    assert printed[last_digit] == 2.12
    assert ours[last_digit] == pytest.approx(2.134, abs=5e-4)
    assert relative[last_digit] < 0.007
    good = np.ones(63, dtype=bool)
    good[[misprint, last_digit]] = False
    assert relative[good].max() < 0.006


def test_the_misprint_s_sensing_distance_fits_our_force(tables: CsvTable) -> None:
    row = _row(tables, 40, 50)
    printed = tables.numbers("sensing_distance_existing_mm")[row, 0]
    ours = _predicted(tables, 50.0, "shen").sensing_distance[row]
    assert abs(ours - printed) < 0.5e-4  # to the printed digit, 0.1 um


@pytest.mark.published("Rodrigues 2021", "Tables 4.1 to 4.9")
def test_tables_4_1_to_4_9_finite_element_forces_are_statics(tables: CsvTable) -> None:
    """Lever 64.4 mm (50 mm stylus + 14.4 mm hub): all 63 within 1 %, of which rounding to
    0.01 N is up to 0.7 %."""
    printed = tables.numbers("trigger_force_fea_N")[:, 0]
    ours = _predicted(tables, 64.4, "analytic").force
    assert np.abs(ours / printed - 1.0).max() < 0.01


@pytest.mark.published("Rodrigues 2021", "Tables 4.1 to 4.9")
def test_tables_4_1_to_4_9_existing_sensing_distances(tables: CsvTable) -> None:
    """F sin(polar) L³ / 3EI, to the last printed digit (0.1 um) ± 1: the error is below 0.15 um."""
    printed = tables.numbers("sensing_distance_existing_mm")[:, 0]
    ours = _predicted(tables, 50.0, "shen").sensing_distance
    assert np.abs(ours - printed).max() < 1.5e-4


@pytest.mark.published(
    "Rodrigues 2021", "Table 2.2",
    what="trigger forces at 90°",
    ours="existing 0.952 and 1.495 N; finite elements 0.744 and 1.223 N",
    theirs="0.965 (0.95 in Table 4.1), 1.49; 0.75, 1.22 N",
    verdict="agrees; the experiment [does not](#measurements)",
)  # fmt: skip
def test_table_2_2_existing_trigger_forces() -> None:
    """50 mm, polar 90°: 0.965 and 1.49 N printed; extremes over the printed azimuths 0 and 60°."""
    probe = load_probe("omp40-2").with_lever(50.0)
    low, high = predict(probe, from_angles(np.pi / 2, np.radians([0.0, 60.0])), "shen").force
    assert low == pytest.approx(0.965, abs=1e-3)
    assert high == pytest.approx(1.49, abs=1e-2)


@pytest.mark.published("Rodrigues 2021", "Table 2.2")
def test_table_2_2_finite_element_trigger_forces() -> None:
    probe = load_probe("omp40-2")
    low, high = predict(probe, from_angles(np.pi / 2, np.radians([0.0, 60.0]))).force
    assert low == pytest.approx(0.75, abs=5e-3)
    assert high == pytest.approx(1.22, abs=5e-3)


@pytest.mark.published(
    "Rodrigues 2021", "Table 2.3",
    what="sensing distances, 100 mm",
    ours="19.36 and 33.79; finite elements 15.88 and 28.17 µm",
    theirs="19.36, 33.79; 16.11, 28.456 µm",
    verdict="agrees: 0.1 %; −1.4, −1.0 %",
)  # fmt: skip
def test_table_2_3_existing_sensing_distances() -> None:
    """100 mm stylus as the lever: 19.36 and 33.79 um at azimuth 0 and 60°, to the last digit."""
    probe = load_probe("omp40-2-100mm").with_lever(100.0)
    um = (
        1e3
        * predict(probe, from_angles(np.pi / 2, np.radians([0.0, 60.0])), "shen").sensing_distance
    )
    assert np.round(um, 2).tolist() == [19.36, 33.79]


def test_section_2_9_2_delay_travel() -> None:
    """14.5 ms at 50 mm/min: 12.08 um."""
    assert delay_travel(50.0, 0.0145) == pytest.approx(12.083e-3, abs=1e-6)


def test_section_4_6_longer_stylus_triggers_at_less_force_but_bends_more() -> None:
    directions = from_angles(np.pi / 2, np.radians(np.arange(0, 61, 10)))
    short, long = (predict(load_probe(n), directions) for n in ("omp40-2", "omp40-2-100mm"))
    carbide = predict(load_probe("omp40-2-100mm-carbide"), directions)
    assert np.all(long.force < short.force)
    assert np.all(long.sensing_distance > short.sensing_distance)
    assert np.array_equal(carbide.force, long.force)
    assert np.all(carbide.sensing_distance < long.sensing_distance)


class TestSensitivityStudies:
    """Section 4.6, as the studies of the package: what the text says of Figures 4.27 to 4.36."""

    @staticmethod
    def _numbers(name: str, tmp_path: Path) -> dict[str, np.ndarray]:
        results = run_study(load_study(name), tmp_path / "study.nc", Workers(count=1))
        return dict(results.numbers)

    def test_a_longer_stem_triggers_at_less_force_and_bends_more(self, tmp_path: Path) -> None:
        """4.6.1. The force of frictionless seats goes with 1 / lever: 64.4, 89.4, 114.4 mm."""
        found = self._numbers("stylus-length", tmp_path)
        assert (np.diff(found["trigger_force_mean"]) < 0.0).all()
        assert (np.diff(found["sensing_distance_mean"]) > 0.0).all()
        levers = np.array([64.4, 89.4, 114.4])
        moments = found["trigger_force_least"] * levers
        # Only the small moment of the force about the plane of the rods is left out: 2 %.
        np.testing.assert_allclose(moments, moments.mean(), rtol=0.02)

    def test_the_diameter_changes_the_sensing_distance_alone(self, tmp_path: Path) -> None:
        """4.6.2."""
        found = self._numbers("stylus-diameter", tmp_path)
        np.testing.assert_array_equal(np.diff(found["trigger_force_mean"]), 0.0)
        assert found["sensing_distance_mean"][0] > found["sensing_distance_mean"][1]

    def test_ceramic_bends_more_than_carbide(self, tmp_path: Path) -> None:
        """4.6.3. The bending of the stem goes with 1 / E: 686 and 413 GPa; hub and seats stay."""
        found = self._numbers("stylus-material", tmp_path)
        ratio = np.divide(*found["sensing_distance_mean"][::-1])
        assert 1.0 < ratio < 686.0 / 413.0
        np.testing.assert_array_equal(np.diff(found["trigger_force_mean"]), 0.0)

    def test_less_preload_triggers_at_less_force(self, tmp_path: Path) -> None:
        """4.6.4. The force of frictionless seats is in proportion to the preload."""
        found = self._numbers("spring-preload", tmp_path)
        for name in ("trigger_force_least", "trigger_force_greatest"):
            assert np.divide(*found[name]) == pytest.approx(4.0 / 5.91, rel=1e-12)
        assert np.diff(found["sensing_distance_mean"])[0] > 0.0
