"""Results as text: strings for people, made from values; nothing is printed here."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray
from pretravel.compensation.compensation import Points
from pretravel.directions import azimuth_angle, polar_angle
from pretravel.model.fem.condensation import ReducedModel
from pretravel.probe.seat_frame import SEAT_NAMES
from pretravel.probing.slide_history import SlideHistory
from pretravel.surface.cad.part import Part
from pretravel.trigger.elastic_field import TriggerField
from pretravel.trigger.friction import FrictionCycle
from pretravel.trigger.predict import Trigger
from pretravel.units import DEGREE, MICROMETRE


def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A plain text table: first column to the left, others to the right.

    >>> print(table(["kind", "um"], [["mean", "2.0"]]))
    kind   um
    mean  2.0
    """
    cells = [list(header), *(list(row) for row in rows)]
    widths = [max(len(row[i]) for row in cells) for i in range(len(header))]
    return "\n".join(
        "  ".join(
            cell.ljust(width) if i == 0 else cell.rjust(width)
            for i, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in cells
    )


def labelled(label: str, text: str) -> list[str]:
    """Lines of a label and a long text beside it."""
    lines = textwrap.wrap(text, width=78)
    return [f"  {label if i == 0 else '':17s}  {line}" for i, line in enumerate(lines)]


def _um(value: float, digits: int = 3) -> str:
    # Rounded first, so that nothing is called -0.00.
    return f"{round(value / MICROMETRE, digits) + 0.0:.{digits}f} µm"


def _range_um(values: FloatArray, digits: int = 2) -> str:
    low, high = (round(float(v) / MICROMETRE, digits) + 0.0 for v in (values.min(), values.max()))
    return f"{low:.{digits}f} to {high:.{digits}f} µm"


def prediction_report(trigger: Trigger, probe_name: str) -> str:
    """What a prediction says, in a few lines.

    Returns
    -------
    str
    """
    polar = polar_angle(trigger.directions) / DEGREE
    azimuth = azimuth_angle(trigger.directions) / DEGREE
    weakest, strongest = int(np.argmin(trigger.pretravel)), int(np.argmax(trigger.pretravel))

    def at(row: int) -> str:
        return f"polar {polar[row]:.0f}°, azimuth {azimuth[row]:.0f}°"

    total = trigger.pretravel.mean()
    shares = ", ".join(
        f"{name.replace('_', ' ')} {100.0 * share.mean() / total:.0f} %"
        for name, share in sorted(trigger.shares.items(), key=lambda item: -float(item[1].mean()))
    )
    return "\n".join(
        [
            f"{probe_name}, model {trigger.model}, {len(trigger.force)} directions",
            f"  trigger force      {trigger.force.min():.3f} to {trigger.force.max():.3f} N",
            f"  sensing distance   {_range_um(trigger.sensing_distance)}",
            f"  pretravel          {_range_um(trigger.pretravel)} ({at(weakest)}; {at(strongest)})",
            f"  mean shares        {shares}",
        ]
    )


def fem_report(reduced: ReducedModel, field: TriggerField, probe_name: str) -> str:
    """The finite-element model and its state at the trigger, in a few lines.

    Returns
    -------
    str
    """
    trigger, mesh = field.trigger, field.elastic.mesh
    highest = int(np.argmax(field.stress))
    x, y, z = mesh.points[mesh.elements[highest]].mean(axis=0)
    refined = reduced.summary["refined"].split("; ")
    polar = polar_angle(trigger.directions)[0] / DEGREE
    azimuth = azimuth_angle(trigger.directions)[0] / DEGREE
    shares = ", ".join(
        f"{name.replace('_', ' ')} {share[0] / MICROMETRE:.3f}"
        for name, share in sorted(trigger.shares.items(), key=lambda item: -float(item[1][0]))
    )
    rows = [
        [name, f"{rest:.4f}", f"{touched:.4f}"]
        for name, rest, touched in zip(
            SEAT_NAMES, field.rest_reactions, trigger.reactions[0], strict=True
        )
    ]
    return "\n".join(
        [
            f"{probe_name}, finite elements",
            f"  unknowns           {reduced.summary['unknowns']}, {reduced.summary['elements']}",
            *labelled("quality", reduced.summary["quality"]),
            *labelled("sizes", refined[0]),
            *(f"{'':21}{note}" for note in refined[1:]),
            f"  touched at         polar {polar:.6g}°, azimuth {azimuth:.6g}°",
            f"  trigger force      {trigger.force[0]:.4f} N",
            f"  sensing distance   {_um(float(trigger.sensing_distance[0]))}",
            f"  pretravel          {_um(float(trigger.pretravel[0]))}: {shares}",
            f"  opened seat        {' and '.join(field.opened)}",
            (
                f"  highest stress     {field.stress[highest]:.1f} MPa (von Mises) in "
                f"{mesh.region_names[mesh.regions[highest]]} at ({x:.2f}, {y:.2f}, {z:.2f}) mm"
            ),
            "",
            table(["seat", "at rest/N", "at trigger/N"], rows),
        ]
    )


def friction_report(cycle: FrictionCycle, probe_name: str) -> str:
    """What seat friction does in each direction, first touch and last.

    Returns
    -------
    str
    """
    rows = []
    last = cycle.trigger_force.shape[1] - 1
    for row, direction in enumerate(cycle.directions):
        rows.append(
            [
                f"{polar_angle(direction)[()] / DEGREE:.6g}",
                f"{np.mod(azimuth_angle(direction)[()] / DEGREE, 360.0):.6g}",
                f"{cycle.trigger_force[row, 0]:.3f}",
                f"{cycle.trigger_force[row, last]:.3f}",
                f"{cycle.hysteresis[row, last] / MICROMETRE:.3f}",
                f"{cycle.zero_drift[row, 0] / MICROMETRE:.3f}",
                f"{cycle.zero_drift[row, last] / MICROMETRE:.3f}",
                f"{cycle.reseat_error[row, last] / MICROMETRE:.3f}",
            ]
        )
    header = [
        "polar/°",
        "azimuth/°",
        "force 1/N",
        f"force {last + 1}/N",
        f"hysteresis {last + 1}/µm",
        "drift 1/µm",
        f"drift {last + 1}/µm",
        f"reseat {last + 1}/µm",
    ]
    return "\n".join(
        [
            f"{probe_name}, seats with friction {cycle.friction:g}, {last + 1} touches",
            "  force: on the tip when the first seat opens; hysteresis: deflection at opening less",
            "  that at reseating; drift: where the tip then rests, along the normal, against the",
            "  start; reseat: how far that is from the touch before. Touches 1 and last.",
            "",
            table(header, rows),
        ]
    )


def slide_report(history: SlideHistory, probe_name: str, where: str) -> str:
    """How far the tip slid, and where it triggered.

    Returns
    -------
    str
    """
    golden = history.search == "golden"
    last = int(np.argmax(history.feed))
    moved = float(np.linalg.norm(history.contact[last] - history.start))
    how = "trials of a golden section" if golden else "steps"
    feed, deflection = _um(history.feed[last]), _um(history.deflection[last])
    lines = [
        f"{probe_name} on {where}: {len(history)} {how}",
        f"  feed to {feed}: deflection {deflection}, the contact slides {_um(moved)}",
    ]
    if not history.triggered.any():
        lines.append("  no trigger within these; take more, or larger ones")
        return "\n".join(lines)
    first = int(np.argmax(history.triggered))
    found = "found: the trigger" if golden else f"triggers in step {history.step[first]}"
    lines.append(f"  {found}, after {_um(history.trigger_feed)} of feed")
    if not golden and first == 0:
        lines.append("  (the first step is beyond it: smaller ones show the way there)")
    return "\n".join(lines)


def faces_report(part: Part, columns: Mapping[str, npt.ArrayLike]) -> str:
    """The faces of a part as a table.

    Returns
    -------
    str
    """
    rows, refused = [], []
    for row in zip(*(np.asarray(values).tolist() for values in columns.values()), strict=True):
        face = dict(zip(columns, row, strict=True))
        if face["problem"]:
            refused.append(f"face {face['face']} cannot be used: {face['problem']}")
            continue
        radius = face["smallest_radius_mm"]
        rows.append(
            [
                str(face["face"]),
                face["name"],
                face["type"],
                f"{face['x_mm']:.2f}, {face['y_mm']:.2f}, {face['z_mm']:.2f}",
                ", ".join(f"{round(face[f'n{axis}'], 2) + 0.0:+.2f}" for axis in "xyz"),
                "" if math.isnan(radius) else "apex" if radius < 1e-6 else f"{radius:.3g}",
                f"{face['u_from']:.4g}, {face['u_to']:.4g}",
                f"{face['v_from']:.4g}, {face['v_to']:.4g}",
            ]
        )
    box = part.box
    size = " x ".join(f"{length:.2f}" for length in box[1] - box[0])
    low, high = (", ".join(f"{x:.2f}" for x in corner) for corner in box)
    return "\n".join(
        [
            f"{part.name}: {len(rows) + len(refused)} faces, {size} mm, from ({low}) to ({high})",
            "  of each: a point in its middle, the normal there, the smallest radius anywhere on",
            "  it, and from where to where its parameters go",
            "",
            table(["face", "name", "type", "point/mm", "normal", "radius/mm", "u", "v"], rows),
            *refused,
        ]
    )


def points_report(points: Points) -> str:
    """What a compensation gave, in a few lines.

    Returns
    -------
    str
    """
    lines = [
        f"{len(points)} points",
        f"  pretravel          {_range_um(points.pretravel)}",
        f"  uncertainty u      {_range_um(points.standard_uncertainty)}",
    ]
    if points.deviation is not None:
        deviation = points.deviation
        lines.append(
            f"  deviation          {_range_um(deviation)}, mean {_um(float(deviation.mean()), 2)}, "
            f"standard deviation {_um(float(deviation.std()), 2)}"
        )
    return "\n".join(lines)
