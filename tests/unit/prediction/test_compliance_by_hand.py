"""Shares of the compliance models in oblique directions, written out one by one."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pretravel.base.directions import from_angles
from pretravel.base.errors import PretravelError
from pretravel.prediction import predict_with_friction
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.compliance.base import compliance_model
from pretravel.prediction.compliance.fem import (
    FiniteElements,
    balanced_tip_forces,
    check_seats,
    seat_closure,
)
from pretravel.prediction.compliance.ren import RenProbe, ren_pretravel
from pretravel.prediction.description import Probe
from pretravel.prediction.friction import check_conditions
from pretravel.prediction.hertz import rod_on_ball_coefficient
from pretravel.prediction.loading import loaded
from pretravel.prediction.materials import material
from pretravel.prediction.predict import predict
from pretravel.prediction.predict_with_friction import STEPS, TOUCHES, rubbed_trigger
from pretravel.prediction.seats import seat_statics

POLAR, AZIMUTH = np.radians([0.0, 35.0, 60.0, 90.0]), np.array([0.0, 0.4, 2.0, 4.0])
N = from_angles(POLAR, AZIMUTH)
STEEL = material("steel")


@pytest.fixture(scope="module")
def probe() -> Probe:
    return load_probe("omp40-2")


def test_flags_of_the_models() -> None:
    """Ren's lever law and one constant are no linear compliance; Shen has one length."""
    names = ("analytic", "fem", "ren", "shen", "wozniak")
    models = [compliance_model(name) for name in names]
    assert [each.has_response for each in models] == [True, True, False, True, False]
    assert [each.uses_lever_only for each in models] == [False, False, False, True, False]
    assert compliance_model(models[2]) is models[2]
    with pytest.raises(PretravelError, match="'best' is not known; there are analytic, fem, ren"):
        compliance_model("best")


def test_ren_of_a_described_probe(probe: Probe) -> None:
    """Recovery c F^(2/3) of a seat of 2.75 mm and 3.5 mm, tungsten carbide, over the triangle's
    height of 1.5 radii; a stem of ceramic 4.5 mm thick and 50 mm long. Across the axis alone: along
    it nothing moves but the tip on the part."""
    found = predict(probe, N, "ren")
    across = from_angles(np.full(4, 0.5 * math.pi), AZIMUTH)
    force = found.force * np.sin(POLAR)
    carbide = 686e3 / (2.0 * (1.0 - 0.22**2))
    recovery = rod_on_ball_coefficient(2.75, 3.5, carbide) * force ** (2.0 / 3.0)
    tilt = recovery * 64.4 / (1.5 * probe.tripod.radius)
    assert found.displacements["seat_tilt"] == pytest.approx(tilt[:, None] * across, abs=1e-12)
    bent = force * 50.0**3 / (3.0 * 413e3 * math.pi * 4.5**4 / 64.0)
    assert found.displacements["stylus_bending"] == pytest.approx(bent[:, None] * across, abs=1e-12)
    hertz = predict(probe, N, "analytic").displacements["tip_on_part"]
    assert found.displacements["tip_on_part"] == pytest.approx(hertz, rel=1e-12)
    rigid = predict(replace(probe, seats=replace(probe.seats, contact="rigid")), N, "ren")
    assert np.array_equal(rigid.displacements["seat_tilt"], np.zeros((4, 3)))
    assert rigid.displacements["stylus_bending"] == pytest.approx(bent[:, None] * across, abs=1e-12)


def test_ren_of_the_rig_with_four_materials() -> None:
    """Equations 6 to 12 with no two numbers equal, for three forces."""
    rig = RenProbe(
        lever=18.0, lever_ratio=1.5, stylus_diameter=2.0, stylus_modulus=190e3,
        contact_coefficient=0.97, seat_radii=(1.25, 2.0), seat_moduli=(200e3, 300e3),
        tip_radius=3.0, tip_modulus=620e3, part_modulus=70e3,
        poissons_ratios=(0.3, 0.2, 0.1, 0.35),
    )  # fmt: skip
    force = np.array([0.0, 0.5, 2.0])
    found = ren_pretravel(force, rig)
    seat = 0.91 / 200e3 + 0.96 / 300e3
    radii = (2.0 * 2.0 + 1.25) / (2.0 * 1.25)
    rigid = 1.5 * 0.655 * 0.97 * (radii * seat**2 * force**2) ** (1.0 / 3.0)
    tip = 0.99 / 620e3 + (1.0 - 0.35**2) / 70e3
    pressed = 0.8255 * (tip**2 * force**2 / 3.0) ** (1.0 / 3.0)
    bent = force * 18.0**3 * 64.0 / (3.0 * 190e3 * math.pi * 2.0**4)
    assert found.rigid == pytest.approx(rigid, rel=1e-9)
    assert found.compression == pytest.approx(pressed, rel=1e-9)
    assert found.bending == pytest.approx(bent, rel=1e-9)
    assert found.pretravel == pytest.approx(rigid + bent - pressed, rel=1e-9)
    plain = replace(rig, poissons_ratios=RenProbe.__dataclass_fields__["poissons_ratios"].default)
    assert plain.poissons_ratios == (0.0,) * 4


def test_shen_bends_across_the_axis_alone(probe: Probe) -> None:
    found = predict(probe, N, "shen")
    lateral = N * [1.0, 1.0, 0.0]
    bent = found.force * 64.4**3 / (3.0 * 413e3 * math.pi * 4.5**4 / 64.0)
    assert found.displacements["stylus_bending"] == pytest.approx(bent[:, None] * lateral, rel=1e-9)
    assert set(found.displacements) == {"stylus_bending"}


def test_wozniak_is_the_constant_of_five_touches(probe: Probe) -> None:
    """Its mean over five touches is theirs; lobes of 1 / cos lie opposite the rods. The probe is
    not symmetric to the five touches: its first rod is turned."""
    rods = tuple(azimuth + 0.3 for azimuth in probe.tripod.rod_azimuths)
    turned = replace(probe, tripod=replace(probe.tripod, rod_azimuths=rods))

    def shape(polar: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
        from_lobe = np.mod(azimuth - (rods[0] + math.pi), 2.0 * math.pi / 3.0)
        return np.asarray(np.sin(polar) ** 2 / np.cos(from_lobe - math.pi / 3.0))

    polar, azimuth = np.radians([90.0] * 4 + [0.0]), np.radians([0.0, 90.0, 180.0, 270.0, 0.0])
    five = predict(turned, from_angles(polar, azimuth), "analytic").pretravel
    constant = five.sum() / shape(polar, azimuth).sum()
    found = predict(turned, N, "wozniak")
    pretravel = constant * shape(POLAR, AZIMUTH)
    assert found.pretravel == pytest.approx(pretravel, rel=1e-9, abs=1e-15)
    along = pretravel[:, None] * N
    assert found.displacements["wozniak"] == pytest.approx(along, rel=1e-9, abs=1e-15)
    assert constant > 1e-3


def test_the_stylus_bends_and_shears_across_and_yields_along_its_axis(probe: Probe) -> None:
    """Of an oblique force: the displacements are those of its parts across and along the axis."""
    found = predict(probe, N, "analytic")
    side = predict(probe, np.array([[1.0, 0.0, 0.0]]), "analytic")
    up = predict(probe, np.array([[0.0, 0.0, 1.0]]), "analytic")
    for name, part, plain in (
        ("stylus_bending", N * [1.0, 1.0, 0.0], side),
        ("stylus_shear", N * [1.0, 1.0, 0.0], side),
        ("stylus_axial", N * [0.0, 0.0, 1.0], up),
    ):
        compliance = plain.shares[name][0] / plain.force[0]
        expected = compliance * found.force[:, None] * part
        assert found.displacements[name] == pytest.approx(expected, rel=1e-9, abs=1e-15)
        assert compliance > 0.0


class TestFiniteElements:
    def _reduced(self, probe: Probe, **numbers: Any) -> Any:
        statics = seat_statics(probe)
        resultants = np.zeros((6, 22))
        resultants[:, :9] = np.concatenate([statics.wrenches, statics.tip_wrenches], axis=1)
        root = np.random.default_rng(4).normal(size=(22, 22))
        return SimpleNamespace(
            **{
                "resultants": resultants,
                "flexibility": 1e-6 * root @ root.T,
                "seat_correction": 3e-5,
            }
            | numbers
        )

    @pytest.mark.parametrize(("off", "refused"), [(0.9e-6, False), (1.1e-6, True)])
    @pytest.mark.parametrize("place", [(0, 3), (4, 7), (5, 8)])
    def test_seats_that_are_elsewhere(
        self, probe: Probe, off: float, refused: bool, place: tuple[int, int]
    ) -> None:
        """By more than a millionth of the lever, of the 64.4 mm from the rods to the tip."""
        statics, reduced = seat_statics(probe), self._reduced(probe)
        reduced.resultants[place] += off * np.linalg.norm(statics.tip)
        if refused:
            with pytest.raises(PretravelError, match="of the lever"):
                check_seats(reduced, statics)
        else:
            check_seats(reduced, statics)

    def test_a_model_of_another_probe_is_refused(self, probe: Probe) -> None:
        reduced = self._reduced(probe)
        reduced.resultants[5, 8] += 0.1
        with pytest.raises(PretravelError, match="seats and tip differ"):
            predict(probe, N, FiniteElements(reduced))

    def test_unit_forces_are_balanced(self, probe: Probe) -> None:
        """No resultant is left, and nothing acts but the tip's force and the seats."""
        statics, forces = seat_statics(probe), balanced_tip_forces(seat_statics(probe))
        resultants = self._reduced(probe).resultants
        assert forces.shape == (3, 22)
        assert forces @ resultants.T == pytest.approx(np.zeros((3, 6)), abs=1e-9)
        assert np.count_nonzero(forces[:, 9:]) == 0
        assert forces[:, 6:9] == pytest.approx(np.eye(3))
        assert statics.tip_wrenches[:3] == pytest.approx(np.eye(3))

    def test_rods_stay_on_their_balls(self, probe: Probe) -> None:
        """Elastic motion, indentation and rigid motion of each seat add up to nothing."""
        statics, reduced = seat_statics(probe), self._reduced(probe)
        loading = loaded(probe, statics, N[2:3], np.array([0.4]), STEEL)
        change = np.sin(np.arange(22.0))
        motion = seat_closure(reduced, loading, change)
        for seat in range(6):
            bent = float(reduced.flexibility[seat] @ change)
            sunk = loading.seat_indentations[0, seat] + 3e-5 * change[seat]
            follows = float(reduced.resultants[:, seat] @ motion)
            assert bent + sunk + follows == pytest.approx(0.0, abs=1e-12)
        assert motion.shape == (6,)

    def test_regions_of_a_part_add_up(self, probe: Probe) -> None:
        """Virtual work: unit forces on the region's flexibility; twice the same region is twice
        the share, and what lies under the seats loses the half-spaces."""
        reduced = self._reduced(
            probe, seat_part="hub", patch_compliance=2e-5, ball_correction=0.0,
            flexibility_by_region={},
        )  # fmt: skip
        one, two = reduced.flexibility, np.diag(np.arange(1.0, 23.0)) * 1e-6
        reduced.flexibility_by_region = {"stylus 1": one, "hub": two, "stylus 2": two}
        found = predict(probe, N, FiniteElements(reduced))
        statics = seat_statics(probe)
        unit = balanced_tip_forces(statics)
        force = found.force[:, None] * N
        by_one, by_two = force @ unit @ one @ unit.T, force @ unit @ two @ unit.T
        stylus = found.displacements["stylus"]
        assert stylus == pytest.approx(by_one + by_two, rel=1e-9, abs=1e-15)
        change = force @ unit[:, :6]
        lost = statics.tip_displacement(2e-5 * change)
        assert found.displacements["hub"] == pytest.approx(by_two - lost, rel=1e-9, abs=1e-15)


def test_friction_needs_elastic_seats(probe: Probe) -> None:
    check_conditions(probe, 0.1, None, 1, 5)
    rigid = replace(probe, seats=replace(probe.seats, contact="rigid"))
    with pytest.raises(PretravelError, match="contact is 'rigid', make it 'hertz'"):
        check_conditions(rigid, 0.1, None, 1, 5)


class TestRubbedTrigger:
    def _asked(self, monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
        """A cycle of made-up numbers, in which no two touches are equal."""
        asked: dict[str, Any] = {}

        def made_up(probe: Probe, directions: np.ndarray, friction: float, **others: Any) -> Any:
            asked.update(probe=probe, directions=directions, friction=friction, **others)
            size = (len(directions), 3)
            return SimpleNamespace(
                trigger_force=np.arange(1.0, 1.0 + math.prod(size)).reshape(size),
                trigger_displacement=1e-3 * np.arange(3.0 * math.prod(size)).reshape(*size, 3),
                tripod_displacement=1e-4
                * np.cos(np.arange(3.0 * math.prod(size))).reshape(*size, 3),
            )

        monkeypatch.setattr(predict_with_friction, "friction_cycle", made_up)
        return asked

    def test_the_last_touch_counts(self, probe: Probe, monkeypatch: pytest.MonkeyPatch) -> None:
        asked = self._asked(monkeypatch)
        sliding = replace(probe, seats=replace(probe.seats, friction=0.15))
        cycle, shares = rubbed_trigger(sliding, N, compliance_model("analytic"), STEEL)
        assert asked["probe"] is sliding
        assert (asked["friction"], asked["body"]) == (0.15, "analytic")
        assert (asked["cycles"], asked["steps"]) == (TOUCHES, STEPS)
        seats = cycle.tripod_displacement[:, 2]
        assert np.array_equal(shares["seats"], seats)
        body = cycle.trigger_displacement[:, 2] - seats
        assert shares["body"] == pytest.approx(body, abs=1e-15)
        plain = predict(probe, N, "analytic", workpiece=STEEL)
        share = np.cbrt(np.array([3.0, 6.0, 9.0, 12.0]) / plain.force) ** 2
        hertz = share[:, None] * plain.displacements["tip_on_part"]
        assert shares["tip_on_part"] == pytest.approx(hertz, rel=1e-9)
        assert not any(each.flags.writeable for each in shares.values())

    def test_finite_elements_that_are_given_or_made(
        self, probe: Probe, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        asked = self._asked(monkeypatch)
        given, made = SimpleNamespace(name="given"), SimpleNamespace(name="made")
        monkeypatch.setattr(predict_with_friction, "reduced_model", lambda _: made)
        for reduced, used in ((given, given), (None, made)):
            rubbed_trigger(probe, N, FiniteElements(reduced), STEEL)  # type: ignore[arg-type]
            assert asked["body"] is used
        with pytest.raises(
            PretravelError, match="model 'ren' does not contain friction"
        ) as refused:
            rubbed_trigger(probe, N, compliance_model("ren"), STEEL)
        assert refused.value.inputs == ("model", "friction")
