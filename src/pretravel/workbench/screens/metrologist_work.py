"""What the screen Metrologist computes; nothing here touches a page."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pretravel.formats.file_format import ReadingOptions
from pretravel.formats.map_file import read_map
from pretravel.formats.several_files import read_series
from pretravel.formats.touches_csv import write_touches
from pretravel.jobs.check import CheckedProbe, CheckSetup, check_probe
from pretravel.laboratory.certificate import LaboratoryStatements
from pretravel.laboratory.standard_check import CalibratedSphere
from pretravel.laboratory.standards import PATTERNS
from pretravel.probing.simulation import Latch, simulate
from pretravel.probing.targets import Targets
from pretravel.report.document import Document
from pretravel.surface.shapes import Sphere
from pretravel.units import MICROMETRE
from pretravel.whole_file import temporary_folder
from pretravel.workbench.components.statements import stated
from pretravel.workbench.project import SettingValue
from pretravel.workbench.tasks import Inputs

LIMITS = {
    "form_limit_um": ("--form-limit", ("form", "form2d", "form3d")),
    "size_limit_um": ("--size-limit", ("size",)),
    "repeat_limit_um": ("--repeat-limit", ("repeatability",)),
}
"""Settings of limits, their options, and the figures that they are of."""
OPTIONS = {
    "diameter": "--diameter",
    "tip_diameter": "--tip-diameter",
    "u_diameter_um": "--u-diameter",
    "sphere_form_um": "--sphere-form",
    "units": "--units",
}
CHECK_SETTINGS = ("standard", *OPTIONS, *LIMITS, "statements")


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
    allowed = dict(inputs.settings)
    if standard == "iso230-10":  # the fields of the other standard are not shown
        for name in ("size_limit_um", "u_diameter_um"):
            allowed.pop(name, None)
    else:
        allowed.pop("repeat_limit_um", None)
    diameter, tip = float(get("diameter", 25.0)), get("tip_diameter")
    setup = CheckSetup(
        standard,
        CalibratedSphere(
            diameter, _length(allowed, "u_diameter_um"), _length(allowed, "sphere_form_um")
        ),
        tip,
        limits={
            figure: float(allowed[name]) * MICROMETRE
            for name, (_, figures) in LIMITS.items()
            if allowed.get(name) is not None
            for figure in figures
        },
    )
    map_file, touches = inputs.optional_file("map"), inputs.file("touches")
    options = ReadingOptions(
        units=get("units") or None,
        tip_radius=None if tip is None else 0.5 * tip,
        reference_diameter=diameter,
    )
    readings = read_series([touches], options).in_machine_axes()
    pretravel_map = None if map_file is None else read_map(map_file, tip_diameter=tip)
    checked = check_probe(readings, setup, pretravel_map)
    given = get("statements", {})
    statements = stated(given)
    document = checked.document(touches.name, warnings=_not_stated(setup), statements=statements)
    map_name = None if map_file is None else map_file.name
    return CheckResult(
        checked,
        document,
        statements if given else None,
        _command(standard, touches.name, map_name, allowed),
        _python(setup, touches.name, map_name, options),
    )


def _not_stated(setup: CheckSetup) -> list[str]:
    lacking = []
    if setup.limits and setup.sphere.form is None:
        lacking.append("form error")
    if "size" in setup.limits and setup.sphere.u_diameter is None:
        lacking.append("standard uncertainty of the diameter")
    if not lacking:
        return []
    needed = " and the ".join(lacking)
    what = "the values are compared with their limits without an uncertainty zone"
    return [f"{what}: state the {needed} of the reference"]


def _length(values: Mapping[str, SettingValue], name: str) -> float | None:
    given = values.get(name)
    return None if given is None else float(given) * MICROMETRE


def _command(
    standard: str, touches: str, map_name: str | None, values: Mapping[str, SettingValue]
) -> str:
    words = ["pretravel", "check", standard, touches]
    shown = {"diameter": 25.0} | dict(values)
    named = OPTIONS | {name: option for name, (option, _) in LIMITS.items()}
    for name, option in named.items():
        value = shown.get(name)
        if value not in (None, ""):
            words += [option, value if isinstance(value, str) else f"{value:.12g}"]
    words += [] if map_name is None else ["--map", map_name]
    return shlex.join([*words, "-o", "check.json"])


def _python(setup: CheckSetup, touches: str, map_name: str | None, options: ReadingOptions) -> str:
    given = f"tip_radius={options.tip_radius!r}, units={options.units!r}"
    return "\n".join(
        (
            "from pathlib import Path",
            "from pretravel.formats.file_format import ReadingOptions",
            "from pretravel.formats.map_file import read_map",
            "from pretravel.formats.several_files import read_series",
            "from pretravel.jobs.check import CheckSetup, check_probe",
            "from pretravel.laboratory.standard_check import CalibratedSphere",
            "",
            f"options = ReadingOptions({given}, reference_diameter={setup.sphere.diameter!r})",
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
}


def example_touches(standard: str) -> tuple[str, bytes]:
    """Name and content of a file of simulated touches in the pattern of a standard.

    They are those of a probe of the catalogue, with 0.3 µm of scatter.
    """
    normals = PATTERNS[standard]()
    if standard == "iso230-10":
        normals = np.repeat(normals, 3, axis=0)
    center = np.array([10.0, 20.0, 30.0])
    targets = Targets(center + 12.5 * normals, normals)
    latch = Latch(noise=0.3 * MICROMETRE, seed=1)
    touches = simulate("omp40-2", Sphere(center, 12.5), targets, latch=latch)
    with temporary_folder() as folder:
        path = folder / f"example_{standard}.csv"
        write_touches(path, touches)
        return path.name, path.read_bytes()
