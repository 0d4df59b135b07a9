"""Rodrigues 2021: its inputs and the equations that need no table, against numpy."""

from __future__ import annotations

import math

import numpy as np
import pytest

from pretravel.base.directions import azimuth_angle, polar_angle
from pretravel.design.probing.slides import slide
from pretravel.design.probing.tip import predicted_tip
from pretravel.maps.kinds.mean import MeanBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.measurement.compensation import embed
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.materials import material
from pretravel.prediction.trigger import predict
from pretravel.surface.parametric import FunctionSurface
from pretravel.surface.specification import parse_surface
from pretravel.uncertainty.covariance import Covariance
from tests.support.statics_by_hand import direction, first_contact_force


@pytest.mark.published(
    "Rodrigues 2021", "Table 2.1",
    what="materials",
    ours="catalogue",
    theirs="the same",
    verdict="agrees (inputs)",
)  # fmt: skip
@pytest.mark.published(
    "Rodrigues 2021", "Tables 3.1, 3.2",
    what="parameters of the probe",
    ours="catalogue",
    theirs="the same",
    verdict="agrees (inputs)",
)  # fmt: skip
@pytest.mark.published(
    "Rodrigues 2021", "Table 4.12",
    what="baseline of section 4.6",
    ours="catalogue",
    theirs="the same",
    verdict="agrees (inputs)",
)  # fmt: skip
@pytest.mark.published(
    "Rodrigues 2021", "Table 4.13",
    what="moduli, 686 and 413 GPa",
    ours="the same",
    theirs="the same",
    verdict="agrees (inputs)",
)  # fmt: skip
def test_tables_2_1_3_1_3_2_4_12_and_4_13_are_the_catalogue() -> None:
    """Inputs: preload, stylus, seats, materials and their moduli in GPa."""
    for name, length in (("omp40-2", 50.0), ("omp40-2-100mm", 100.0)):
        probe = load_probe(name)
        assert probe.preload == 5.91
        assert probe.stylus_length == length
        assert probe.stem.diameter == 4.5
        assert math.degrees(probe.seats.support_angle) == pytest.approx(27.266)
        assert probe.tripod.radius == 16.34
        assert [segment.material.name for segment in probe.stylus] == ["stainless steel", "ceramic"]
        assert {probe.tripod.material.name, probe.seats.material.name} == {"tungsten carbide"}
        assert probe.tip.material.name == "ruby"
        assert probe.tip.radius == 3.0
    for name, gigapascal in (("tungsten carbide", 686.0), ("ceramic", 413.0)):
        assert material(name).youngs_modulus == pytest.approx(1e3 * gigapascal)


@pytest.mark.published(
    "Rodrigues 2021", "Equation 2.1",
    what="latched radius of a gauge ball",
    ours="r_G + r_ST − r; ring r_G − r_ST + r",
    theirs="r_G + r_ST + r",
    verdict="differs: sign",
)  # fmt: skip
def test_equation_2_1_measured_radius() -> None:
    """Of a ball that is touched from outside the latched radius is r_G + r_ST - r, since the
    spindle goes on towards the ball; the thesis prints + r. In a ring it is r_G - r_ST + r."""
    gauge, tip, pretravel = 12.5, 3.0, 0.016
    nodes = np.eye(3)
    made = PretravelMap(
        MeanBasis(), np.array([pretravel]), Covariance.independent([1e-8]), DirectionSupport(nodes),
        tip_radius=tip,
    )  # fmt: skip
    x = np.eye(3)[[0]]
    outside = embed(gauge * x, x, made).positions[0, 0]
    assert outside == pytest.approx(gauge + tip - pretravel)
    inside = embed(gauge * x, -x, made, extrapolate=True).positions[0, 0]
    assert inside == pytest.approx(gauge - tip + pretravel)


@pytest.mark.published(
    "Rodrigues 2021", "Equation 3.1",
    what="sensing distance is the largest deflection",
    ours="the deflection at the trigger",
    theirs="the same",
    verdict="agrees",
)  # fmt: skip
@pytest.mark.published(
    "Rodrigues 2021", "Equation 3.2",
    what="d_s = d_f / cos θ, θ from the vertical",
    ours="the same to 1e-9; 1/sin of the normal's polar angle",
    theirs="the same",
    verdict="agrees",
)  # fmt: skip
def test_equations_3_1_and_3_2() -> None:
    """The sensing distance is the largest deflection before the trigger; on a plane at tilt θ from
    the vertical it is the feed over cos θ."""
    tilt = 25.0
    history = slide(
        predicted_tip(load_probe("omp40-2")), parse_surface(f"plane:polar={90 - tilt:g}"), (0, 0)
    )
    ratio = history.deflection / history.feed
    assert ratio == pytest.approx(1.0 / math.cos(math.radians(tilt)), rel=1e-9)
    assert np.all(np.diff(history.deflection) > 0.0)


@pytest.mark.published(
    "Rodrigues 2021", "Equations 3.3, 3.4",
    what="azimuth and polar angle of a normal",
    ours="the same, in four quarters",
    theirs="arctan of the ratio",
    verdict="agrees",
)  # fmt: skip
def test_equations_3_3_and_3_4() -> None:
    """Azimuth and polar angle of a normal, in all four quarters (3.3 has two of them)."""
    normals = np.array([direction(polar, azimuth) for polar, azimuth in
                        ((20.0, 30.0), (70.0, 150.0), (110.0, 250.0), (90.0, 330.0))])  # fmt: skip
    assert polar_angle(normals) == pytest.approx(np.arccos(normals[:, 2]))
    azimuth = np.arctan2(normals[:, 1], normals[:, 0])
    assert np.mod(azimuth_angle(normals) - azimuth, 2.0 * np.pi) == pytest.approx(0.0, abs=1e-12)
    assert np.tan(azimuth) == pytest.approx(normals[:, 1] / normals[:, 0])


@pytest.mark.published(
    "Rodrigues 2021", "Equations 3.8, 3.9",
    what="normal of z = f(x, y), and across the axis",
    ours="the same to 1e-9",
    theirs="the same",
    verdict="agrees",
)  # fmt: skip
def test_equations_3_8_and_3_9() -> None:
    """Of z = f(x, y) the normal is (-f_x, -f_y, 1), by differences; across the axis two of them."""

    def height(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        return np.asarray(2.0 * np.sin(0.3 * u) + 0.1 * u * v)

    surface = FunctionSurface(lambda u, v: (u, v, height(u, v)), (-5.0, 5.0), (-5.0, 5.0))
    at, h = np.array([[1.3, -0.7]]), 1e-5
    u, v = at[:, 0], at[:, 1]
    slope_u = (height(u + h, v) - height(u - h, v)) / (2.0 * h)
    slope_v = (height(u, v + h) - height(u, v - h)) / (2.0 * h)
    expected = np.array([-slope_u[0], -slope_v[0], 1.0])
    normal = surface.local(at).normal[0]
    assert normal == pytest.approx(expected / np.linalg.norm(expected), abs=1e-9)
    assert normal[0] / normal[1] == pytest.approx(expected[0] / expected[1])


@pytest.mark.published(
    "Rodrigues 2021", "Figures 4.1 to 4.6",
    what="golden-section search for the trigger",
    ours="closed form, within 1e-7 N of the search; `slide --search golden` has the force of"
    " every trial",
    theirs="forty steps of it",
    verdict="agrees (differs: no search)",
)  # fmt: skip
def test_section_4_2_golden_section_search() -> None:
    """Figures 4.1 to 4.6 search the force between 0 and 5 N, interval times 0.618 a step, for the
    first seat that opens; here the force is a closed form. Forty steps end within 1e-7 N of it."""
    golden = 0.5 * (math.sqrt(5.0) - 1.0)
    probe = load_probe("omp40-2")
    for polar, azimuth in ((90.0, 0.0), (90.0, 50.0), (40.0, 20.0)):
        normal = direction(polar, azimuth)
        lifts = first_contact_force(normal, probe.lever)
        low, high = 0.0, 5.0
        for _ in range(40):
            d = golden * (high - low)
            first, second = high - d, low + d
            if first >= lifts:  # case 1: triggers at both
                high = first
            elif second < lifts:  # case 2: at neither
                low = second
            else:  # case 3
                low, high = first, second
        found = float(predict(probe, normal[None], "shen").force[0])
        assert 0.5 * (low + high) == pytest.approx(found, abs=1e-7)
