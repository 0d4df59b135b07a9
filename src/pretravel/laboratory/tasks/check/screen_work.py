"""What the screen Metrologist computes; nothing here touches a page."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from pretravel.app import Inputs, ShownResult, TaskForm, laboratory_file, with_file_names
from pretravel.base import MICROMETRE, FloatArray, Placement, probe_rotation, temporary_folder
from pretravel.design import Latch, simulate
from pretravel.files import LaboratoryStatements, write_touches
from pretravel.laboratory.standards.iso230_10 import plane_pattern_36
from pretravel.laboratory.tasks.check.task import Check, CheckedProbe, not_stated
from pretravel.surface import Sphere
from pretravel.task import patterns
from pretravel.touches import Targets, Touches

FORM = TaskForm(Check, shared=("units",), start={"standard": "iso10360-5"})


def check_by_standard(inputs: Inputs) -> ShownResult[CheckedProbe]:
    """Determine the figures of a standard.

    Raises
    ------
    PretravelError
        As `Check.run`; what the files are refused for.
    """
    settings, touches = inputs.settings, inputs.file("touches")
    numbers = FORM.given(settings)
    with temporary_folder() as folder:
        lab = laboratory_file(settings, folder)
        task = Check(touches=(touches,), map_file=inputs.optional_file("map"), lab=lab, **numbers)
        checked = task.run()
    # A certificate states what is open, too.
    shown = replace(checked, statements=checked.statements or LaboratoryStatements())
    document = shown.with_warnings(touches.name, not_stated(checked.result))
    return ShownResult(checked, document, with_file_names(task, output=Path("check.json")))


EXAMPLE_SETTINGS = {
    "diameter": 25.0,
    "tip_diameter": 6.0,
    "form_limit_um": 8.0,
    "u_diameter_um": 0.2,
    "sphere_form_um": 0.13,
    "offset_limit_um": 8.0,
    "ring": False,
}
_EXAMPLE_OFFSET = (0.004, -0.003, 0.0)  # mm, of the tip from the axis of the spindle


def example_touches(standard: str) -> tuple[str, bytes]:
    """Name and content of a file of simulated touches in the pattern of a standard.

    They are those of a probe of the catalogue, with 0.3 µm of scatter.
    """
    if standard == "iso230-10-tip-offset":
        touches = _touches_at_two_orientations()
    else:
        normals = patterns()[standard]()
        repeats = 3 if standard == "iso230-10" else 1
        touches = _simulated(np.repeat(normals, repeats, axis=0), _CENTER, seed=1)
    with temporary_folder() as folder:
        path = folder / f"example_{standard}.csv"
        write_touches(path, touches)
        return path.name, path.read_bytes()


_CENTER = (10.0, 20.0, 30.0)


def _simulated(normals: FloatArray, center: npt.ArrayLike, *, seed: int) -> Touches:
    """Touches of a probe of the catalogue on a sphere of 25 mm, with 0.3 µm of scatter."""
    middle = np.asarray(center, dtype=np.float64)
    targets = Targets(middle + 12.5 * normals, normals)
    latch = Latch(noise=0.3 * MICROMETRE, rng=seed)
    return simulate("omp40-2", Sphere(middle, 12.5), targets, latch=latch)


def _touches_at_two_orientations() -> Touches:
    """The equator with the spindle at 0° and 180°: the probe is turned, the sphere is not."""
    parts = []
    for seed, angle in enumerate((0.0, np.pi)):
        turn = probe_rotation(rotation=angle)
        single = _simulated(plane_pattern_36() @ turn, np.zeros(3), seed=seed)
        shift = np.asarray(_CENTER) - turn @ np.asarray(_EXAMPLE_OFFSET)
        parts.append(single.moved(Placement(rotation=turn, shift=shift)).with_spindle(angle))
    return Touches(
        np.vstack([part.positions for part in parts]),
        np.vstack([part.normals for part in parts]),
        spindle=np.concatenate([np.asarray(part.spindle) for part in parts]),
    )
