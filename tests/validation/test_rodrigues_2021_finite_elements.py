"""Rodrigues 2021, chapters 2 and 4: the thesis's finite-element sensing distances.

A. Rodrigues (2021), thesis on surface measurement with touch-trigger probes, Tables 2.2, 2.3,
4.1 to 4.9, section 4.6. The catalogue's unpublished dimensions were identified from Table 4.1
(polar 90°) alone, by docs/gallery/identify_omp40_geometry.py, twice: ``omp40-2`` with elastic
seats (Hertz), ``omp40-2-thesis`` with rigid seats. All other values here are predictions.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import from_angles
from pretravel.files.csv_table import CsvTable, read_csv_table
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.description import Probe
from pretravel.prediction.materials import material
from pretravel.prediction.trigger import Trigger, predict
from tests.support.coarse_models import MESH_ERROR, MESHES, models_by_name_are_coarse

REFERENCE = Path(__file__).parent / "reference"
WALL = from_angles(np.pi / 2.0, np.radians(np.arange(0.0, 61.0, 10.0)))
ROUNDING = 0.05e-3  # mm: half of the last printed digit
MESH_OF_THE_FIT = 0.003
"""By which the default mesh changes what was fitted with refinement 0.6 (rate and error of the
convergence study: 0.43 % times 0.6 to the power -0.94, less 0.43 %; identify_omp40_geometry.py).
The thesis states no accuracy to allow for: of its own mesh it says that the lobes differ by less
than 1 um, of its search for the trigger nothing."""


@pytest.fixture(scope="module", params=MESHES, autouse=True)
def mesh(request: pytest.FixtureRequest) -> Iterator[str]:
    with pytest.MonkeyPatch.context() as patch:
        if request.param == "coarse":
            models_by_name_are_coarse(patch)
        yield request.param


@pytest.fixture(scope="module")
def tables() -> CsvTable:
    return read_csv_table(REFERENCE / "rodrigues_trigger_50mm.csv")


def _columns(tables: CsvTable) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Polar angles in degrees, directions, printed sensing distances in mm."""
    polar, azimuth = (tables.numbers(name)[:, 0] for name in ("polar_deg", "azimuth_deg"))
    printed = tables.numbers("sensing_distance_fea_mm")[:, 0]
    return polar, from_angles(np.radians(polar), np.radians(azimuth)), printed


@pytest.mark.published("Rodrigues 2021", "Tables 4.1 to 4.9")
def test_tables_4_1_to_4_9_sensing_distances_with_rigid_seats(tables: CsvTable, mesh: str) -> None:
    """The fit at 90° is no worse than the rounding to 0.1 um (1.5 % of 3.4 um) and the change of
    the mesh since. The other 56 are predicted: within 5 %, of which up to 2.5 % are the rounding
    of 2.0 um."""
    polar, directions, printed = _columns(tables)
    ours = predict(load_probe("omp40-2-thesis"), directions, "fem").sensing_distance
    off = ours / printed - 1.0
    allowed = ROUNDING / printed + MESH_OF_THE_FIT + MESH_ERROR[mesh]
    assert np.all(np.abs(off)[polar == 90.0] < allowed[polar == 90.0])
    assert np.sum(polar != 90.0) == 56
    assert np.abs(off[polar != 90.0]).max() < 0.05
    assert np.all(np.abs(ours - printed) < 2.5 * ROUNDING + MESH_ERROR[mesh] * printed)


def test_printed_sensing_distances_are_proportional_to_the_lateral_force(
    tables: CsvTable,
) -> None:
    """Elastic seats cannot reproduce them: one constant fits all 63 within the rounding (the two or
    three directions beyond it deviate by less than a digit)."""
    polar, directions, printed = _columns(tables)
    force = predict(load_probe("omp40-2"), directions, "shen").force
    lateral = force * np.sin(np.radians(polar))
    constant = np.sum(printed * lateral) / np.sum(lateral**2)
    assert constant == pytest.approx(4.58e-3, abs=0.02e-3)
    assert np.abs(printed - constant * lateral).max() < 2.5 * ROUNDING
    assert np.mean(np.abs(printed - constant * lateral) < ROUNDING) > 0.8
    # Hertz softens unloaded seats: between azimuth 0 and 60° the constant would change by 5 %.
    trigger = predict(load_probe("omp40-2"), WALL[[0, 6]], "fem")
    ratio = trigger.sensing_distance / trigger.force
    assert ratio[0] / ratio[1] > 1.05
    assert printed[0] / lateral[0] == pytest.approx(printed[6] / lateral[6], rel=0.015)


def test_tables_4_1_to_4_9_with_seats_that_give_honest_miss(tables: CsvTable) -> None:
    """With every free dimension at its largest plausible value the seats still add too much: 8 to
    18 % at 90°, up to 27 % at small polar angles. The test documents this; it sets no aim."""
    polar, directions, printed = _columns(tables)
    off = predict(load_probe("omp40-2"), directions, "fem").sensing_distance / printed - 1.0
    assert 0.06 < off[polar == 90.0].min() < off[polar == 90.0].max() < 0.20
    assert 0.05 < off.min() < off.max() < 0.28


# Slow with seats that give: a mesh of its own, for what 50 mm with them and 100 mm without show.
@pytest.mark.published("Rodrigues 2021", "Table 2.3")
@pytest.mark.parametrize(
    "name",
    [pytest.param("omp40-2-100mm", marks=pytest.mark.slow), "omp40-2-thesis-100mm"],
)
def test_table_2_3_experiment(name: str) -> None:
    """15.875 and 28.865 um measured with a 100 mm stylus: both extremes within 5 %, predicted."""
    azimuth = from_angles(np.pi / 2.0, np.radians(np.arange(0.0, 61.0, 2.5)))
    ours = predict(load_probe(name), azimuth, "fem").sensing_distance
    assert ours.min() == pytest.approx(15.875e-3, rel=0.05)
    assert ours.max() == pytest.approx(28.865e-3, rel=0.05)


@pytest.mark.published("Rodrigues 2021", "Table 2.3")
@pytest.mark.published(
    "Rodrigues 2021", "Figures 2.18, 2.19",
    what="distances at azimuth 60° and 0°, 100 mm",
    ours="28.17 and 15.88 µm",
    theirs="28.456 and 16.11 µm",
    verdict="agrees",
)  # fmt: skip
def test_table_2_3_finite_elements_with_rigid_seats(mesh: str) -> None:
    """16.11 and 28.456 um at azimuth 0 and 60°; the 100 mm stylus was not fitted to."""
    trigger = predict(load_probe("omp40-2-thesis-100mm"), WALL[[0, 6]], "fem")
    assert trigger.sensing_distance == pytest.approx(
        [16.11e-3, 28.456e-3], rel=0.02 + MESH_ERROR[mesh]
    )


def test_table_2_2_trigger_forces() -> None:
    trigger = predict(load_probe("omp40-2"), WALL, "fem")
    assert trigger.force.min() == pytest.approx(0.75, abs=0.01)
    assert trigger.force.max() == pytest.approx(1.22, abs=0.005)


def test_what_the_analytic_model_leaves_out() -> None:
    """Hub and rods; and the face of the head, in which the stem rotates. A rigid punch on a
    half-space turns by 3 (1 - nu²) / (8 E r³) per unit of moment (Johnson, 3.46 and following); an
    elastic stem rotates more, by a factor below one and a half.
    """
    probe = load_probe("omp40-2")
    elastic, beam = (predict(probe, WALL, model) for model in ("fem", "analytic"))
    head, stem = probe.stylus
    punch = 3.0 * head.material.plane_strain_compliance / (8.0 * (0.5 * stem.diameter) ** 3)
    turned = punch * elastic.force * stem.length**2
    extra = elastic.shares["stylus"] - sum(
        beam.shares[name] for name in ("stylus_bending", "stylus_shear", "stylus_axial")
    )
    assert np.all((extra > turned) & (extra < 1.5 * turned))
    # Seats are Hertz in both; the balls' ends make them stiffer by some thousandths.
    assert elastic.shares["seats"] == pytest.approx(beam.shares["seats"], rel=5e-3)


@pytest.fixture(scope="module")
def baseline(mesh: str) -> Trigger:
    """Section 4.6 varies a 100 mm stylus with carbide stem at 5.91 N (Table 4.12)."""
    return predict(_carbide(), WALL, "fem")


def _carbide() -> Probe:
    return load_probe("omp40-2-100mm-carbide")


def _with_stem(probe: Probe, **changes: object) -> Probe:
    return replace(probe, stylus=(probe.stylus[0], replace(probe.stylus[1], **changes)))


@pytest.mark.published(
    "Rodrigues 2021", "Figures 4.27, 4.28",
    what="stylus 100 and 50 mm",
    ours="less force, more bending",
    theirs="the same",
    verdict="agrees",
)  # fmt: skip
@pytest.mark.slow
def test_section_4_6_length(baseline: Trigger) -> None:
    """4.6.1: the longer stylus triggers at a smaller force and bends more. Forces are as the
    levers.
    """
    probe = _carbide()
    short = predict(_with_stem(probe, length=probe.stylus[1].length - 50.0), WALL, "fem")
    assert np.all(short.force > baseline.force)
    assert np.all(short.sensing_distance < 0.5 * baseline.sensing_distance)


@pytest.mark.published(
    "Rodrigues 2021", "Figures 4.30, 4.31",
    what="stem 4.5 and 3.8 mm",
    ours="equal force, more bending",
    theirs="the same",
    verdict="agrees",
)  # fmt: skip
@pytest.mark.slow
def test_section_4_6_diameter(baseline: Trigger) -> None:
    """4.6.2: 3.8 mm for 4.5 mm does not change the force and bends more: its stem by
    (4.5/3.8)^4 = 1.97, the other parts not at all."""
    thin = predict(_with_stem(_carbide(), diameter=3.8), WALL, "fem")
    assert thin.force == pytest.approx(baseline.force, rel=1e-12)
    stem = thin.shares["stylus"] / baseline.shares["stylus"]
    assert np.all((stem > 1.7) & (stem < 1.97))
    assert thin.shares["seats"] == pytest.approx(baseline.shares["seats"], rel=1e-3)


@pytest.mark.published(
    "Rodrigues 2021", "Figures 4.33, 4.34",
    what="carbide and ceramic",
    ours="equal force, more bending",
    theirs="the same",
    verdict="agrees",
)  # fmt: skip
@pytest.mark.slow
def test_section_4_6_material(baseline: Trigger) -> None:
    """4.6.3: ceramic (413 GPa) for carbide (686) does not change the force and bends more: its
    stem by 1.66, the steel head not at all."""
    ceramic = predict(_with_stem(_carbide(), material=material("ceramic")), WALL, "fem")
    assert ceramic.force == pytest.approx(baseline.force, rel=1e-12)
    stem = ceramic.shares["stylus"] / baseline.shares["stylus"]
    assert np.all((stem > 1.45) & (stem < 686.0 / 413.0))


@pytest.mark.published(
    "Rodrigues 2021", "Figures 4.35, 4.36",
    what="preload 5.91 and 4 N",
    ours="ratio 0.677 of force and body",
    theirs="smaller",
    verdict="agrees",
)  # fmt: skip
@pytest.mark.slow
def test_section_4_6_preload(baseline: Trigger) -> None:
    """4.6.4: 4 N for 5.91 N: force and deflection of the body in proportion, the seats' as
    the power 2/3."""
    weak = predict(replace(_carbide(), preload=4.0), WALL, "fem")
    ratio = 4.0 / 5.91
    assert weak.force == pytest.approx(ratio * baseline.force, rel=1e-12)
    assert weak.shares["stylus"] == pytest.approx(ratio * baseline.shares["stylus"], rel=1e-9)
    # The local deformation of the patch is subtracted linearly: a few per cent of the seats' part.
    expected = ratio ** (2.0 / 3.0) * baseline.shares["seats"]
    assert weak.shares["seats"] == pytest.approx(expected, rel=0.02)
