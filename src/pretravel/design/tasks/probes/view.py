"""A described probe as a picture: in space, from the side, and its seats from the spindle."""

from __future__ import annotations

import numpy as np

from pretravel.base import FloatArray, IntArray
from pretravel.prediction import Probe, seat_frame
from pretravel.show import (
    Area,
    Axis,
    Colour,
    LineMark,
    Mark,
    Note,
    PlaneChart,
    SpaceArrow,
    SpaceChart,
    SpaceLines,
    SpaceMark,
    SpaceMesh,
    View,
    cylinder_mesh,
    joined,
    sphere_mesh,
)

_RODS: Colour = "series6"
_BALLS: Colour = "series5"
_TIP: Colour = "series4"
_SPRING: Colour = "series2"
_STYLUS: tuple[Colour, ...] = ("series7", "series3", "series1", "series8")


def probe_view(probe: Probe) -> View:
    """A described probe to scale.

    Returns
    -------
    View
        In space; from the side; rods and seat balls from the spindle.
    """
    return View(probe.name, (space_chart(probe), _side_chart(probe), _seats_chart(probe)))


def ball_centers(probe: Probe) -> FloatArray:
    """Centres of the six seat balls, which touch the rods: (6, 3), probe frame. [mm]

    >>> from pretravel.prediction.catalogue import load_probe
    >>> ball_centers(load_probe("omp40-2"))[0].round(2).tolist()
    [16.34, 5.56, -2.86]
    """
    frame = seat_frame(probe)
    apart = probe.tripod.rod_radius + probe.seats.ball_radius
    return np.asarray(frame.points - apart * frame.normals)


def space_chart(probe: Probe, title: str = "in space") -> SpaceChart:
    """The solids of a description in space, and the force of the spring."""
    marks: list[SpaceMark] = [
        _mesh(joined([cylinder_mesh(*ends, probe.tripod.rod_radius) for ends in _rods(probe)]),
              "rods", _RODS),
        _mesh(joined([sphere_mesh(c, probe.seats.ball_radius) for c in ball_centers(probe)]),
              "seat balls", _BALLS),
        *_hub_marks(probe),
    ]  # fmt: skip
    top = -probe.hub_offset
    for index, segment in enumerate(probe.stylus):
        ends = [0.0, 0.0, top], [0.0, 0.0, top - segment.length]
        marks.append(_mesh(cylinder_mesh(*ends, 0.5 * segment.diameter),
                           f"stylus {index + 1}: {segment.material.name}",
                           _STYLUS[index % len(_STYLUS)]))  # fmt: skip
        top -= segment.length
    ball = sphere_mesh([0.0, 0.0, -probe.lever], probe.tip.radius)
    marks.append(_mesh(ball, f"tip: {probe.tip.material.name}", _TIP))
    head = _hub_top(probe)
    length = 0.6 * probe.tripod.radius
    marks.append(SpaceArrow(np.array([0.0, 0.0, head + length]), np.array([0.0, 0.0, -length]),
                            f"spring {probe.preload:g} N", _SPRING))  # fmt: skip
    return SpaceChart(title, tuple(marks), "probe", note=_hub_note(probe), elevation=18.0)


def _mesh(solid: tuple[FloatArray, IntArray], name: str, colour: Colour) -> SpaceMesh:
    return SpaceMesh(*solid, name, colour)


def _rods(probe: Probe) -> list[tuple[FloatArray, FloatArray]]:
    """Where each rod begins and ends: one radius beyond its seats, as in finite elements."""
    tripod = probe.tripod
    outwards = [np.array([np.cos(a), np.sin(a), 0.0]) for a in tripod.rod_azimuths]
    return [(np.zeros(3), (tripod.radius + tripod.rod_radius) * out) for out in outwards]


def _hub_top(probe: Probe) -> float:
    return probe.tripod.rod_radius if probe.hub is None else 0.5 * probe.hub.height


def _hub_marks(probe: Probe) -> list[SpaceMark]:
    """The disc and the holder, as described; a line where nothing is described."""
    hub = probe.hub
    if hub is None:
        ends = np.zeros((1, 3)), np.array([[0.0, 0.0, -probe.hub_offset]])
        return [SpaceLines(*ends, "hub: no shape described", "reference", 3.0)]
    half = 0.5 * hub.height
    solids = [cylinder_mesh([0.0, 0.0, -half], [0.0, 0.0, half], hub.radius)]
    if probe.hub_offset > half:
        ends = [0.0, 0.0, -probe.hub_offset], [0.0, 0.0, -half]  # type: ignore[assignment]
        solids.append(cylinder_mesh(*ends, 0.5 * hub.holder_diameter))
    return [_mesh(joined(solids), f"hub and holder: {hub.material.name}", "body")]


def _hub_note(probe: Probe) -> str:
    if probe.step is not None:
        return f"The moving part is that of {probe.step.path.name}, which is not drawn."
    if probe.hub is None:
        return "The shape of the hub is not described; it is taken as rigid."
    return ""


def _side_chart(probe: Probe) -> PlaneChart:
    """Projection on the plane of x and z, what is far away first."""
    marks: list[Mark] = []
    centers = ball_centers(probe)
    ball, rod = probe.seats.ball_radius, probe.tripod.rod_radius
    parts: list[tuple[float, list[Mark]]] = [
        (center[1], _circle(center[[0, 2]], ball, _BALLS)) for center in centers
    ]
    for (_, end), azimuth in zip(_rods(probe), probe.tripod.rod_azimuths, strict=True):
        beyond = rod * abs(float(np.sin(azimuth)))  # half of the ellipse at the end
        ends = min(0.0, end[0] - beyond), max(0.0, end[0] + beyond)
        parts.append((0.5 * end[1], _box(ends, (-rod, rod), _RODS)))
    for _, part in sorted(parts, key=lambda part: -part[0]):
        marks += part
    marks += _hub_outline(probe)
    words: list[tuple[float, float, str]] = _hub_words(probe)
    top = -probe.hub_offset
    for index, segment in enumerate(probe.stylus):
        half = 0.5 * segment.diameter
        colour = _STYLUS[index % len(_STYLUS)]
        marks += _box((-half, half), (top - segment.length, top), colour)
        size = f"{segment.length:g} mm, Ø {segment.diameter:g} mm"
        words.append((half, top - 0.5 * segment.length, f"{size}, {segment.material.name}"))
        top -= segment.length
    tip = probe.tip
    marks += _circle(np.array([0.0, -probe.lever]), tip.radius, _TIP)
    words.append((tip.radius, -probe.lever, f"tip Ø {2.0 * tip.radius:g} mm, {tip.material.name}"))
    marks += _placed_words(words, 0.055 * (probe.lever + probe.tripod.radius))
    title = f"from the side: lever {probe.lever:g} mm, spring {probe.preload:g} N"
    left, low = -1.5 * probe.tripod.radius, -probe.lever - 2.0 * tip.radius
    high = 2.0 * _hub_top(probe) + rod
    x = Axis("X of the probe", "mm", left, left + 1.2 * (high - low))
    z = Axis("Z of the probe", "mm", low, high)
    return PlaneChart(title, x, z, tuple(marks), equal=True)


def _hub_words(probe: Probe) -> list[tuple[float, float, str]]:
    """What stands next to the hub: the place where its line begins, and words."""
    hub = probe.hub
    middle = -0.5 * probe.hub_offset
    if hub is None:
        return [(0.0, middle, "hub: no shape described")]
    holder = (-0.5 * hub.height - probe.hub_offset) / 2.0
    sizes = f"hub Ø {2.0 * hub.radius:g} mm, holder Ø {hub.holder_diameter:g} mm"
    place = 0.5 * hub.holder_diameter, min(holder, -0.5 * hub.height)
    return [(*place, sizes)]


def _hub_outline(probe: Probe) -> list[Mark]:
    hub = probe.hub
    if hub is None:
        return [LineMark(np.zeros(2), np.array([0.0, -probe.hub_offset]), "", "reference",
                         dashed=True)]  # fmt: skip
    half, holder = 0.5 * hub.height, 0.5 * hub.holder_diameter
    disc = _box((-hub.radius, hub.radius), (-half, half), "body")
    if probe.hub_offset <= half:
        return disc
    return [*disc, *_box((-holder, holder), (-probe.hub_offset, -half), "body")]


def _placed_words(words: list[tuple[float, float, str]], apart: float) -> list[Mark]:
    """Words right of what they describe, with a line to it; moved down where they would overlap."""
    right = max(x for x, _, _ in words) + 1.5 * apart
    marks: list[Mark] = []
    lowest = float("inf")
    for x, z, text in words:
        place = min(z, lowest - apart)
        lowest = place
        line = LineMark(np.array([x, right - 0.3 * apart]), np.array([z, place]), "", "reference",
                        0.7)  # fmt: skip
        marks += [line, Note(right, place - 0.2 * apart, text)]
    return marks


def _seats_chart(probe: Probe) -> PlaneChart:
    """Rods above the balls that carry them, as seen from the spindle."""
    tripod, ball = probe.tripod, probe.seats.ball_radius
    marks: list[Mark] = []
    hub = probe.hub
    for center in ball_centers(probe):
        marks += _circle(center[:2], ball, _BALLS)
    for name, (_, end), azimuth in zip("ABC", _rods(probe), tripod.rod_azimuths, strict=True):
        across = tripod.rod_radius * np.array([-np.sin(azimuth), np.cos(azimuth)])
        start = end[:2] / np.linalg.norm(end[:2]) * (0.0 if hub is None else 0.97 * hub.radius)
        corners = np.array([start + across, end[:2] + across, end[:2] - across, start - across])
        marks += _polygon(corners, _RODS)
        out = 1.12 * end[:2] + 0.6 * ball * end[:2] / np.linalg.norm(end[:2])
        marks.append(Note(float(out[0]) - 0.03 * tripod.radius, float(out[1]), name))
    if hub is not None:
        marks += _circle(np.zeros(2), hub.radius, "body")
    angle = np.degrees(probe.seats.support_angle)
    note = f"Seat normals are {angle:.4g}° from the horizontal; balls Ø {2.0 * ball:g} mm."
    reach = 1.25 * (tripod.radius + 2.0 * ball)
    x, y = (Axis(f"{name} of the probe", "mm", -reach, reach) for name in "XY")
    return PlaneChart("rods and seats from the spindle", x, y, tuple(marks), equal=True, note=note)


def _box(x: tuple[float, float], z: tuple[float, float], colour: Colour) -> list[Mark]:
    corners = np.array([[x[0], z[0]], [x[1], z[0]], [x[1], z[1]], [x[0], z[1]]])
    return _polygon(corners, colour)


def _circle(center: FloatArray, radius: float, colour: Colour) -> list[Mark]:
    turn = np.linspace(0.0, 2.0 * np.pi, 48, endpoint=False)
    return _polygon(center + radius * np.column_stack([np.cos(turn), np.sin(turn)]), colour)


def _polygon(corners: FloatArray, colour: Colour) -> list[Mark]:
    """A convex area with its outline."""
    closed = np.vstack([corners, corners[:1]])
    return [convex_area(corners, colour), LineMark(closed[:, 0], closed[:, 1], "", "ink", 0.7)]


def convex_area(corners: FloatArray, colour: Colour) -> Area:
    """A convex polygon as an area between two lines.

    Parameters
    ----------
    corners : (n, 2) float
        In their order around.
    colour : Colour

    >>> area = convex_area(np.array([[0.0, 0.0], [2.0, 0.0], [1.0, 1.0]]), "body")
    >>> area.x.tolist(), area.low.tolist(), area.high.tolist()
    ([0.0, 1.0, 2.0], [0.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    """
    x = np.unique(corners[:, 0])
    start, end = corners, np.roll(corners, -1, axis=0)
    run = end[:, 0] - start[:, 0]
    share = (x[:, None] - start[:, 0]) / np.where(run == 0.0, 1.0, run)
    on_edge = (share >= -1e-9) & (share <= 1.0 + 1e-9) & (run != 0.0)
    height = start[:, 1] + np.clip(share, 0.0, 1.0) * (end[:, 1] - start[:, 1])
    low = np.where(on_edge, height, np.inf).min(axis=1)
    high = np.where(on_edge, height, -np.inf).max(axis=1)
    return Area(x, low, high, "", colour, 0.6)
