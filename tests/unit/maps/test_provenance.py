"""Where a map is from: what is kept of it, and what is usual for a reference."""

from __future__ import annotations

import math
from dataclasses import asdict, replace

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.base.quantities import STEEL_EXPANSION
from pretravel.maps.provenance import (
    AXIAL_PRETRAVEL,
    U_AXIAL_PRETRAVEL,
    USUAL_SPHERE_FORM,
    USUAL_U_DIAMETER,
    USUAL_U_TEMPERATURE,
    Origin,
    Provenance,
    QualificationSetup,
)


def test_what_is_stated_comes_back() -> None:
    setup = QualificationSetup(
        25.0, 6.0, ring=True, u_diameter=3e-4, u_temperature=0.5, sphere_form=1e-4,
        axial_pretravel=None, axis=(0.0, 0.6, 0.8), search_outliers=False,
    )  # fmt: skip
    stated = Provenance(
        Origin.QUALIFIED, "a", "b", "c", "d", level_known=False, probe="e", setup=setup,
        kind_settings={"x": 1.0}, reading="f", touch_digests="g", tip="h", orientation="i",
        center=(1.0, 2.0, 3.0),
    )  # fmt: skip
    kept = stated.as_dict()
    assert kept == {
        "origin": "qualified", "source": "a", "touches": "b", "touches_file": "c",
        "reading": "f", "gauge": "d", "probe": "e", "touch_digests": "g",
        "tip": "h", "orientation": "i", "level_known": False, "setup": asdict(setup),
        "center": [1.0, 2.0, 3.0], "kind_settings": {"x": 1.0},
    }  # fmt: skip
    assert Provenance.from_dict(kept) == stated
    assert Provenance.from_dict(kept | {"of a later version": 1}) == stated
    assert Provenance().as_dict() == {"origin": "made"}
    assert Provenance.from_dict({"origin": "made"}) == Provenance()
    with pytest.raises(PretravelError, match="three numbers"):
        Provenance.from_dict(kept | {"center": [1.0, 2.0]})
    with pytest.raises(KeyError):
        Provenance.from_dict({"source": "predicted"})


def test_the_uncertainty_of_the_diameter_by_hand() -> None:
    """0.3 µm calibrated; 11.5e-6 of 50 mm for each of 2 K are 1.15 µm."""
    setup = QualificationSetup(50.0, u_diameter=3e-4, u_temperature=2.0)
    assert setup.u_reference_diameter == pytest.approx(math.hypot(3e-4, 1.15e-3))
    usual = QualificationSetup(50.0)
    by_hand = math.hypot(2e-4, 11.5e-6 * 50.0 * 0.2)
    assert usual.u_reference_diameter == pytest.approx(by_hand)
    assert QualificationSetup(50.0, u_diameter=0.0, u_temperature=0.0).u_reference_diameter == 0


def test_what_is_usual() -> None:
    """U of 0.4 µm with k = 2; ISO 3290-1 grade 5; steel; a workshop near 20 °C."""
    setup = QualificationSetup(25.0)
    assert pytest.approx(0.4e-3 / 2.0) == USUAL_U_DIAMETER
    assert setup.sphere_form == USUAL_SPHERE_FORM == pytest.approx(0.13e-3)
    assert setup.u_temperature == USUAL_U_TEMPERATURE
    assert pytest.approx(11.5e-6) == STEEL_EXPANSION
    # The seats, the stylus and the tip of an OMP40-2 deflect by 1.2 µm along the axis.
    assert setup.axial_pretravel == AXIAL_PRETRAVEL
    assert pytest.approx(1.2e-3, rel=0.3) == AXIAL_PRETRAVEL
    assert pytest.approx(0.7e-3) == U_AXIAL_PRETRAVEL
    assert (setup.tip_diameter, setup.u_diameter) == (None, None)
    assert (setup.ring, setup.search_outliers, setup.axis) == (False, True, (0.0, 0.0, 1.0))
    assert (setup.reference, replace(setup, ring=True).reference) == ("sphere", "ring")
    assert QualificationSetup(25.0, axis=np.array([0, 1, 0])).axis == (0.0, 1.0, 0.0)


@pytest.mark.parametrize(
    "numbers",
    [
        {"diameter": 9e-4}, {"diameter": 1.1e4}, {"tip_diameter": 9e-4}, {"tip_diameter": 1001.0},
        {"u_diameter": -1e-9}, {"u_diameter": 1001.0}, {"u_temperature": -1e-9},
        {"u_temperature": 1001.0}, {"sphere_form": -1e-9}, {"sphere_form": 1001.0},
        {"axial_pretravel": 1001.0}, {"axial_pretravel": -1001.0}, {"diameter": math.nan},
        {"tip_diameter": math.inf}, {"tip_diameter": 0.0},
    ],
)  # fmt: skip
def test_references_that_there_are_not(numbers: dict[str, float]) -> None:
    with pytest.raises(PretravelError) as error:
        QualificationSetup(**{"diameter": 25.0, **numbers})
    assert error.value.inputs == (*numbers,)
