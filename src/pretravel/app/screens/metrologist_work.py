"""What the screen Metrologist computes; nothing here touches a page."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from pretravel.app.components.statements import stated
from pretravel.app.project import SettingValue
from pretravel.app.tasks import Inputs
from pretravel.base.arrays import FloatArray
from pretravel.base.frames import Placement, probe_rotation
from pretravel.base.units import MICROMETRE
from pretravel.base.whole_file import temporary_folder
from pretravel.files.file_format import ReadingOptions
from pretravel.files.map_file import read_map
from pretravel.files.several_files import read_series
from pretravel.files.touches_csv import write_touches
from pretravel.laboratory.certificate import LaboratoryStatements
from pretravel.laboratory.iso230_10 import plane_pattern_36
from pretravel.laboratory.standard_check import CalibratedSphere
from pretravel.laboratory.standards import LIMITS_OF, PATTERNS, USES
from pretravel.probing.simulation import Latch, simulate
from pretravel.probing.targets import Targets
from pretravel.show.document import Document
from pretravel.surface.shapes import Sphere
from pretravel.tasks.check import (
    CheckedProbe,
    CheckSetup,
    check_probe,
    not_stated,
    stated_limits,
)
from pretravel.touches import Touches, moved, with_spindle

LIMITS = {
    "form_limit_um": ("--form-limit", "form"),
    "size_limit_um": ("--size-limit", "size"),
    "repeat_limit_um": ("--repeat-limit", "repeatability"),
    "offset_limit_um": ("--offset-limit", "offset"),
}
"""Settings of limits, their options, and what they limit."""
_USED = {"u_diameter_um": "u_diameter", "sphere_form_um": "sphere_form", "ring": "ring"}
"""Settings that not every standard uses, by their names in `USES`."""
OPTIONS = {
    "diameter": "--diameter",
    "tip_diameter": "--tip-diameter",
    "u_diameter_um": "--u-diameter",
    "sphere_form_um": "--sphere-form",
    "units": "--units",
}
CHECK_SETTINGS = ("standard", *OPTIONS, *LIMITS, "ring", "statements")


def has_field(standard: str, name: str) -> bool:
    """Whether a setting goes with a standard.

    >>> has_field("iso230-10", "size_limit_um"), has_field("iso230-10", "diameter")
    (False, True)
    """
    if name in LIMITS:
        return bool(LIMITS_OF[standard] & stated_limits(**{LIMITS[name][1]: 0.0}).keys())
    return name not in _USED or _USED[name] in USES[standard]


@dataclass(frozen=True)
class CheckResult:
    """A check with its report.

    Attributes
    ----------
    checked : CheckedProbe
    document : Document
    statements : LaboratoryStatements or None
        None where nothing is stated.
    command, python : str
        The command and the lines of Python that do the same.
    """

    checked: CheckedProbe
    document: Document
    statements: LaboratoryStatements | None
    command: str
    python: str


def check_by_standard(inputs: Inputs) -> CheckResult:
    """Determine the figures of a standard.

    Raises
    ------
    PretravelError
        As `check_probe`; what the files are refused for.
    """
    get = inputs.settings.get
    standard = str(get("standard", "iso10360-5"))
    # The fields of another standard are not shown, and do not count.
    allowed = {name: v for name, v in inputs.settings.items() if has_field(standard, name)}
    ring = bool(allowed.get("ring", False))
    diameter, tip = float(get("diameter", 25.0)), get("tip_diameter")
    limits = {what: _length(allowed, name) for name, (_, what) in LIMITS.items()}
    setup = CheckSetup(
        standard,
        CalibratedSphere(
            diameter, _length(allowed, "u_diameter_um"), _length(allowed, "sphere_form_um")
        ),
        tip,
        limits=stated_limits(**limits),
    )
    map_file, touches = inputs.optional_file("map"), inputs.file("touches")
    setup.check_inputs(() if map_file is None else ("map",))
    options = ReadingOptions(
        units=get("units") or None,
        tip_radius=None if tip is None else 0.5 * tip,
        reference_diameter=diameter,
        ring=ring,
    )
    readings = read_series([touches], options).in_machine_axes()
    pretravel_map = None if map_file is None else read_map(map_file, tip_diameter=tip)
    checked = check_probe(readings, setup, pretravel_map)
    given = get("statements", {})
    statements = stated(given)
    lacking = not_stated(checked.result)
    document = checked.document(touches.name, warnings=lacking, statements=statements)
    map_name = None if map_file is None else map_file.name
    return CheckResult(
        checked,
        document,
        statements if given else None,
        _command(standard, touches.name, map_name, allowed),
        _python(setup, touches.name, map_name, options),
    )


def _length(values: Mapping[str, SettingValue], name: str) -> float | None:
    given = values.get(name)
    return None if given is None else float(given) * MICROMETRE


def _command(
    standard: str, touches: str, map_name: str | None, values: Mapping[str, SettingValue]
) -> str:
    words = ["pretravel", "check", standard, touches]
    shown = {"diameter": 25.0} | dict(values)
    for name, option in (OPTIONS | {name: option for name, (option, _) in LIMITS.items()}).items():
        value = shown.get(name)
        if value not in (None, ""):
            words += [option, value if isinstance(value, str) else f"{value:.12g}"]
    words += ["--ring"] if values.get("ring") else []
    words += [] if map_name is None else ["--map", map_name]
    return shlex.join([*words, "-o", "check.json"])


def _python(setup: CheckSetup, touches: str, map_name: str | None, options: ReadingOptions) -> str:
    given = f"tip_radius={options.tip_radius!r}, units={options.units!r}, ring={options.ring!r}"
    return "\n".join(
        (
            "from pathlib import Path",
            "from pretravel.files.file_format import ReadingOptions",
            "from pretravel.files.map_file import read_map",
            "from pretravel.files.several_files import read_series",
            "from pretravel.tasks.check import CheckSetup, check_probe",
            "from pretravel.laboratory.standard_check import CalibratedSphere",
            "",
            f"options = ReadingOptions({given},",
            f"                         reference_diameter={setup.sphere.diameter!r})",
            f"readings = read_series([Path({touches!r})], options).in_machine_axes()",
            f"probe_map = {'None' if map_name is None else f'read_map({map_name!r})'}",
            f"setup = CheckSetup({setup.standard!r}, {setup.sphere!r},",
            f"                   tip_diameter={setup.tip_diameter!r}, limits={setup.limits!r})",
            "for figure in check_probe(readings, setup, probe_map).result.figures:",
            "    print(figure.name, figure.value, figure.outcome.value)",
        )
    )


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
        normals = PATTERNS[standard]()
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
    latch = Latch(noise=0.3 * MICROMETRE, seed=seed)
    return simulate("omp40-2", Sphere(middle, 12.5), targets, latch=latch)


def _touches_at_two_orientations() -> Touches:
    """The equator with the spindle at 0° and 180°: the probe is turned, the sphere is not."""
    parts = []
    for seed, angle in enumerate((0.0, np.pi)):
        turn = probe_rotation(rotation=angle)
        single = _simulated(plane_pattern_36() @ turn, np.zeros(3), seed=seed)
        shift = np.asarray(_CENTER) - turn @ np.asarray(_EXAMPLE_OFFSET)
        parts.append(with_spindle(moved(single, Placement(rotation=turn, shift=shift)), angle))
    return Touches(
        np.vstack([part.positions for part in parts]),
        np.vstack([part.normals for part in parts]),
        spindle=np.concatenate([np.asarray(part.spindle) for part in parts]),
    )
