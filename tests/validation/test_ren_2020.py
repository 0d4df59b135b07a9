"""G. Ren, X. Qu, X. Chen, Sensors 20 (2020) 2413: the closed form of pretravel."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.model.hertz import ball_on_flat
from pretravel.trigger.closed_form import RenPretravel, ren_pretravel


def _terms(force: float) -> RenPretravel:
    """Section 4's numbers: n_delta 0.9744, E 200 and 620 kN/mm², R1 = R2 = 1 mm, r = 4 mm,
    L = 18 mm, L/La = 1.5, d = 2 mm, Poisson's ratios 0."""
    return ren_pretravel(
        force,
        lever=18.0,
        lever_ratio=1.5,
        stylus_diameter=2.0,
        stylus_modulus=200e3,
        contact_coefficient=0.9744,
        seat_radii=(1.0, 1.0),
        seat_moduli=(200e3, 200e3),
        tip_radius=4.0,
        tip_modulus=620e3,
        part_modulus=200e3,
    )


def test_equation_13_corrected() -> None:
    """The bending term as printed, to its five digits. The Hertz terms, from the paper's own
    equation 12 and numbers, are 6.41e-4 and 1.83e-4 mm/N^(2/3): ten times what it prints."""
    terms = _terms(1.0)
    assert float(terms.bending) == pytest.approx(0.012376, abs=5e-7)
    assert float(terms.rigid) == pytest.approx(6.41e-4, abs=5e-7)
    assert float(terms.compression) == pytest.approx(1.83e-4, abs=5e-7)
    assert float(terms.rigid) == pytest.approx(10 * 0.0000641, rel=2e-3)
    assert float(terms.compression) == pytest.approx(10 * 0.0000183, rel=2e-3)


def test_equation_12_powers_and_signs() -> None:
    one, eight = _terms(0.01), _terms(0.08)
    assert float(eight.rigid / one.rigid) == pytest.approx(4.0)
    assert float(eight.compression / one.compression) == pytest.approx(4.0)
    assert float(eight.bending / one.bending) == pytest.approx(8.0)
    assert float(one.pretravel) == pytest.approx(
        float(one.rigid + one.bending - one.compression), rel=1e-15
    )


def test_equation_11_is_hertz() -> None:
    """0.8255 is (9/16)^(1/3) to four digits, with r as the ball's radius."""
    modulus = 1.0 / (1.0 / 620e3 + 1.0 / 200e3)
    expected = ball_on_flat(0.082, 4.0, modulus)
    assert float(_terms(0.082).compression) == pytest.approx(float(expected), rel=1e-4)


def test_vectorised() -> None:
    assert _terms(np.array([0.1, 0.2])).pretravel.shape == (2,)  # type: ignore[arg-type]
