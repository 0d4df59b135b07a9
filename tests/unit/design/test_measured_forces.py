"""Numbers of a description from measured trigger forces, alone and with a map."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import InputError, PretravelError
from pretravel.design.identification.measured_forces import MeasuredForces
from pretravel.design.identification.probe_from_map import identify
from pretravel.design.identification.trigger_forces import read_trigger_forces
from pretravel.files.csv_table import write_csv_table
from pretravel.files.map_file import read_map
from pretravel.prediction.catalogue import load_probe
from tests.support.commands import both_outputs, run
from tests.support.examples import EXAMPLES
from tests.support.statics_by_hand import PRELOAD, direction, first_contact_force

AZIMUTHS = np.arange(0.0, 360.0, 15.0)


def _forces(preload: float, lever: float, turn: float, u: float, seed: int) -> MeasuredForces:
    """By six equations of equilibrium in numpy, with noise; the probe turned."""
    directions = np.array([direction(90.0, a) for a in AZIMUTHS])
    force = [first_contact_force(direction(90.0, a - turn), lever) for a in AZIMUTHS]
    noise = u * np.random.default_rng(seed).standard_normal(len(AZIMUTHS))
    return MeasuredForces(directions, np.array(force) * preload / PRELOAD + noise, np.full(24, u))


def test_preload_and_rotation_come_back() -> None:
    """Preload 4.8 N and a turn of 25°: within 4 u, which scale with that of the forces."""
    probe = load_probe("omp40-2")
    for u in (0.002, 0.01):
        found = identify(None, probe, ["preload", "rotation"], forces=_forces(4.8, 64.4, 25, u, 1))
        preload, rotation = found.values
        assert preload == pytest.approx(4.8, abs=4.0 * found.standard_uncertainty[0])
        apart = (np.degrees(rotation) - 25.0 + 60.0) % 120.0 - 60.0
        assert abs(apart) < 4.0 * np.degrees(found.standard_uncertainty[1])
        # All forces are in proportion to the preload: u of a weighted mean.
        force = found.forces.force - found.force_residuals if found.forces else np.zeros(1)
        alone = preload * u / np.sqrt(np.sum(force**2))
        assert found.standard_uncertainty[0] == pytest.approx(alone, rel=0.25)
        assert np.std(found.force_residuals) == pytest.approx(u, rel=0.5)
        assert not found.unknown


def test_what_forces_do_not_tell_is_said() -> None:
    """The stem does not change a trigger force: statics."""
    forces = _forces(4.8, 64.4, 0, 0.005, 2)
    rows = [*range(24), 3]  # one of them twice
    forces = MeasuredForces(forces.directions[rows], forces.force[rows], forces.u[rows])
    found = identify(None, load_probe("omp40-2"), ["stem_diameter"], forces=forces)
    assert any("forces 4 and 25 are equal" in each for each in found.unknown)
    assert any("the forces hardly determines stem_diameter" in each for each in found.unknown)
    assert any("differ from the model" in each for each in found.unknown)


def test_forces_with_a_map_tell_what_a_map_does_not(tmp_path: Path) -> None:
    """A map knows preload and stem by the bend of the seats alone; with forces of 1 % the preload
    is theirs, and the stem that of the map."""
    run("predict", "omp40-2", "--azimuth", "0:350:10", "--polar", "30:90:10",
        "-o", tmp_path / "map.json")  # fmt: skip
    pretravel_map = read_map(tmp_path / "map.json")
    probe = load_probe("omp40-2")
    free = ["preload", "stem_diameter"]
    alone = identify(pretravel_map, probe, free)
    forces = _forces(5.91, 64.4, 0, 0.008, 3)
    both = identify(pretravel_map, probe, free, forces=forces)
    assert both.standard_uncertainty[0] < 0.5 * alone.standard_uncertainty[0]
    assert both.values == pytest.approx([5.91, 4.5], rel=0.01)
    assert len(both.force_residuals) == 24


def test_refusals() -> None:
    probe = load_probe("omp40-2")
    one = MeasuredForces([[1.0, 0.0, 0.0]], [0.7], [0.01])
    for call, words in (
        (lambda: identify(None, probe, ["preload"]), "give one"),
        (lambda: identify(None, probe, ["preload", "lever"], forces=one), "1 forces do not"),
        (lambda: MeasuredForces([[1.0, 0.0, 0.0]], [0.7], [0.0]), "positive"),
        (lambda: MeasuredForces(np.zeros((0, 3)), [], []), "no measured forces"),
        (lambda: MeasuredForces([[1.0, 0.0, 0.0]], [664.0], [10.0]), "mN meant"),
    ):
        with pytest.raises(PretravelError, match=words):
            call()


def test_the_experiment_of_the_thesis() -> None:
    """Table 2.2, u 0.01 N: one scale leaves both forces 6 and 9 u away, since their ratio is that
    of another friction (docs/validation.md)."""
    told, warned = both_outputs("identify", "--forces", EXAMPLES / "rodrigues_trigger_forces.csv",
                                "--probe", "omp40-2", "--free", "preload")  # fmt: skip
    ratio = np.array([first_contact_force(direction(90.0, a), 64.4) for a in (0.0, 60.0)])
    measured = np.array([0.664, 1.294])
    scale = float(measured @ ratio) / float(ratio @ ratio)
    assert f"{scale * PRELOAD:.3f}" in told
    rest = measured - scale * ratio
    assert f"{rest[0]:+.4f}" in told
    # Birge's ratio with one degree of freedom: u of the scale is the length of the rest, by ratio.
    u = PRELOAD * float(np.linalg.norm(rest)) / float(np.linalg.norm(ratio))
    assert f"{scale * PRELOAD:.3f} {u:.2g}" in " ".join(told.split())
    assert "The probe is of another kind" in warned


@pytest.mark.slow
def test_the_experiment_of_the_thesis_with_friction() -> None:
    """Two numbers to two forces: friction 0.25 to 0.29, scale 0.90 to 0.92, as by hand."""
    forces = MeasuredForces([direction(90.0, 0.0), direction(90.0, 60.0)], [0.664, 1.294],
                            [0.01, 0.01])  # fmt: skip
    found = identify(None, load_probe("omp40-2"), ["preload", "friction"], forces=forces)
    assert found.values[0] / PRELOAD == pytest.approx(0.91, abs=0.01)
    assert found.values[1] == pytest.approx(0.27, abs=0.02)


def test_a_table_that_lacks_u(tmp_path: Path) -> None:
    write_csv_table(tmp_path / "f.csv", {"azimuth_deg": [0.0], "force_N": [0.7]})
    told = run("identify", "--forces", tmp_path / "f.csv", "--probe", "omp40-2", code=2)
    assert "u_N" in told
    write_csv_table(
        tmp_path / "f.csv",
        {"azimuth_deg": [0.0], "force_N": [0.7], "u_N": [0.01], "polar_rad": [1.2]},
    )
    with pytest.raises(PretravelError, match="no column 'polar_rad'"):
        read_trigger_forces(tmp_path / "f.csv")


def test_a_polar_angle_that_is_none(tmp_path: Path) -> None:
    table = tmp_path / "forces.csv"
    table.write_text("azimuth_deg,polar_deg,force_N,u_N\n0,90,0.75,0.01\n0,200,0.8,0.01\n")
    with pytest.raises(InputError, match="polar_deg is 200; polar angles lie between 0 and 180"):
        read_trigger_forces(table)
