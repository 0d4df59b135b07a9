"""Results of the calibration laboratory as text: strings for people, nothing is printed here."""

from __future__ import annotations

import math

import numpy as np

from pretravel.compensation.measured_sphere import MeasuredSphere
from pretravel.identification.probe import FREE, Identification
from pretravel.laboratory.rig_calibration import RigCalibration, Spread
from pretravel.laboratory.separation import Separation
from pretravel.laboratory.separation_plan import SeparationPlan
from pretravel.laboratory.standard_check import StandardCheck
from pretravel.report.words import labelled, table
from pretravel.uncertainty.gum import COVERAGE, Budget
from pretravel.units import DEGREE, MICROMETRE

_SQUARE = MICROMETRE**2


def _um(value: float, digits: int = 3) -> str:
    return "unknown" if math.isnan(value) else f"{value / MICROMETRE:.{digits}f} µm"


def _spread(spread: Spread) -> str:
    if math.isnan(spread.value):
        return "unknown: nothing was repeated"
    return (
        f"{_um(spread.value)}, {100 * COVERAGE:.0f} % interval {spread.low / MICROMETRE:.3f} to "
        f"{spread.high / MICROMETRE:.3f} µm ({spread.dof:.0f} degrees of freedom)"
    )


def rig_report(calibration: RigCalibration) -> str:
    """What a calibration on the rig states, overall and by direction.

    Returns
    -------
    str
    """
    low, high = calibration.anisotropy_interval / MICROMETRE
    interval = "" if math.isnan(low) else f", interval {low:.3f} to {high:.3f} µm"
    u_mean = calibration.u_pretravel
    readings = [t.u_pretravel for t in calibration.touches if math.isfinite(t.u_pretravel)]
    reading = float(np.mean(readings))
    lines = [
        f"{len(calibration.touches)} traces, {len(calibration.directions)} directions",
        f"  pretravel r1 - r0  {_um(calibration.pretravel)} mean of the directions"
        + ("" if math.isnan(u_mean) else f" (repeats alone: u = {_um(u_mean)})"),
        f"  anisotropy         {_um(calibration.anisotropy)} largest less smallest{interval}",
        *labelled("repeatability", f"{_spread(calibration.repeatability)}, unidirectional, pooled"),
        f"  of that, sampling  {_um(reading)} on a single pretravel: edges lie between samples",
        (
            f"  hysteresis r3 - r0 {_um(calibration.hysteresis)} mean, "
            f"{_um(calibration.largest_hysteresis)} largest"
        ),
        "",
    ]
    rows = [
        [
            f"{d.azimuth / DEGREE:.6g}" if math.isfinite(d.azimuth) else d.name,
            str(d.count),
            *(
                "" if math.isnan(value) else f"{value / MICROMETRE:.3f}"
                for value in (
                    d.pretravel,
                    d.u_pretravel,
                    d.repeatability.value,
                    d.pretravel_range,
                    d.hysteresis,
                    d.u_hysteresis,
                )
            ),
        ]
        for d in calibration.directions
    ]
    header = ["azimuth/°", "n", "pretravel/µm", "u/µm", "s/µm", "range/µm", "hysteresis/µm", "u/µm"]
    return "\n".join([*lines, table(header, rows)])


def budget_table(budget: Budget, *, own_units: bool = False) -> str:
    """A budget of a length by source, the largest share first, and what it comes to, in µm.

    Parameters
    ----------
    budget : Budget
        Its result in mm.
    own_units : bool
        Sources are not all lengths: their uncertainties are printed as they are.

    Returns
    -------
    str

    >>> from pretravel.uncertainty.gum import Component
    >>> budget = Budget((Component("scale", "B", 3e-4), Component("repeats", "A", 4e-4, dof=9)))
    >>> print(budget_table(budget))
    source    type    u/µm  sensitivity  contribution/µm  share  dof
    repeats      A  0.4000            1           0.4000   64 %    9
    scale        B  0.3000            1           0.3000   36 %    ∞
    combined                                      0.5000          22
    expanded, 95 %                                1.0398      k 2.08
    """
    rows = [
        [
            str(row["source"]),
            str(row["evaluation"]),
            f"{float(row['standard_uncertainty']):.4g}"
            if own_units
            else f"{float(row['standard_uncertainty']) / MICROMETRE:.4f}",
            f"{float(row['sensitivity']):.4g}",
            f"{float(row['contribution']) / MICROMETRE:.4f}",
            f"{100.0 * float(row['share']):.0f} %",
            "∞" if math.isinf(float(row["dof"])) else f"{float(row['dof']):.0f}",
        ]
        for row in budget.rows()
    ]
    dof = "∞" if math.isinf(budget.effective_dof) else f"{budget.effective_dof:.0f}"
    rows.append(["combined", "", "", "", f"{budget.combined / MICROMETRE:.4f}", "", dof])
    expanded, factor = budget.expanded() / MICROMETRE, budget.coverage_factor()
    rows.append(["expanded, 95 %", "", "", "", f"{expanded:.4f}", "", f"k {factor:.2f}"])
    u = "u" if own_units else "u/µm"
    header = ["source", "type", u, "sensitivity", "contribution/µm", "share", "dof"]
    return table(header, rows)


def separation_report(result: Separation) -> str:
    """Machine and probe, errors and variances, and what cannot be told.

    Returns
    -------
    str
    """
    rows = []
    sides = (
        ("machine", result.machines, result.machine_error, result.u_machine_error,
         result.machine_variance, result.u_machine_variance),
        ("probe", result.probes, result.probe_error, result.u_probe_error,
         result.probe_variance, result.u_probe_variance),
    )  # fmt: skip
    for kind, indices, error, u_error, variance, u_variance in sides:
        for k, index in enumerate(indices):
            rows.append(
                [
                    f"{kind} {index}",
                    f"{error[k] / MICROMETRE:+.3f}",
                    f"{u_error[k] / MICROMETRE:.3f}",
                    f"{variance[k] / _SQUARE:.4f}",
                    f"{u_variance[k] / _SQUARE:.4f}",
                ]
            )
    spread = {
        "machine": (np.ptp(result.machine_error), result.machine_variance.mean()),
        "probe": (np.ptp(result.probe_error), result.probe_variance.mean()),
    }
    lines = [
        (
            f"{len(result.residuals)} readings, method {result.method}, {result.dof:.0f} degrees "
            "of freedom left by the systematic errors"
        ),
        *(
            f"  {kind:<18} errors range over {_um(float(extent))}, mean variance "
            f"{mean / _SQUARE:.3f} µm²"
            for kind, (extent, mean) in spread.items()
        ),
    ]
    for note in result.notes:
        lines += labelled("note", note)
    header = ["direction", "systematic/µm", "u/µm", "variance/µm²", "u/µm²"]
    return "\n".join([*lines, "", table(header, rows)])


def separation_plan_report(plan: SeparationPlan) -> str:
    """A planned multi-step test in a few lines.

    Returns
    -------
    str
    """
    step = 360.0 / plan.directions
    turns = ", ".join(f"{step * s:g}" for s in plan.steps)
    variance = (
        "not told"
        if math.isinf(plan.u_variance)
        else f"{100.0 * plan.u_variance:.0f} % of a machine's (or probe's) direction's variance"
    )
    return "\n".join(
        [
            (
                f"{plan.readings} touches: {plan.directions} directions x {len(plan.steps)} "
                f"orientations x {plan.repeats} repeats"
            ),
            *labelled("turn the probe to", f"{turns}°"),
            f"  u of an error      {_um(plan.u_error)} about their mean",
            f"  u of a variance    {variance}",
        ]
    )


def standard_report(check: StandardCheck) -> str:
    """A standard's figures, each with whether its definition is verified or recalled.

    Returns
    -------
    str
    """
    lines = [check.standard]
    for figure in check.figures:
        lines.append(f"  {figure.name}: {_um(figure.value)} ({figure.status})")
        lines.append(f"      {figure.meaning}")
        limit = "" if figure.limit is None else f", limit {_um(figure.limit)}: {figure.verdict}"
        lines.append(f"      u of the test value {_um(figure.u_test)} (reference){limit}")
    lines += [f"  note: {note}" for note in check.notes]
    lines.append(
        "  recalled: from memory of the standard, not checked against its text: certify nothing"
    )
    return "\n".join(lines)


def identification_report(found: Identification, model: str) -> str:
    """Numbers of a description as identified, with uncertainties.

    Returns
    -------
    str
    """
    rows = []
    for name, value, u in zip(found.names, found.values, found.standard_uncertainty, strict=True):
        number = FREE[name]
        key = "lever_mm" if name == "lever" else number.key
        rows.append([name, key, f"{value / number.unit:.6g}", f"{u / number.unit:.2g}"])
    rms = float(np.sqrt(np.mean(found.residuals**2)))
    largest = float(np.abs(found.residuals).max())
    shift = ", ".join(f"{s / MICROMETRE:+.2f}" for s in found.shift)
    return "\n".join(
        [
            f"{found.probe.name}, model {model}: from {len(found.directions)} directions",
            f"  map less model     {_um(rms)} rms, {_um(largest)} largest",
            f"  shift              ({shift}) µm between the map's reference and the model's",
            "",
            table(["number", "key", "value", "u"], rows),
        ]
    )


def sphere_report(sphere: MeasuredSphere, validation: str = "") -> str:
    """A measured sphere with the budget of its diameter.

    Returns
    -------
    str
    """
    center = ", ".join(f"{value:.5f}" for value in sphere.fit.center)
    u = ", ".join(
        f"{math.sqrt(max(v, 0.0)) / MICROMETRE:.2f}" for v in np.diag(sphere.covariance)[:3]
    )
    lines = [
        f"  sphere             centre ({center}) mm, u = ({u}) µm",
        (
            f"  diameter           {sphere.diameter:.6f} mm, U = {_um(sphere.budget.expanded())} "
            f"(k = {sphere.budget.coverage_factor():.2f})"
        ),
        f"  form               {_um(sphere.fit.form)}",
        "",
        budget_table(sphere.budget),
    ]
    return "\n".join([*lines, *([validation] if validation else [])])
