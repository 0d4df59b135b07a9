"""What is typed in µm, degrees and 1e-6/K means mm, rad and 1/K inside.

Command, screen and Python lines share the task: a comparison of them with each other does not
show a wrong factor.
"""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.drawing.tasks.measure import Measure
from pretravel.laboratory.tasks.rig import Rig
from pretravel.task.example_data import example_folder
from pretravel.tasks.qualify import Qualify

TYPED = Qualify(
    touches="touches.csv",
    diameter=25,
    tip_diameter=6,
    kind="auto",
    u_diameter_um=0.15,
    sphere_form_um=0.08,
    axial_pretravel_um="1.2",
    lobe_azimuth_deg=30,
)


def test_an_uncertainty_that_was_typed_in_mm_is_refused() -> None:
    """1.5 µm as 0.0015: all parts conformed."""
    with pytest.raises(PretravelError, match=r"u machine is 0\.0015 µm; .* 1\.5 µm typed in mm"):
        Measure(points="points.csv", feature="bore", u_machine_um=0.0015)
    assert Measure(points="points.csv", feature="bore", u_machine_um=0.0).u_machine_um == 0.0


def test_the_reference_of_a_qualification() -> None:
    setup = TYPED.setup()
    assert (setup.diameter, setup.tip_diameter) == (25.0, 6.0)
    assert setup.u_diameter == pytest.approx(0.15e-3, rel=1e-12)
    assert setup.sphere_form == pytest.approx(0.08e-3, rel=1e-12)
    assert setup.axial_pretravel == pytest.approx(1.2e-3, rel=1e-12)
    assert TYPED.kind_of_map("wozniak").lobe_azimuth == pytest.approx(np.pi / 6.0, rel=1e-12)


def test_the_expansion_of_a_rigs_ruler() -> None:
    """A ruler of 8e-6/K that is 10 K above 20 °C is longer by 80 millionths than it states."""
    traces = str(example_folder() / "rig")
    cold = Rig(traces=traces).run().traces[0].ruler
    warm = Rig(traces=traces, temperature=30.0, expansion=8.0).run().traces[0].ruler
    assert np.ptp(warm) / np.ptp(cold) - 1.0 == pytest.approx(80e-6, rel=1e-6)
