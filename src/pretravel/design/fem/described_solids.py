"""The solids of a probe's description: hub, holder, rods, stylus, tip."""

from __future__ import annotations

import math
from typing import Any

from pretravel.base import DescriptionError
from pretravel.design.fem.regions import PATCH, TIP, ProbeSolid
from pretravel.prediction import Hub, Probe


def described_solids(probe: Probe) -> list[ProbeSolid]:
    """The solids of a description, before the patches of the seats are cut.

    Raises
    ------
    DescriptionError
        No hub described; dimensions that contradict each other or cannot be meshed.
    """
    hub = probe.hub
    if hub is None:
        raise DescriptionError(
            "the finite-element model needs the hub's shape: add radius_mm, height_mm, "
            "holder_diameter_mm and material to [hub] (pretravel probes omp40-2 shows one), or "
            "name the solids of a STEP file in [geometry]"
        )
    _check_hub(probe, hub)
    _check_for_mesh(probe)
    return [*_tripod_solids(probe, hub), *_stylus_solids(probe)]


def _tripod_solids(probe: Probe, hub: Hub) -> list[ProbeSolid]:
    from netgen.occ import Cylinder, Dir, Pnt, Z

    tripod, root, below = probe.tripod, -probe.hub_offset, -0.5 * hub.height
    disc = Cylinder(Pnt(0, 0, below), Z, r=hub.radius, h=hub.height)
    holder = Cylinder(Pnt(0, 0, root), Z, r=0.5 * hub.holder_diameter, h=below - root)
    # The rods end one radius beyond the seats: nothing further out carries load.
    rods = None
    for azimuth in tripod.rod_azimuths:
        axis = Dir(math.cos(azimuth), math.sin(azimuth), 0.0)
        length = tripod.radius + tripod.rod_radius
        rod = Cylinder(Pnt(0, 0, 0), axis, r=tripod.rod_radius, h=length) - disc
        rods = rod if rods is None else rods + rod
    return [
        ProbeSolid("hub", disc, hub.material),
        ProbeSolid("holder", holder, hub.material),
        ProbeSolid("rods", rods, tripod.material, carries_seats=True),
    ]


def _stylus_solids(probe: Probe) -> list[ProbeSolid]:
    from netgen.occ import Cylinder, Pnt, Sphere, Z

    ball = Sphere(Pnt(0, 0, -probe.lever), probe.tip.radius)
    solids: list[ProbeSolid] = []
    top = -probe.hub_offset
    for number, segment in enumerate(probe.stylus, start=1):
        bottom = Pnt(0, 0, top - segment.length)
        piece: Any = Cylinder(bottom, Z, r=0.5 * segment.diameter, h=segment.length)
        if number == len(probe.stylus):
            piece = piece - ball
        solids.append(ProbeSolid(f"stylus {number}", piece, segment.material))
        top -= segment.length
    return [*solids, ProbeSolid(TIP, ball, probe.tip.material)]


def _check_hub(probe: Probe, hub: Hub) -> None:
    tripod, root = probe.tripod, -probe.hub_offset
    below = -0.5 * hub.height
    if root >= below - 1e-6:
        raise DescriptionError(
            f"[hub]: a disc of height {hub.height:g} mm around the rod axes reaches {-below:g} mm "
            f"down, but the stylus's root is only {-root:g} mm below them; lower height_mm or "
            "raise offset_mm"
        )
    if hub.radius >= tripod.radius - 2.0 * tripod.rod_radius:
        raise DescriptionError(
            f"[hub]: a disc of radius {hub.radius:g} mm reaches the seats at "
            f"{tripod.radius:g} mm; rods of radius {tripod.rod_radius:g} mm need room there: "
            f"radius_mm below {tripod.radius - 2.0 * tripod.rod_radius:g}"
        )
    if 0.5 * hub.height <= tripod.rod_radius:
        raise DescriptionError(
            f"[hub]: rods of radius {tripod.rod_radius:g} mm do not fit into a disc of height "
            f"{hub.height:g} mm; raise height_mm above {2.0 * tripod.rod_radius:g}"
        )
    if 0.5 * hub.holder_diameter > hub.radius:
        raise DescriptionError(
            f"[hub]: the holder of diameter {hub.holder_diameter:g} mm is wider than the disc of "
            f"radius {hub.radius:g} mm that carries it"
        )


def _check_for_mesh(probe: Probe) -> None:
    """Refuse a tip or seats that no mesh can represent."""
    tripod = probe.tripod
    if probe.tip.radius < 0.505 * probe.stylus[-1].diameter:
        raise DescriptionError(
            f"a tip of radius {probe.tip.radius:g} mm on a stem of diameter "
            f"{probe.stylus[-1].diameter:g} mm: the stem's side touches the ball like a tangent, "
            f"which no mesh fills; make the tip at least {0.505 * probe.stylus[-1].diameter:g} mm"
        )
    apart = 2.0 * tripod.rod_radius * math.cos(probe.seats.support_angle)
    if apart < 2.2 * PATCH * tripod.rod_radius:
        raise DescriptionError(
            f"[seats]: at a support angle of {math.degrees(probe.seats.support_angle):.3g}° the "
            f"two seats of a rod are only {apart:.3g} mm apart, which the finite-element model "
            "cannot distinguish; lower support_angle_deg"
        )
