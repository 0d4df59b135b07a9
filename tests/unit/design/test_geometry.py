"""Edges, overlaps and joints of simple solids, and the tip of a STEP file, by hand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from netgen.occ import Box, Cylinder, Glue, Pnt, Sphere, Z

from pretravel.base.errors import DescriptionError
from pretravel.design.fem import geometry
from pretravel.design.fem.described_solids import _tripod_solids
from pretravel.design.fem.regions import ProbeSolid
from pretravel.design.fem.step_solids import _check_tip, _stylus_materials
from pretravel.prediction.description import Probe, StepGeometry
from pretravel.prediction.materials import material

STEEL = material("steel")


def parts_of(*solids: Any, carry: bool = False) -> list[ProbeSolid]:
    return [
        ProbeSolid(name, solid, STEEL, carry) for name, solid in zip("abcd", solids, strict=False)
    ]


def reentrant(solids: Sequence[Any], patch: float = 1e-6) -> list[tuple[float, float]]:
    """Length and diameter of each edge that is found."""
    found = geometry._reentrant_edges(Glue(list(solids)), parts_of(*solids), patch)
    return sorted((edge.mass, diameter) for edge, diameter in found)


@pytest.mark.parametrize("scale", [0.1, 1.0, 100.0])
@pytest.mark.parametrize("turn", [0, 1])
def test_an_angle_has_one_reentrant_edge(scale: float, turn: int) -> None:
    """Of 10 mm, in one solid or where two meet; its diameter is its length over pi."""
    s = scale
    foot, wall = Box((0, 0, 0), (9 * s, 10 * s, 4 * s)), Box((0, 0, 4 * s), (4 * s, 10 * s, 9 * s))
    solids = [(foot + wall).solids[0]] if turn else [foot, wall]
    (found,) = reentrant(solids)
    assert found == pytest.approx((10.0 * s, 10.0 * s / math.pi))


@pytest.mark.parametrize("kept", [(0.0, 4.0), (7.0, 10.0)])
def test_an_edge_of_which_a_part_was_cut_off(kept: tuple[float, float]) -> None:
    """Its parameter begins or ends with that of the whole edge; its middle is its own."""
    first, last = kept
    whole = Box((0, 0, 0), (9, 10, 4)) + Box((0, 0, 4), (4, 10, 9))
    (part,) = (whole * Box((-1, first, -1), (20, last, 20))).solids
    assert reentrant([part]) == [pytest.approx((last - first, (last - first) / math.pi))]


def test_edges_within_or_around_a_body_are_none() -> None:
    """Four quarters of a block: edges with 90°, 180° and 360° of solid around them."""
    quarters = [
        Box((x, y, 0), (x + 2, y + 3, 4)) for x in (0, 2) for y in (0, 3)
    ]  # fmt: skip
    assert reentrant(quarters) == []
    # Without one of them, the middle one has 270°.
    ((length, diameter),) = reentrant(quarters[:3])
    assert (length, diameter) == pytest.approx((4.0, 4.0 / math.pi))


def test_thin_walls_have_reentrant_edges_too() -> None:
    """0.12 mm thick: what is inside is asked 0.05 mm around an edge, however long it is."""
    foot, wall = Box((0, 0, 0), (9, 10, 0.12)), Box((0, 0, 0.12), (0.12, 10, 9))
    ((length, _),) = reentrant([(foot + wall).solids[0]])
    assert length == pytest.approx(10.0)


def test_a_boss_has_a_reentrant_circle_and_patches_are_left_out() -> None:
    """A circle of radius 2 has its diameter, 4; as a patch of 1.2 times less it is the seat's."""
    solids = [Box((-5, -5, -3), (5, 5, 0)), Cylinder(Pnt(0, 0, 0), Z, 2, 3)]
    for patch in (1e-6, 1.99 / 1.2):
        ((length, diameter),) = reentrant(solids, patch)
        assert length == pytest.approx(4.0 * math.pi)
        assert diameter == pytest.approx(4.0)
    assert reentrant(solids, 2.01 / 1.2) == []


def test_patches_fit_on_their_rods(omp40: Probe) -> None:
    """Of more than zero, and at most half of the rod's radius."""
    rod = omp40.tripod.rod_radius
    assert geometry._checked_patch(omp40, 0.5 * rod) == 0.5 * rod
    assert geometry._checked_patch(omp40, 1e-9) == 1e-9
    assert geometry._checked_patch(omp40, None) == pytest.approx(0.13 * rod)
    for patch in (0.0, -0.1, 0.501 * rod, math.nan):
        with pytest.raises(DescriptionError, match="does not fit on rods"):
            geometry._checked_patch(omp40, patch)


@pytest.mark.parametrize("degrees", [30.0, 45.0, 60.0])
def test_patches_within_a_sixth(omp40: Probe, degrees: float) -> None:
    """A plug of radius and half height p reaches p (cos + sin) sideways of R cos: 95 % of it."""
    angle = math.radians(degrees)
    probe = replace(omp40, seats=replace(omp40.seats, support_angle=angle))
    limit = 0.95 * omp40.tripod.rod_radius / (1.0 + math.tan(angle))
    assert geometry._patch_within_sixth(probe, 0.999 * limit)
    assert not geometry._patch_within_sixth(probe, 1.001 * limit)


def test_overlaps_are_told_with_all_their_images() -> None:
    """1 x 2 x 0.5 mm of two boxes, and of their six images; a millionth of the smaller may be."""
    first, second = Box((0, 0, 0), (2, 2, 2)), Box((1, 0, 1.5), (5, 2, 5))
    for copies, volume in ((1, "1"), (6, "6")):
        with pytest.raises(DescriptionError, match=f"'a' and 'c' overlap by {volume} mm³"):
            geometry._check_overlaps(
                [
                    parts_of(first)[0],
                    *parts_of(*[Box((9, 9, 9), (10, 10, 10))] * 2, second)[1:],
                ],
                copies,
            )
    for depth, refused in ((0.9e-6, False), (1.1e-6, True)):
        # 2 x 2 x 1 of the smaller one.
        slight = parts_of(first, Box((0, 0, 2 - depth), (2, 2, 3 - depth)))
        if refused:
            with pytest.raises(DescriptionError, match="overlap"):
                geometry._check_overlaps(slight)
        else:
            geometry._check_overlaps(slight)


def test_parts_are_joined_by_a_chain_of_faces() -> None:
    boxes = parts_of(*(Box((x, 0, 0), (x + 1, 1, 1)) for x in (0, 1, 2, 3)))
    names = [part.name for part in boxes]
    # The last joint first: the chain is followed more than once.
    owners = {1: ["c", "d"], 2: ["b", "c"], 3: ["a", "b"], 4: ["a"], 5: ["d"]}
    geometry._check_joined(names, owners, boxes)
    for gone, loose in ((3, "b"), (2, "c"), (1, "d")):
        left = {face: sharing for face, sharing in owners.items() if face != gone}
        with pytest.raises(DescriptionError, match=f"'{loose}' is loose: .* share only an edge"):
            geometry._check_joined(names, left, boxes)
    apart = [*boxes[:3], ProbeSolid("d", Box((3.25, 0, 0), (4, 1, 1)), STEEL)]
    with pytest.raises(DescriptionError, match=r"the nearest part, 'c', is 0\.25 mm away"):
        geometry._check_joined(names, {2: ["b", "c"], 3: ["a", "b"]}, apart)


def test_the_spring_presses_on_the_highest_face_of_the_tripod() -> None:
    """The larger one of two at the same height; a higher one of the stylus is none."""
    tripod = parts_of(
        Box((0, 0, 0), (1, 1, 5)), Box((2, 0, 0), (4, 2, 5)), Box((5, 0, 0), (9, 9, 4)), carry=True
    )
    higher = ProbeSolid("stylus 1", Box((20, 0, 0), (30, 9, 9)), STEEL)
    face = geometry._spring_face([higher, *tripod])
    assert (face.center.x, face.center.y, face.center.z) == pytest.approx((3.0, 1.0, 5.0))
    hub = ProbeSolid("hub", Box((40, 0, 0), (41, 1, 6)), STEEL)
    assert geometry._spring_face([*tripod, hub]).center.z == pytest.approx(6.0)


def test_a_wedge_holds_a_sixth_of_the_probe(omp40: Probe) -> None:
    """Between the azimuths of 0° and 60° from the first rod, above the hub and below the tip."""
    wedge = geometry._wedge(omp40)
    azimuth = omp40.tripod.rod_azimuths[0]
    hub = omp40.hub
    assert hub is not None
    low, high = wedge.bounding_box
    assert low[2] < -omp40.lever - omp40.tip.radius
    assert high[2] > hub.height
    reach = max(hub.radius, omp40.tripod.radius + omp40.tripod.rod_radius, omp40.tip.radius)
    for degrees, inside in ((1, 1), (30, 1), (59, 1), (-1, 0), (61, 0), (180, 0), (240, 0)):
        at = azimuth + math.radians(degrees)
        for height in (hub.height, 0.0, -omp40.lever - omp40.tip.radius):
            x, y = reach * math.cos(at), reach * math.sin(at)
            ball = Sphere(Pnt(x, y, height), 1e-3)
            assert (wedge * ball).mass == pytest.approx(inside * ball.mass, rel=1e-3)


def test_thickness_is_the_diameter_of_a_cylinder_of_the_same_length() -> None:
    """Of a rod its diameter; of a bar of 2 x 3 mm a circle of 6 mm²; of several the thickest."""
    rod = Cylinder(Pnt(1, 2, 3), Z, 0.75, 10)
    bar = Box((0, 0, 0), (12, 2, 3))
    found = geometry._thickness(parts_of(rod, bar))
    assert found["a"] == pytest.approx(1.5, rel=1e-6)
    assert found["b"] == pytest.approx(math.sqrt(4.0 * 6.0 / math.pi), rel=1e-6)
    both = [ProbeSolid("rods", solid, STEEL) for solid in (bar, rod)]
    assert geometry._thickness(both) == pytest.approx({"rods": found["b"]})
    assert geometry._thickness(both[::-1]) == pytest.approx({"rods": found["b"]})


class TestTipOfAFile:
    """A ball of the radius and at the place that are described, in mm."""

    def check(self, probe: Probe, radius: float = 1.0, away: Sequence[float] = (0, 0, 0)) -> None:
        """Shares of the described radius, from the described place."""
        own = probe.tip.radius
        x, y, z = (own * part for part in away)
        _check_tip(probe, Sphere(Pnt(x, y, z - probe.lever), radius * own), Path("probe.step"))

    @pytest.mark.parametrize("radius", [0.9, 0.989, 1.011, 1.1])
    def test_of_another_radius(self, omp40: Probe, radius: float) -> None:
        self.check(omp40, 0.991)
        self.check(omp40, 1.009)
        with pytest.raises(DescriptionError, match=r"but \[tip\] gives 3 mm"):
            self.check(omp40, radius)

    @pytest.mark.parametrize("axis", range(3))
    @pytest.mark.parametrize("sense", [-1.0, 1.0])
    def test_at_another_place(self, omp40: Probe, axis: int, sense: float) -> None:
        away = sense * np.eye(3)[axis]
        self.check(omp40, away=0.049 * away)
        x, y, z = 3.0 * 0.051 * away - [0.0, 0.0, omp40.lever]
        place = rf"lies at \({x + 0.0:.3f}, {y + 0.0:.3f}, {z:.3f}\) mm".replace(
            "-0.000", "-?0.000"
        )
        with pytest.raises(DescriptionError, match=place.replace("(0.000", "(-?0.000")):
            self.check(omp40, away=0.051 * away)

    @pytest.mark.parametrize(("factor", "unit"), [(25.4, "inch"), (10.0, "cm"), (1000.0, "m")])
    def test_in_another_unit(self, omp40: Probe, factor: float, unit: str) -> None:
        """Within 2 %; otherwise it is another ball."""
        for share in (0.985, 1.0, 1.015):
            with pytest.raises(DescriptionError, match=rf"numbers in {unit}\? Export"):
                self.check(omp40, share / factor)
        for share in (0.975, 1.025):
            with pytest.raises(DescriptionError, match="correct one of them"):
                self.check(omp40, share / factor)


def test_materials_of_a_stylus_follow_its_segments(omp40: Probe) -> None:
    head, stem = (segment.material for segment in omp40.stylus)
    assert head != stem
    step = StepGeometry(Path("probe.step"), ("T",), ("H", "S"), ("B",))
    assert _stylus_materials(omp40, step) == [head, stem]
    for names in (("H",), ("H", "S", "R")):
        other = replace(step, stylus=names)
        with pytest.raises(DescriptionError, match=f"has {len(names)} solids and .* 2 segments"):
            _stylus_materials(omp40, other)
        # All stated: the usual ones are not used, but each solid has one.
        stated = replace(other, materials=dict.fromkeys(names, STEEL))
        assert len(_stylus_materials(omp40, stated)) == len(names)
        uniform = replace(omp40, stylus=tuple(replace(s, material=stem) for s in omp40.stylus))
        assert _stylus_materials(uniform, other) == [stem] * len(names)


@pytest.mark.long
def test_a_sixth_refines_the_joints_of_the_whole(omp40: Probe) -> None:
    """A joint that the mirror planes cut has the diameter that it has in the whole body: images
    that touch are counted, one, two or six."""
    sixth, whole = geometry.probe_body(omp40), geometry.probe_solids(omp40)
    assert sixth.symmetry is not None
    found, whole_ones = ([d for _, d in made.refined] for made in (sixth, whole))
    # In the whole body, the seam of the hub's cylinder halves one joint of a rod.
    expected = [
        d for d in whole_ones if not np.any(np.isclose(d * math.sqrt(2.0), whole_ones, rtol=1e-6))
    ]
    assert len(whole_ones) - len(expected) == 2
    assert np.unique(np.round(found, 6)) == pytest.approx(np.unique(np.round(expected, 6)))


def test_images_of_a_face_that_touches_no_plane_one_or_both(omp40: Probe) -> None:
    """The planes go through the axis, at the azimuth of the first rod and 60° further."""

    def images(*azimuths: float) -> int:
        at = omp40.tripod.rod_azimuths[0] + np.radians(azimuths)
        points = [SimpleNamespace(p=Pnt(5 * math.cos(a), 5 * math.sin(a), 1.0)) for a in at]
        return geometry._images_joined(omp40, SimpleNamespace(vertices=points))

    assert images(20.0, 40.0) == 1
    assert images(0.0, 20.0, 40.0) == images(20.0, 40.0, 60.0) == 2
    assert images(0.0, 30.0, 60.0) == geometry.COPIES == 6


def test_the_solids_of_a_tripod_have_the_heights_of_the_description(omp40: Probe) -> None:
    """The disc is half above and half below the rods; the holder reaches from it to the stylus; the
    rods end one radius beyond the seats."""
    hub, tripod = omp40.hub, omp40.tripod
    assert hub is not None
    disc, holder, rods = _tripod_solids(omp40, hub)
    heights = [
        (part.solid.bounding_box[0].z, part.solid.bounding_box[1].z) for part in (disc, holder)
    ]
    half = 0.5 * hub.height
    assert heights[0] == pytest.approx((-half, half), abs=1e-6)
    assert heights[1] == pytest.approx((-omp40.hub_offset, -half), abs=1e-6)
    assert disc.solid.mass == pytest.approx(math.pi * hub.radius**2 * hub.height, rel=1e-9)
    assert holder.solid.mass == pytest.approx(
        math.pi * (0.5 * hub.holder_diameter) ** 2 * (omp40.hub_offset - half), rel=1e-9
    )
    # The kernel's box around a curved cut is a little wider than the solid.
    low, high = rods.solid.bounding_box
    assert max(high.x, high.y, -low.x, -low.y) == pytest.approx(
        tripod.radius + tripod.rod_radius, abs=0.02
    )
    assert (low.z, high.z) == pytest.approx((-tripod.rod_radius, tripod.rod_radius), abs=0.02)
