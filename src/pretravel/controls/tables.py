"""Maps as variables, macros and tables of controls other than LinuxCNC."""

from __future__ import annotations

from importlib.resources import files
from string import Formatter

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.controls.gcode import render
from pretravel.controls.lookup import (
    LookupTable,
    catmull_rom_text,
    describe_form,
    supported_band,
)
from pretravel.directions import from_angles
from pretravel.errors import PretravelError
from pretravel.maps.bases import SECTOR_NAMES
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.sector_tables import resampled_sectors, touched_sectors
from pretravel.units import DEGREE, MICROMETRE

_COMMON = ((101, 199), (500, 999))
"""Common variables; #100 takes the result of the lookup."""
_VECTORS = 10
"""The first of the eight vector radii, counted from the base variable."""


def _check_variables(base: int, count: int) -> None:
    last = base + count - 1
    if not any(low <= base and last <= high for low, high in _COMMON):
        raise PretravelError(
            f"--base {base}: variables {base} to {last} are not all common ones (#101 to #199, "
            "#500 to #999); others belong to the control"
        )


def renishaw_variables(
    pretravel_map: PretravelMap,
    *,
    base: int = 500,
    program: int = 9799,
    criterion: str = "max",
    travel: float = 0.0,
) -> str:
    """Macro variables of a vector calibration: two axis radii and eight vector radii.

    Parameters
    ----------
    pretravel_map : PretravelMap
    base : int
        Variable of the X radius, as the probing macros have it set.
    program : int
        Number of the program that sets them.
    criterion : str
        See `resampled_sectors`.
    travel : float
        Of the machine in the signal's delay, where the map is one of the probe at rest. [mm]

    Returns
    -------
    str
        A program to run once on the control. Offsets of the stylus (base + 2, base + 3) stay as
        they are.

    Raises
    ------
    PretravelError
        A base that is no common variable; a map that does not hold all around the equator.
    """
    _check_variables(base, _VECTORS + 8)
    table = resampled_sectors(pretravel_map, criterion)
    variables = [base, base + 1, *range(base + _VECTORS, base + _VECTORS + 8)]
    names = ["X radius", "Y radius", *(f"{name} degrees" for name in SECTOR_NAMES[2:])]
    radii = pretravel_map.tip_radius - table.pretravel - travel
    return render(
        "renishaw/vector_radii.nc",
        map=pretravel_map,
        program=program,
        base=base,
        last=variables[-1],
        resampled=table,
        touched=touched_sectors(pretravel_map),
        micrometre=MICROMETRE,
        radii=list(zip(variables, radii, names, strict=True)),
    )


def fanuc_macro(
    pretravel_map: PretravelMap,
    form: LookupTable,
    *,
    base: int = 500,
    program: int = 9750,
    travel: float = 0.0,
) -> str:
    """Two Macro B programs: one fills a table, one looks a direction up in it.

    Parameters
    ----------
    pretravel_map : PretravelMap
    form : LookupTable
        Of that map.
    base : int
        First common variable of the table.
    program : int
        Number of the program that fills it; the next one looks up:
        G65 P9751 I.. J.. K.. (outward unit normal) leaves the pretravel in #100, in mm,
        or -1 where the map does not hold.
    travel : float
        Of the machine in the signal's delay, where the map is one of the probe at rest. [mm]

    Returns
    -------
    str
        Not tried on a Fanuc control; its arithmetic was run by another interpreter.
    """
    rows, columns = form.values.shape
    _check_variables(base, rows * columns)
    return render(
        "fanuc/lookup.nc",
        map=pretravel_map,
        form=form,
        description=describe_form(form),
        base=base,
        program=program,
        travel=travel,
        columns=columns,
        lowest_deg=form.band.lowest / DEGREE,
        highest_deg=form.band.highest / DEGREE,
        polar_step_deg=form.polar_step / DEGREE,
        azimuth_step_deg=form.azimuth_step / DEGREE,
        catmull_rom=catmull_rom_text,
    )


def heidenhain_template() -> str:
    """The template that `heidenhain_table` fills when it is given none; to be edited."""
    return files("pretravel.controls").joinpath("templates/heidenhain.3DTC").read_text("utf-8")


def heidenhain_table(
    pretravel_map: PretravelMap,
    template: str | None = None,
    *,
    azimuth: float | None = None,
    step_deg: float = 5.0,
    travel: float = 0.0,
) -> str:
    """A table of deviation over the polar angle, as a template has it.

    Parameters
    ----------
    pretravel_map : PretravelMap
    template : str, optional
        Lines with ``{angle_deg}`` or ``{deviation_mm}`` stand for the rows (``{number}`` counts
        them); others may have ``{title}``, ``{where}`` and ``{residual_um}``.
    azimuth : float, optional
        Of a probe that the spindle turns so that it is always touched there; the mean all
        around when not given. [rad]
    step_deg : float

    Returns
    -------
    str
        The columns of such tables are not published: it is marked as unverified.

    Raises
    ------
    PretravelError
        A template with other names, or without rows.
    """
    text = heidenhain_template() if template is None else template
    band = supported_band(pretravel_map)
    low, high = band.lowest / DEGREE, band.highest / DEGREE
    if not step_deg > 0.0:
        raise PretravelError(f"--step {step_deg:g}: it must be positive, in degrees")
    angles = np.arange(np.ceil(low / step_deg), np.floor(high / step_deg) + 1.0) * step_deg
    around = np.arange(0.0, 360.0, 5.0) * DEGREE

    def values_at(azimuths: FloatArray) -> FloatArray:
        return np.array(
            [
                pretravel_map.pretravel(
                    from_angles(angle * DEGREE, azimuths) @ pretravel_map.rotation.T,
                    extrapolate=True,
                )
                for angle in angles
            ]
        )

    everywhere = values_at(around)
    mean = everywhere.mean(axis=1) if azimuth is None else values_at(np.array([azimuth]))[:, 0]
    residual = float(np.max(np.abs(everywhere - mean[:, None]))) / MICROMETRE
    where = "the mean over the azimuth" if azimuth is None else (
        f"the probe touched at azimuth {azimuth / DEGREE:g} degrees"
    )  # fmt: skip
    lines, rows = [], 0
    for number, line in enumerate(text.splitlines(), start=1):
        try:
            names = {name for _, name, _, _ in Formatter().parse(line) if name is not None}
            if names & {"angle_deg", "deviation_mm", "number"}:
                rows += 1
                lines += [
                    line.format(number=i, angle_deg=angle, deviation_mm=-value - travel)
                    for i, (angle, value) in enumerate(zip(angles, mean, strict=True))
                ]
            else:
                lines.append(line.format(title="pretravel", residual_um=residual, where=where))
        except (KeyError, ValueError, IndexError) as error:
            raise PretravelError(
                f"template, line {number}: {error}; known are number, angle_deg, deviation_mm (in "
                "rows), title, where and residual_um"
            ) from None
    if rows == 0:
        raise PretravelError("the template has no line with {angle_deg} and {deviation_mm}")
    return "\n".join(lines) + "\n"
