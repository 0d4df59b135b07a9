"""Tables of deviation over the polar angle for Heidenhain controls, from an editable template."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from importlib.resources import files
from string import Formatter

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, FloatArray, PretravelError, from_angles
from pretravel.controls.control import Control, ExportedFiles, ExportSettings, single_file
from pretravel.controls.control_table import TableSettings, check_radii, conditions_statements
from pretravel.controls.lookup import supported_band
from pretravel.controls.steps import same_steps
from pretravel.maps import PretravelMap

_ROW_NAMES = {"angle_deg", "deviation_mm", "number"}
_TITLE_NAMES = {"title", "where", "residual_um", "conditions"}
_FORM = re.compile(r"[<>^=]?[+ -]?0?\d{0,2}(\.\d{1,2})?[defgs]?")
"""Forms of Python's format that a template may have."""
_AROUND = np.arange(0.0, 360.0, 5.0) * DEGREE
"""Azimuths of the mean, and of the largest residual. [rad]"""
_FINE_DEG = 1.0
"""Step of the polar angles at which the interpolation between rows is compared. [degrees]"""


def heidenhain_template() -> str:
    """The default template of `heidenhain_table`, to be edited."""
    template = files("pretravel.controls").joinpath("templates/heidenhain.3DTC")
    return template.read_text("utf-8")


def heidenhain_table(
    pretravel_map: PretravelMap,
    template: str | None = None,
    *,
    azimuth: float | None = None,
    step_deg: float = 5.0,
    travel: float = 0.0,
    feed: float | None = None,
) -> str:
    """A table of deviation over the polar angle, in the layout of a template.

    Parameters
    ----------
    pretravel_map : PretravelMap
    template : str, optional
        Lines with ``{angle_deg}`` or ``{deviation_mm}`` stand for the rows (``{number}`` counts
        them); other lines may contain ``{title}``, ``{where}``, ``{conditions}`` (feed, tip and
        orientation) and ``{residual_um}``.
    azimuth : float, optional
        Azimuth of all touches, of a probe that the spindle turns; the mean over the azimuth when
        not given. [rad]
    step_deg : float
        Step of the polar angle. [degrees]
    travel : float
        Travel of the machine during the signal delay, for a map of the probe at rest. [mm]
    feed : float, optional
        Measuring feed of that travel. [mm/min]

    Returns
    -------
    str
        No description of the columns was found; the table states that it is unverified.

    Raises
    ------
    PretravelError
        A template with other names, or without rows; numbers that are not those of a touch-trigger
        probe.
    """
    if not step_deg > 0.0:
        raise PretravelError(f"a step of {step_deg:g}° of the polar angle: it must be positive")
    text = heidenhain_template() if template is None else template
    profile = _profile(pretravel_map, azimuth, step_deg)
    conditions = conditions_statements(pretravel_map, TableSettings(feed=feed))
    profile = replace(profile, conditions="; ".join(conditions))
    check_radii(pretravel_map, profile.pretravel + travel)
    lines, has_rows = [], False
    for number, line in enumerate(text.splitlines(), start=1):
        try:
            has_rows |= bool(_names(line) & _ROW_NAMES)
            lines += _filled(line, profile, travel)
        except (KeyError, ValueError, IndexError) as error:
            raise PretravelError(
                f"template, line {number}: {error}; a template may contain number, angle_deg, "
                "deviation_mm (in rows), title, where, conditions and residual_um"
            ) from None
    if not has_rows:
        raise PretravelError("the template has no line with {angle_deg} and {deviation_mm}")
    return "\n".join(lines) + "\n"


@dataclass(frozen=True, eq=False)
class _Profile:
    """Pretravel over the polar angle, and the part of it that depends on the azimuth.

    Attributes
    ----------
    angles_deg, pretravel : (n,) float
        [degrees], [mm]
    residual : float
        Largest difference at any azimuth, of the rows and of straight lines between them. [mm]
    where : str
        The azimuths for which it holds.
    conditions : str
        Feed, tip and orientation for which it holds.
    """

    angles_deg: FloatArray
    pretravel: FloatArray
    residual: float
    where: str
    conditions: str = ""


def _profile(pretravel_map: PretravelMap, azimuth: float | None, step_deg: float) -> _Profile:
    band = supported_band(pretravel_map)
    low, high = band.lowest / DEGREE, band.highest / DEGREE
    angles = np.arange(np.ceil(low / step_deg), np.floor(high / step_deg) + 1.0) * step_deg
    if len(angles) == 0:
        raise PretravelError(
            f"the map holds from {low:.1f}° to {high:.1f}° from the probe axis, and a table with "
            f"rows every {step_deg:g}° has none there"
        )
    fine = np.union1d(angles, np.arange(float(angles[0]), float(angles[-1]), _FINE_DEG))
    everywhere = _pretravel(pretravel_map, fine, _AROUND)
    if azimuth is None:
        values = everywhere.mean(axis=1)[np.searchsorted(fine, angles)]
        where = "the mean over the azimuth"
    else:
        values = _pretravel(pretravel_map, angles, np.array([azimuth]))[:, 0]
        where = f"the probe touched at azimuth {azimuth / DEGREE + 0.0:g} degrees"
    residual = float(np.max(np.abs(everywhere - np.interp(fine, angles, values)[:, None])))
    return _Profile(angles, values, residual, where)


def _pretravel(
    pretravel_map: PretravelMap, angles_deg: FloatArray, azimuths: FloatArray
) -> FloatArray:
    """(polar, azimuth) in the probe frame. [mm]"""
    rows = [
        pretravel_map.pretravel(
            from_angles(angle * DEGREE, azimuths) @ pretravel_map.rotation.T, extrapolate=True
        )
        for angle in angles_deg
    ]
    return np.array(rows)


def _filled(line: str, profile: _Profile, travel: float) -> list[str]:
    """The lines for a line of a template: one for each angle, or one alone."""
    if _names(line) & _ROW_NAMES:
        rows = zip(profile.angles_deg, profile.pretravel, strict=True)
        return [
            line.format(number=i, angle_deg=angle, deviation_mm=-value - travel)
            for i, (angle, value) in enumerate(rows)
        ]
    residual = profile.residual / MICROMETRE
    where, conditions = profile.where, profile.conditions
    return [
        line.format(title="pretravel", residual_um=residual, where=where, conditions=conditions)
    ]


def _names(line: str) -> set[str]:
    """The names in a line; parts of values (``{title.x}``) and widths without limit are refused."""
    found = set()
    for _, name, form, conversion in Formatter().parse(line):
        if name is None:
            continue
        if name not in _ROW_NAMES | _TITLE_NAMES:
            raise ValueError(f"{{{name}}} is not known")
        if conversion or not _FORM.fullmatch(form or ""):
            raise ValueError(
                f"the number format of {{{name}}} cannot be used; write one such as +.5f"
            )
        found.add(name)
    return found


def _heidenhain(pretravel_map: PretravelMap, settings: ExportSettings) -> ExportedFiles:
    text = heidenhain_table(
        pretravel_map,
        settings.template,
        azimuth=settings.azimuth,
        travel=settings.travel,
        feed=settings.feed,
    )
    return single_file(
        text, ("the columns are not verified: compare them with those of your control",)
    )


TO_HEIDENHAIN = Control(
    _heidenhain,
    "Heidenhain (table, not verified)",
    same_steps(
        "This table has not been compared with one of a control: its columns are a template.",
        "Compare it with a table that your control wrote before you use it.",
    ),
    options=frozenset({"template", "azimuth"}),
    ending=".3DTC",
)
