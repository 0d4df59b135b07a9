"""What a study computes of a design, against closed forms and the functions of other rooms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.base.toml_file import parse_toml
from pretravel.base.units import MICROMETRE
from pretravel.design.contact_stress import seat_stress
from pretravel.design.fem.elastic_field import field_at_trigger
from pretravel.design.fem.reduction_cache import reduced_model
from pretravel.design.studies.definition import Study, study_in
from pretravel.design.studies.outputs import outcome_of
from pretravel.design.tasks.predict import Predict
from pretravel.measurement.comparison import compare_corrections
from pretravel.prediction.catalogue import description_text, load_probe
from pretravel.prediction.trigger import predict
from tests.support.coarse_models import models_by_name_are_coarse

FACTOR = '[[factor]]\nkey = "spring.preload_N"\nvalues = [4.0, 5.91]\n'


def study(outputs: str, more: str = "", folder: Path = Path()) -> Study:
    return study_in(
        parse_toml(f'[study]\noutputs = ["{outputs}"]\n{more}\n{FACTOR}', "study.toml"), folder
    )


def test_lobes_are_the_third_harmonic_of_the_wall() -> None:
    """Least squares of one, cos 3a and sin 3a."""
    found = outcome_of(study("pretravel"), {})
    azimuth = np.radians(np.arange(0.0, 360.0, 10.0))
    wall = np.column_stack([np.cos(azimuth), np.sin(azimuth), np.zeros(36)])
    pretravel = predict(load_probe("omp40-2"), wall).pretravel / MICROMETRE
    design = np.column_stack([np.ones(36), np.cos(3.0 * azimuth), np.sin(3.0 * azimuth)])
    _, cosine, sine = np.linalg.lstsq(design, pretravel, rcond=None)[0]
    assert found.numbers["pretravel_lobes"] == pytest.approx(np.hypot(cosine, sine), rel=1e-9)


def test_the_pole_counts_once_in_the_mean() -> None:
    """It is one direction, whatever its azimuth: one pole and twelve directions of a wall."""
    more = '[directions]\nazimuth_deg = "0:330:30"\npolar_deg = [0, 90]\n'
    azimuth = np.radians(np.arange(0.0, 360.0, 30.0))
    wall = np.column_stack([np.cos(azimuth), np.sin(azimuth), np.zeros(12)])
    distinct = predict(load_probe("omp40-2"), [[0.0, 0.0, 1.0], *wall])
    found = outcome_of(study("pretravel", more), {}).numbers
    pretravel = distinct.pretravel / MICROMETRE
    assert found["pretravel_mean"] == pytest.approx(pretravel.mean(), rel=1e-12)
    assert found["pretravel_deviation"] == pytest.approx(pretravel.std(), rel=1e-12)
    found = outcome_of(study("force", more), {}).numbers
    assert found["trigger_force_mean"] == pytest.approx(distinct.force.mean(), rel=1e-12)


def test_a_part_can_be_of_a_material_of_the_description(tmp_path: Path) -> None:
    """Its own steel precedes that of the package, as in a prediction."""
    own = "\n[materials.{}]\nyoungs_modulus_GPa = 3.0\npoissons_ratio = 0.4\ndensity_g_cm3 = 1.2\n"
    text = description_text("omp40-2") + own.format("nylon") + own.format("steel")
    (tmp_path / "own.toml").write_text(text)
    probe, axial = load_probe(tmp_path / "own.toml"), [[0.0, 0.0, 1.0]]
    soft = predict(probe, axial, workpiece="nylon").pretravel[0]
    assert soft > 2.0 * predict(load_probe("omp40-2"), axial).pretravel[0]
    assert predict(probe, axial).pretravel[0] == soft
    more = 'probe = "own.toml"\n[directions]\npolar_deg = 0\n[prediction]\nworkpiece = "{}"\n'
    for name in ("nylon", "steel"):
        found = outcome_of(study("pretravel", more.format(name), tmp_path), {}).numbers
        assert found["pretravel_mean"] * MICROMETRE == pytest.approx(soft, rel=1e-12)


def test_no_lobes_are_said_of_a_part_of_the_circle() -> None:
    found = outcome_of(study("pretravel", '[directions]\nazimuth_deg = "0:90:10"\n'), {})
    assert np.isnan(found.numbers["pretravel_lobes"])


def test_corrections_are_those_of_compare() -> None:
    """With the map that ``pretravel predict -o map.json`` writes for the same directions."""
    more = '[directions]\nazimuth_deg = "0:355:5"\npolar_deg = "0:90:5"\n'
    found = outcome_of(study("corrections", more), {}).numbers
    exact = Predict(probe="omp40-2").run().pretravel_map(exact=True)
    rows = compare_corrections(exact).rows
    rms = {row.method: row.rms / MICROMETRE for row in rows if row.where == "all"}
    assert found["left_by_uncorrected"] == pytest.approx(rms["uncorrected"], rel=1e-6)
    assert found["left_by_eight_sectors"] == pytest.approx(rms["eight sectors"], rel=1e-6)


@pytest.mark.long
def test_a_calibration_without_noise_finds_the_probe() -> None:
    """The fitted six seats are those of the prediction: what is left is small against 1.1 µm."""
    more = '[calibration]\ntouches = 40\nkind = "physical"\nnoise_um = {}\n'
    exact = outcome_of(study("calibration", more.format("0.0")), {}).numbers
    noisy = outcome_of(study("calibration", more.format("1.0")), {}).numbers
    assert exact["left_after_calibration"] < 0.05
    assert noisy["left_after_calibration"] > 2.0 * exact["left_after_calibration"]
    assert noisy["u_after_calibration"] > 0.2


def test_a_delay_adds_feed_times_delay(tmp_path: Path) -> None:
    """600 mm/min · 1.5 ms = 15 µm of travel, on a plane and along its normal."""
    (tmp_path / "targets.csv").write_text("x_mm,y_mm,z_mm,nx,ny,nz\n0,0,0,0,0,1\n3,1,0,0,0,1\n")
    more = '[touch]\nsurface = "plane:polar=0"\ntargets = "targets.csv"\n{}'
    still = outcome_of(study("touch", more.format(""), tmp_path), {}).numbers
    moving = outcome_of(
        study("touch", more.format("feed_mm_min = 600.0\ndelay_ms = 1.5\n"), tmp_path), {}
    ).numbers
    axial = predict(load_probe("omp40-2"), [[0.0, 0.0, 1.0]]).pretravel[0] / MICROMETRE
    assert still["travel_since_contact_mean"] == pytest.approx(axial, rel=1e-6)
    for which in ("least", "mean", "greatest"):
        name = f"travel_since_contact_{which}"
        assert moving[name] - still[name] == pytest.approx(15.0, abs=1e-6)
    (tmp_path / "targets.csv").write_text("x_mm,y_mm,z_mm,nx,ny,nz,feed_mm_min\n0,0,0,0,0,1,50\n")
    other = outcome_of(study("touch", more.format("feed_mm_min = 600.0\n"), tmp_path), {})
    assert "targets.csv has a feed of 50 mm/min, and [touch] has feed_mm_min = 600" in other.reason


@pytest.mark.long
def test_stress_is_the_highest_of_all_directions(monkeypatch: pytest.MonkeyPatch) -> None:
    """Computed one by one from the field; all loads grow with the preload, and so do stresses."""
    models_by_name_are_coarse(monkeypatch)
    more = '[directions]\nazimuth_deg = "0:60:60"\npolar_deg = "90:90:10"\n'
    fem = study("stress", more + '[prediction]\nmodel = "fem"\n')
    found = outcome_of(fem, {}).numbers["stress_greatest"]
    probe = load_probe("omp40-2")
    each = [
        field_at_trigger(probe, [np.cos(a), np.sin(a), 0.0], reduced_model(probe)).stress.max()
        for a in (0.0, np.pi / 3.0)
    ]
    assert found == pytest.approx(max(each), rel=1e-9)
    assert max(each) > 1.01 * min(each)
    less = outcome_of(fem, {"spring.preload_N": 4.0}).numbers["stress_greatest"]
    assert less / found == pytest.approx(4.0 / 5.91, rel=1e-9)


def test_contacts_are_the_highest_of_all_directions() -> None:
    """With any model. Pressure grows with the root of the third degree of all loads."""
    made = study("contact", '[directions]\nazimuth_deg = "0:60:60"\npolar_deg = "90:90:10"\n')
    found = outcome_of(made, {}).numbers
    probe = load_probe("omp40-2")
    trigger = predict(probe, [[1.0, 0.0, 0.0], [0.5, np.sqrt(0.75), 0.0]])
    expected = seat_stress(probe, trigger.reactions)
    assert found["seat_pressure_greatest"] == pytest.approx(expected.pressure.max())
    assert found["contact_shear_of_limit"] > expected.share_of_limit.max()  # of the part of steel
    less = outcome_of(made, {"spring.preload_N": 4.0}).numbers
    for name in ("seat_pressure_greatest", "tip_pressure_greatest"):
        assert less[name] / found[name] == pytest.approx((4.0 / 5.91) ** (1 / 3), rel=1e-9)


def test_outputs_that_lack_something_say_what() -> None:
    assert "needs [touch] with surface and targets" in outcome_of(study("touch"), {}).reason
    assert outcome_of(study("stress"), {}).reason == "the output stress needs the model fem"


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("noise_um = -0.3", "the noise of [calibration]"),
        ("seed = -1", "seed of [calibration] is -1"),
    ],
)
def test_a_calibration_that_cannot_be_says_why(more: str, said: str) -> None:
    assert said in outcome_of(study("calibration", f"[calibration]\n{more}\n"), {}).reason
