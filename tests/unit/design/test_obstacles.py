"""Balls and styluses on their way beside a block, whose distance from a point is a closed form."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.design.probing.obstacles import StylusOutline, first_obstacle, stylus_obstacle
from pretravel.surface.cad.part import Part
from pretravel.surface.cad.step_part import read_step_part

HALF = np.array([5.0, 4.0, 3.0])
AXES = np.concatenate([np.eye(3), -np.eye(3)])
RADIUS = 0.5


@pytest.fixture(scope="module")
def block(tmp_path_factory: pytest.TempPathFactory) -> Part:
    """10 x 8 x 6 mm around the origin."""
    from netgen.occ import Box

    file = tmp_path_factory.mktemp("block") / "block.step"
    Box(tuple(-HALF), tuple(HALF)).WriteStep(str(file))
    return read_step_part(file)


@pytest.fixture(scope="module")
def face_towards(block: Part) -> np.ndarray:
    """Index of the face on the side of each of `AXES`."""
    middles = [f.derivatives(f.samples(0.5))[0].mean(axis=0) for f in block.faces]
    found = [int(np.argmax(np.array(middles) @ axis)) for axis in AXES]
    assert sorted(found) == list(range(6))
    return np.array(found)


def depth(axis: np.ndarray) -> float:
    """Of the block's middle below its side towards an axis."""
    return float(np.abs(axis) @ HALF)


def distance(points: np.ndarray) -> np.ndarray:
    """From the block's faces, outside and inside."""
    beyond = np.abs(points) - HALF
    return np.linalg.norm(np.maximum(beyond, 0.0), axis=-1) + np.maximum(-beyond.max(axis=-1), 0.0)


def test_a_ball_on_its_way_meets_the_side_that_it_comes_from(
    block: Part, face_towards: np.ndarray
) -> None:
    """Ways through the whole block, which end 0.3 mm before its opposite side."""
    ends = np.array([axis * (0.3 - depth(axis)) for axis in AXES])
    nothing = np.full(6, -1)
    met = first_obstacle(block, ends, -AXES, nothing, RADIUS, 15.0)
    assert met.tolist() == face_towards.tolist()
    order = np.array([3, 0, 5, 1, 4, 2])
    again = first_obstacle(block, ends[order], -AXES[order], nothing, RADIUS, 15.0)
    assert again.tolist() == face_towards[order].tolist()


def between_points(block: Part, axis: np.ndarray) -> np.ndarray:
    """A place on the side towards an axis, as far as can be from the points on the block."""
    across = np.roll(np.abs(axis), 1)
    line = depth(axis) * axis + np.linspace(-1.0, 1.0, 81)[:, None] * (across + np.roll(across, 1))
    line = np.where(axis == 0.0, line, depth(axis) * axis)
    return line[np.argmax(block.cloud_of_spacing(0.5 * RADIUS).tree.query(line)[0])]


def test_at_the_end_the_touched_face_is_not_met(block: Part, face_towards: np.ndarray) -> None:
    """0.2 µm below rest: met, but for the touched face; at rest: free."""
    places = np.array([between_points(block, axis) for axis in AXES])
    nothing, other = np.full(6, -1), np.roll(face_towards, 1)
    for within, expected in ((2e-4, face_towards), (0.0, nothing)):
        ends = places + (RADIUS - within) * AXES
        for touched in (nothing, other):
            met = first_obstacle(block, ends, -AXES, touched, RADIUS, 2.0)
            assert met.tolist() == expected.tolist()
        met = first_obstacle(block, ends, -AXES, face_towards, RADIUS, 2.0)
        assert met.tolist() == [-1] * 6


def test_balls_meet_what_is_nearer_than_their_radius(block: Part) -> None:
    """At the end, over faces, edges and corners: at the radius, and 0.2 µm nearer."""
    generator = np.random.default_rng(1)
    surface = generator.uniform(-1.5, 1.5, (4000, 3)) * HALF
    away = surface - np.clip(surface, -HALF, HALF)
    outside = np.linalg.norm(away, axis=1) > 0.01
    foot, away = np.clip(surface, -HALF, HALF)[outside], away[outside]
    away /= np.linalg.norm(away, axis=1)[:, None]
    signs = np.where(np.arange(len(foot)) % 2, 1.0, -1.0)
    # Faces join to 1e-4 mm, edges are sampled to 5e-5 of the radius.
    centers = foot + (RADIUS - 1e-4 + 1e-4 * signs)[:, None] * away
    nothing = np.full(len(centers), -1)
    met = first_obstacle(block, centers, -away, nothing, RADIUS, 0.0)
    assert np.array_equal(met >= 0, signs < 0.0)


def test_balls_on_lines_meet_what_comes_nearer_than_their_radius(block: Part) -> None:
    """Against the distance at a thousand points of each line."""
    generator = np.random.default_rng(2)
    ends = generator.uniform(-8.0, 8.0, (400, 3))
    approach = generator.standard_normal((400, 3))
    approach /= np.linalg.norm(approach, axis=1)[:, None]
    clearance = 6.0
    met = first_obstacle(block, ends, approach, np.full(400, -1), RADIUS, clearance)
    back = np.linspace(0.0, clearance, 1001)
    along = distance(ends[:, None] - back[:, None] * approach[:, None])
    free = along.min(axis=1) > RADIUS
    # On the last half of a radius only the end is checked; steps of 0.02 of the radius pass
    # over what is met by less than 0.01² / 2 of it.
    before = along[:, back > 0.5 * RADIUS].min(axis=1)
    hit = np.minimum(before, along[:, 0]) < RADIUS - 2e-4
    assert min(free.sum(), hit.sum()) > 100
    assert np.all(met[free] == -1)
    assert np.all(met[hit] >= 0)


THICKER_ABOVE = (np.array([[0.0, 3.0], [3.0, 20.0]]), np.array([0.5, 1.5]))


@pytest.mark.parametrize(("within", "meets"), [(0.002, True), (-0.001, False)])
def test_the_end_of_a_stylus_meets_the_side_below_it(
    block: Part, face_towards: np.ndarray, within: float, meets: bool
) -> None:
    for axis, face in zip(AXES, face_towards, strict=True):
        stylus = StylusOutline(axis, *THICKER_ABOVE)
        tip = (depth(axis) + 0.5 - within) * axis
        met = stylus_obstacle(block, tip[None], -axis[None], stylus, 0.0)
        assert met.tolist() == [face if meets else -1]


@pytest.mark.parametrize(
    ("aside", "below", "meets"),
    [
        (1.0, 5.0, True),  # the thick cylinder beside the face
        (1.0, 3.3, True),  # its rim 0.3 mm below the edge, where no ball of its radius is
        (1.0, 2.9, False),  # its rim above the edge
        (1.6, 5.0, False),  # further away than its radius
        (0.45, 2.5, True),  # the thin cylinder beside the face
    ],
)
def test_a_stylus_meets_what_its_cylinders_reach(
    block: Part, face_towards: np.ndarray, aside: float, below: float, meets: bool
) -> None:
    """The tip lies beside a side and below the next one; all other sides are far away."""
    for place, axis in enumerate(AXES):
        beside = AXES[(place + 1) % 6]
        tip = (depth(axis) - below) * axis + (depth(beside) + aside) * beside
        stylus = StylusOutline(axis, *THICKER_ABOVE)
        # Three at once, of which the others are free.
        tips = np.array([tip + 40.0 * beside, tip, tip + 50.0 * axis])
        met = stylus_obstacle(block, tips, np.repeat(-beside[None], 3, axis=0), stylus, 0.0)
        assert met[[0, 2]].tolist() == [-1, -1]
        assert (met[1] in face_towards[[place, (place + 1) % 6]]) == meets
        assert (met[1] >= 0) == meets


@pytest.mark.parametrize(("clearance", "meets"), [(3.4, False), (3.6, True)])
def test_a_stylus_comes_from_behind_its_end(block: Part, clearance: float, meets: bool) -> None:
    """It ends 5 mm beside the block and comes from the block: 1.5 mm of it are its radius."""
    for place, axis in enumerate(AXES):
        beside = AXES[(place + 1) % 6]
        tip = (depth(axis) - 6.0) * axis + (depth(beside) + 5.0) * beside
        stylus = StylusOutline(axis, *THICKER_ABOVE)
        met = stylus_obstacle(block, tip[None], beside[None], stylus, clearance)
        assert (met[0] >= 0) == meets


@pytest.mark.long
@pytest.mark.parametrize(("within", "meets"), [(-0.5e-4, False), (0.5e-4, False), (2e-4, True)])
def test_a_ball_that_passes_a_side_at_its_radius_is_free(
    block: Part, face_towards: np.ndarray, within: float, meets: bool
) -> None:
    """It begins above a point of the side, one that is known or between them, and goes along the
    side: faces join to 0.1 µm, which counts as rest."""
    cloud = block.cloud_of_spacing(0.5 * RADIUS)
    points = np.asarray(cloud.tree.data)
    for axis, face in zip(AXES, face_towards, strict=True):
        inner = points[(points @ axis > depth(axis) - 1e-9) & np.all(np.abs(points) < 5.1, axis=1)]
        middle = inner[np.argmin(np.linalg.norm(inner - depth(axis) * axis, axis=1))]
        places = np.array([middle, between_points(block, axis)])
        along = np.roll(axis, 1)
        ends = places + (RADIUS - within) * axis + along
        met = first_obstacle(block, ends, np.array([along, along]), np.full(2, -1), RADIUS, 1.0)
        assert met.tolist() == [int(face) if meets else -1] * 2
