"""Pictures of the calibration laboratory; matplotlib is imported when one is asked for."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pretravel.directions import azimuth_angle, polar_angle
from pretravel.report.style import COLOURS, new_figure, polar_axes
from pretravel.units import DEGREE, MICROMETRE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from pretravel.identification.probe import Identification
    from pretravel.laboratory.rig import RigTouch, RigTrace
    from pretravel.laboratory.rig_calibration import RigCalibration
    from pretravel.laboratory.separation import Separation
    from pretravel.laboratory.standard_check import StandardCheck


_WIDEST_GAP = 65.0 * DEGREE


def plot_rig(calibration: RigCalibration, title: str = "") -> Figure:
    """Pretravel and hysteresis over the directions of a calibration.

    Parameters
    ----------
    calibration : RigCalibration
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(11.0, 5.2)
    figure.suptitle(title or "Calibration on the rig")
    directions = calibration.directions
    azimuths = np.array([d.azimuth for d in directions])
    means = np.array([d.pretravel for d in directions]) / MICROMETRE
    named = np.all(np.isfinite(azimuths))
    if named:
        left = polar_axes(figure, 1, 2, 1, "pretravel r1 - r0 (µm)")
        ahead = np.roll(azimuths, -1)
        for k, gap in enumerate(np.mod(ahead - azimuths, 2.0 * np.pi)):
            if 0.0 < gap <= _WIDEST_GAP:  # a chord over more would look like data
                ends = [k, (k + 1) % len(means)]
                left.plot(azimuths[ends], means[ends], "-", color=COLOURS[0], lw=1.2)
        for d in directions:
            own = [t for t in calibration.touches if t.trace.startswith(f"{d.name}_")]
            left.plot([d.azimuth] * len(own), [t.pretravel / MICROMETRE for t in own], "o",
                      ms=3, color=COLOURS[1])  # fmt: skip
        left.set_ylim(0.0, 1.1 * float(means.max()))
    else:
        flat = figure.add_subplot(1, 2, 1)
        flat.bar([d.name for d in directions], means, color=COLOURS[0])
        flat.set_ylabel("pretravel r1 - r0 (µm)")
    right = figure.add_subplot(1, 2, 2)
    place = azimuths / DEGREE if named else np.arange(len(directions))
    for name, values, errors, colour in (
        (
            "standard deviation of pretravel",
            [d.repeatability.value for d in directions],
            [
                [d.repeatability.value - d.repeatability.low for d in directions],
                [d.repeatability.high - d.repeatability.value for d in directions],
            ],
            COLOURS[0],
        ),
        (
            "hysteresis r3 - r0",
            [d.hysteresis for d in directions],
            [[2.0 * d.u_hysteresis for d in directions]] * 2,
            COLOURS[1],
        ),
    ):
        right.errorbar(place, np.array(values) / MICROMETRE, np.array(errors) / MICROMETRE,
                       fmt="o-", ms=4, lw=1.0, capsize=2, color=colour, label=name)  # fmt: skip
    shown = [abs(d.hysteresis) + 2.0 * (d.u_hysteresis or 0.0) for d in directions]
    shown += [1.5 * d.repeatability.value for d in directions]
    highest = np.nanmax([*shown, 1e-6]) / MICROMETRE if np.any(np.isfinite(shown)) else 1.0
    # Intervals from two or three repeats reach far up; they may leave the picture.
    right.set_ylim(min(0.0, 1.3 * float(np.nanmin([*(d.hysteresis for d in directions), 0.0]))
                       / MICROMETRE), 1.3 * highest)  # fmt: skip
    right.set_xlabel("azimuth (°)" if named else "direction")
    right.set_ylabel("µm, 95 % intervals")
    right.grid(alpha=0.3)
    right.legend(fontsize=8)
    return figure


def plot_trace(trace: RigTrace, touch: RigTouch) -> Figure:
    """One trace with its events: near the contact, and as a whole.

    Parameters
    ----------
    trace : RigTrace
    touch : RigTouch
        Of this trace.

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(11.0, 4.6)
    figure.suptitle(trace.name)
    whole, near = figure.add_subplot(1, 2, 1), figure.add_subplot(1, 2, 2)
    whole.plot(trace.time, trace.ruler / MICROMETRE, label="push rod", color=COLOURS[0])
    whole.plot(trace.time, trace.laser / MICROMETRE, label="tip (laser)", color=COLOURS[1])
    top = float(np.max(trace.ruler)) / MICROMETRE
    for level, name, colour in ((trace.contact, "contact", COLOURS[2]), (trace.trigger, "trigger",
                                                                        COLOURS[3])):  # fmt: skip
        whole.plot(trace.time, 0.1 * top * level - 0.15 * top, lw=0.9, label=name, color=colour)
    whole.set_xlabel("time (s)")
    whole.set_ylabel("µm; signals below")
    whole.legend(fontsize=8)
    near.plot(trace.ruler / MICROMETRE, trace.laser / MICROMETRE, lw=0.8, color=COLOURS[1])
    for name in ("r0", "r1", "r2", "r3"):
        place = getattr(touch, name)
        if np.isfinite(place):
            near.axvline(place / MICROMETRE, lw=0.8, ls=":", color="0.4")
            near.annotate(name, (place / MICROMETRE, 0.97), xycoords=("data", "axes fraction"),
                          ha="center", va="top", fontsize=8)  # fmt: skip
    around = [value for value in (touch.r0, touch.r2) if np.isfinite(value)]
    if around:
        near.set_xlim(min(around) / MICROMETRE - 3.0, max(around) / MICROMETRE + 1.0)
    near.set_xlabel("push rod (µm)")
    near.set_ylabel("tip (µm)")
    near.grid(alpha=0.3)
    return figure


def plot_separation(result: Separation, title: str = "") -> Figure:
    """Errors and variances of machine and probe around the circle.

    Parameters
    ----------
    result : Separation
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(11.0, 7.5)
    figure.suptitle(title or "Machine and probe")
    rows = (
        ("machine", result.machines, result.machine_error, result.u_machine_error,
         result.machine_variance, result.u_machine_variance, COLOURS[0]),
        ("probe", result.probes, result.probe_error, result.u_probe_error,
         result.probe_variance, result.u_probe_variance, COLOURS[1]),
    )  # fmt: skip
    for row, (name, indices, error, u_error, variance, u_variance, colour) in enumerate(rows):
        left, right = (figure.add_subplot(2, 2, 2 * row + column) for column in (1, 2))
        left.errorbar(indices, error / MICROMETRE, 2.0 * u_error / MICROMETRE, fmt="o-", ms=4,
                      lw=1.0, capsize=2, color=colour)  # fmt: skip
        left.set_ylabel(f"{name}: systematic (µm)")
        # No variance is negative, so neither is the lower end of its bar.
        bars = [np.minimum(2.0 * u_variance, np.maximum(variance, 0.0)), 2.0 * u_variance]
        right.errorbar(indices, variance / MICROMETRE**2, np.array(bars) / MICROMETRE**2,
                       fmt="o-", ms=4, lw=1.0, capsize=2, color=colour)  # fmt: skip
        right.set_ylabel(f"{name}: variance (µm²)")
        left.set_xlabel(f"{name} direction; bars: 2 u")
        right.set_xlabel(f"{name} direction; bars: 2 u, cut at zero")
        for axes in (left, right):
            axes.grid(alpha=0.3)
    return figure


def plot_check(check: StandardCheck, title: str = "") -> Figure:
    """Residuals of the fitted spheres or circles, touch by touch.

    Parameters
    ----------
    check : StandardCheck
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    figure = new_figure(9.0, 4.2)
    axes = figure.add_subplot(1, 1, 1)
    for k, fit in enumerate(check.sets):
        axes.plot(np.arange(1, len(fit.residuals) + 1), fit.residuals / MICROMETRE, "o-", ms=4,
                  lw=0.8, color=COLOURS[k % len(COLOURS)], label=f"run {k + 1}: range "
                  f"{fit.form / MICROMETRE:.2f} µm")  # fmt: skip
    axes.axhline(0.0, lw=0.6, color="0.4")
    axes.set_xlabel("touch, in the pattern's order")
    axes.set_ylabel("distance less radius (µm)")
    axes.set_title(title or check.standard, fontsize=11)
    axes.grid(alpha=0.3)
    axes.legend(fontsize=8)
    return figure


def plot_identification(found: Identification, title: str = "") -> Figure:
    """What the identified description leaves of the map, over the directions.

    Parameters
    ----------
    found : Identification
    title : str

    Returns
    -------
    matplotlib.figure.Figure
    """
    from pretravel.frames import probe_rotation

    figure = new_figure(6.5, 5.5)
    axes = polar_axes(figure, 1, 1, 1, title or "map less model (µm)")
    inside = found.directions @ probe_rotation(found.probe.orientation.axis)
    largest = max(float(np.abs(found.residuals).max()) / MICROMETRE, 1e-6)
    dots = axes.scatter(azimuth_angle(inside), polar_angle(inside) / DEGREE, s=22,
                        c=found.residuals / MICROMETRE, cmap="RdBu_r",
                        vmin=-largest, vmax=largest)  # fmt: skip
    figure.colorbar(dots, ax=axes, label="map less model (µm); radius: polar angle (°)", pad=0.1)
    return figure
