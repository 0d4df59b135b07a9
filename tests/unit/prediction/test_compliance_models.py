"""Displacements of each compliance model in oblique directions, written out by hand.

The compliances of beams, Hertz's coefficients and the rigid motion over six seats have their own
laws (`tests/laws`): here is which of them a share contains, with which numbers of the probe.
"""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import from_angles
from pretravel.base.errors import PretravelError
from pretravel.design.fem.compliance import FiniteElements
from pretravel.design.friction import predict_with_friction
from pretravel.prediction.beam import axial_compliance, bending_compliance, shear_compliance
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.compliance.base import compliance_model
from pretravel.prediction.compliance.ren import RenProbe, ren_pretravel
from pretravel.prediction.description import Moving, Probe
from pretravel.prediction.materials import Material, material
from pretravel.prediction.seats import SeatStatics, seat_statics
from pretravel.prediction.trigger import Trigger, predict
from pretravel.six_seats.hertz import ball_on_flat, rod_on_ball_coefficient

POLAR, AZIMUTH = np.radians([0.0, 35.0, 60.0, 100.0]), np.array([0.0, 0.4, 2.0, 4.0])
N = from_angles(POLAR, AZIMUTH)
LATERAL, ALONG = N * [1.0, 1.0, 0.0], N * [0.0, 0.0, 1.0]
STEEL, ALUMINIUM = material("steel"), material("aluminium")
BENT = 64.0 / (3.0 * 413e3 * math.pi * 4.5**4)
"""L³/3EI of the catalogue's stem of ceramic, 4.5 mm thick, over L³."""


@pytest.fixture(scope="module")
def probe() -> Probe:
    return load_probe("omp40-2")


def sunk(probe: Probe, statics: SeatStatics, found: Trigger) -> FloatArray:
    """Of each seat by Hertz, less that at rest; an open seat is just touching, (n, 6)."""
    modulus = probe.tripod.material.contact_modulus(probe.seats.material)
    c = rod_on_ball_coefficient(probe.tripod.rod_radius, probe.seats.ball_radius, modulus)
    loads = np.maximum(found.reactions, 0.0)
    return np.asarray(c * (np.cbrt(loads**2) - np.cbrt(statics.rest_reactions**2)))


def test_flags_of_the_models() -> None:
    """Ren's lever law and one constant are no linear compliance; Shen has one length."""
    names = ("analytic", "fem", "ren", "shen", "wozniak")
    models = [compliance_model(name) for name in names]
    assert [each.has_response for each in models] == [True, True, False, True, False]
    assert [each.uses_lever_only for each in models] == [False, False, False, True, False]
    assert compliance_model(models[2]) is models[2]
    with pytest.raises(PretravelError, match="'best' is not known; there are analytic, fem, ren"):
        compliance_model("best")


@pytest.mark.parametrize(("workpiece", "part"), [(None, STEEL), (ALUMINIUM, ALUMINIUM)])
def test_analytic(probe: Probe, workpiece: Material | None, part: Material) -> None:
    """The stylus bends and shears across its axis and yields along it; seats of two materials, of
    which some are open when a rod lifts, and the tip on the part by Hertz. With weight."""
    seats = replace(probe.seats, material=STEEL)
    probe = replace(probe, seats=seats, criterion="arm_lift", moving=Moving(0.02, -25.0))
    statics, down = seat_statics(probe, (1.0, 0.0, 0.0)), (1.0, 0.0, 0.0)
    assert np.ptp(statics.rest_reactions) > 0.1
    found = predict(probe, N, workpiece=workpiece, gravity=down)
    assert found.reactions.min() < -0.01
    force, stylus = found.force[:, None], probe.stylus
    modulus = probe.tip.material.contact_modulus(part)
    approach = ball_on_flat(found.force, probe.tip.radius, modulus)
    expected = {
        "stylus_bending": bending_compliance(stylus) * force * LATERAL,
        "stylus_shear": shear_compliance(stylus) * force * LATERAL,
        "stylus_axial": axial_compliance(stylus) * force * ALONG,
        "seats": statics.tip_displacement(sunk(probe, statics, found)),
        "tip_on_part": approach[:, None] * N,
    }
    assert found.displacements.keys() == expected.keys()
    for name, moved in expected.items():
        assert found.displacements[name] == pytest.approx(moved, rel=1e-12, abs=1e-15), name


def test_ren_of_a_described_probe(probe: Probe) -> None:
    """Recovery c F^(2/3) of a seat of 2.75 mm and 3.5 mm, tungsten carbide, over the triangle's
    height of 1.5 radii; a stem 50 mm long. Across the axis alone: along it nothing moves but the
    tip on the part."""
    found = predict(probe, N, "ren")
    across = from_angles(np.full(4, 0.5 * math.pi), AZIMUTH)
    force = found.force * np.sin(POLAR)
    carbide = 686e3 / (2.0 * (1.0 - 0.22**2))
    recovery = rod_on_ball_coefficient(2.75, 3.5, carbide) * force ** (2.0 / 3.0)
    tilt = recovery * 64.4 / (1.5 * probe.tripod.radius)
    assert found.displacements["seat_tilt"] == pytest.approx(tilt[:, None] * across, abs=1e-12)
    bent = (force * 50.0**3 * BENT)[:, None] * across
    assert found.displacements["stylus_bending"] == pytest.approx(bent, abs=1e-12)
    hertz = predict(probe, N, "analytic").displacements["tip_on_part"]
    assert found.displacements["tip_on_part"] == pytest.approx(hertz, rel=1e-12)
    rigid = predict(replace(probe, seats=replace(probe.seats, contact="rigid")), N, "ren")
    assert np.array_equal(rigid.displacements["seat_tilt"], np.zeros((4, 3)))
    assert rigid.displacements["stylus_bending"] == pytest.approx(bent, abs=1e-12)


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


def test_shen_bends_the_whole_lever_across_the_axis(probe: Probe) -> None:
    """64.4 mm, including the hub."""
    found = predict(probe, N, "shen")
    bent = found.force[:, None] * 64.4**3 * BENT * LATERAL
    assert found.displacements.keys() == {"stylus_bending"}
    assert found.displacements["stylus_bending"] == pytest.approx(bent, rel=1e-9)


def test_wozniak_is_the_constant_of_five_touches(probe: Probe) -> None:
    """Its mean over five touches is theirs; lobes of 1 / cos lie opposite the rods. The probe is
    not symmetric to the five touches: its first rod is turned."""
    rods = tuple(azimuth + 0.3 for azimuth in probe.tripod.rod_azimuths)
    turned = replace(probe, tripod=replace(probe.tripod, rod_azimuths=rods))

    def shape(polar: FloatArray, azimuth: FloatArray) -> FloatArray:
        from_lobe = np.mod(azimuth - (rods[0] + math.pi), 2.0 * math.pi / 3.0)
        return np.asarray(np.sin(polar) ** 2 / np.cos(from_lobe - math.pi / 3.0))

    polar, azimuth = np.radians([90.0] * 4 + [0.0]), np.radians([0.0, 90.0, 180.0, 270.0, 0.0])
    five = predict(turned, from_angles(polar, azimuth), "analytic").pretravel
    constant = five.sum() / shape(polar, azimuth).sum()
    found = predict(turned, N, "wozniak").displacements
    along = (constant * shape(POLAR, AZIMUTH))[:, None] * N
    assert found.keys() == {"wozniak"}
    assert found["wozniak"] == pytest.approx(along, rel=1e-9, abs=1e-15)
    assert constant > 1e-3


class TestFiniteElements:
    def reduced(self, probe: Probe) -> Any:
        """Of any flexibility, in two regions of one part and one of another."""
        statics, root = seat_statics(probe), np.random.default_rng(4).normal(size=(22, 22))
        resultants = np.zeros((6, 22))
        resultants[:, :9] = np.concatenate([statics.wrenches, statics.tip_wrenches], axis=1)
        one, two = 1e-6 * root @ root.T, np.diag(np.arange(1.0, 23.0)) * 1e-6
        return SimpleNamespace(
            resultants=resultants, seat_part="hub", patch_compliance=2e-5, ball_correction=3e-5,
            flexibility_by_region={"stylus 1": one, "hub": two, "stylus 2": two},
        )  # fmt: skip

    @pytest.mark.parametrize(("off", "refused"), [(0.9e-6, False), (1.1e-6, True)])
    @pytest.mark.parametrize("place", [(0, 3), (4, 7), (5, 8)])
    def test_seats_that_are_elsewhere(
        self, probe: Probe, off: float, refused: bool, place: tuple[int, int]
    ) -> None:
        """By more than a millionth of the lever, of the 64.4 mm from the rods to the tip."""
        reduced = self.reduced(probe)
        reduced.resultants[place] += off * 64.4
        if refused:
            with pytest.raises(PretravelError, match="seats and tip differ"):
                predict(probe, N, FiniteElements(reduced))
        else:
            predict(probe, N, FiniteElements(reduced))

    def test_regions_of_a_part_add_up(self, probe: Probe) -> None:
        """Virtual work: unit forces, and the reactions that balance them, on each region's
        flexibility. What lies under the seats loses the half-spaces, which Hertz's law contains;
        finite balls give more than half-spaces."""
        reduced, statics = self.reduced(probe), seat_statics(probe)
        one, two = (reduced.flexibility_by_region[name] for name in ("stylus 1", "hub"))
        found = predict(probe, N, FiniteElements(reduced))
        unit = np.zeros((3, 22))
        unit[:, :6], unit[:, 6:9] = statics.unit_reactions(np.eye(3)), np.eye(3)
        force = found.force[:, None] * N
        change = force @ unit[:, :6]
        hertz = sunk(probe, statics, found)
        expected = {
            "stylus": force @ unit @ (one + two) @ unit.T,
            "hub": force @ unit @ two @ unit.T - statics.tip_displacement(2e-5 * change),
            "seats": statics.tip_displacement(hertz + 3e-5 * change),
            "tip_on_part": predict(probe, N).displacements["tip_on_part"],
        }
        assert found.displacements.keys() == expected.keys()
        for name, moved in expected.items():
            assert found.displacements[name] == pytest.approx(moved, rel=1e-9, abs=1e-15), name

    def test_with_friction_they_are_given_or_made(
        self, probe: Probe, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """A body of its own for each cycle; a model that has none is refused."""
        asked: dict[str, Any] = {}

        def cycle(_: Probe, directions: FloatArray, friction: float, **others: Any) -> Any:
            asked.update(others)
            one = np.ones((len(directions), 1, 3))
            return SimpleNamespace(
                trigger_force=one[..., 0], trigger_displacement=one, tripod_displacement=one
            )

        given, made = SimpleNamespace(name="given"), SimpleNamespace(name="made")
        monkeypatch.setattr(predict_with_friction, "friction_cycle", cycle)
        monkeypatch.setattr(predict_with_friction, "reduced_model", lambda _: made)
        for reduced, used in ((given, given), (None, made)):
            model = FiniteElements(reduced)  # type: ignore[arg-type]
            predict_with_friction.rubbed_trigger(probe, N, model, STEEL)
            assert asked["body"] is used
        with pytest.raises(PretravelError, match="model 'ren' does not contain friction") as error:
            predict_with_friction.rubbed_trigger(probe, N, compliance_model("ren"), STEEL)
        assert error.value.inputs == ("model", "friction")


@pytest.mark.parametrize("model", ["analytic", "ren", "shen"])
def test_reactions_are_solved_once_for_a_prediction(
    probe: Probe, model: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    solve, calls = SeatStatics.unit_reactions, []

    def counted(statics: SeatStatics, directions: FloatArray) -> FloatArray:
        calls.append(len(directions))
        return solve(statics, directions)

    monkeypatch.setattr(SeatStatics, "unit_reactions", counted)
    predict(probe, N, model)
    assert calls == [len(N)]
