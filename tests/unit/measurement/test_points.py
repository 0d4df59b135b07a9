"""Points: joined, placed in another frame, and their uncertainty along the normal."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pretravel.base.directions import unit
from pretravel.base.frames import Placement
from pretravel.measurement.points import Points, joined_points

ARRAYS = ("positions", "normals", "pretravel", "covariance", "deviation", "uncompensated")


def some_points(seed: int, count: int, **others: object) -> Points:
    """Points whose numbers are all different."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(count, 3, 3))
    return replace(
        Points(
            rng.normal(size=(count, 3)), unit(rng.normal(size=(count, 3))), rng.normal(size=count),
            root @ root.transpose(0, 2, 1), rng.normal(size=count),
            tuple(f"{seed}.{i}" for i in range(count)), {"tip radius": rng.normal(size=count)},
            rng.normal(size=(count, 3)),
        ),
        **others,
    )  # fmt: skip


@pytest.mark.parametrize("count", [1, 2])
def test_joined_points_are_those_of_the_parts_in_order(count: int) -> None:
    parts = [some_points(1, 2), some_points(2, 3)][:count]
    both = joined_points(parts)
    for name in ARRAYS:
        expected = np.concatenate([getattr(part, name) for part in parts])
        assert np.array_equal(getattr(both, name), expected), name
    assert both.labels == ("1.0", "1.1", "2.0", "2.1", "2.2")[: len(both)]
    assert both.shared is not None
    expected = np.concatenate([(part.shared or {})["tip radius"] for part in parts])
    assert np.array_equal(both.shared["tip radius"], expected)


@pytest.mark.parametrize("first", [False, True])
@pytest.mark.parametrize(
    ("name", "value"),
    [
        *((name, None) for name in ("deviation", "uncompensated", "shared")),
        pytest.param("shared", {"signal delay": np.ones(3)}, id="shared by another cause"),
    ],
)
def test_what_one_part_does_not_state_the_whole_does_not(
    name: str, value: object, first: bool
) -> None:
    parts = [some_points(1, 2), some_points(2, 3, **{name: value})]
    assert getattr(joined_points(parts[::-1] if first else parts), name) is None


def test_placed_points_turn_with_the_part() -> None:
    """By a quarter about z, (x, y, z) becomes (-y, x, z); then all points are moved."""
    part = some_points(3, 4)
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    offset = np.array([10.0, 20.0, 30.0])
    found = part.placed(Placement(turn, offset))
    for name, shift in (("positions", offset), ("normals", 0.0), ("uncompensated", offset)):
        own = getattr(part, name)
        expected = np.column_stack([-own[:, 1], own[:, 0], own[:, 2]]) + shift
        assert np.allclose(getattr(found, name), expected, atol=1e-14), name
    c, of_turned = part.covariance, found.covariance
    for (i, j), expected in (((0, 0), c[:, 1, 1]), ((0, 1), -c[:, 1, 0]), ((1, 2), c[:, 0, 2])):
        assert np.allclose(of_turned[:, i, j], expected, atol=1e-14)
    along = [n @ own @ n for n, own in zip(part.normals, c, strict=True)]
    assert found.standard_uncertainty == pytest.approx(np.sqrt(along))
    for name in ("pretravel", "deviation"):
        assert np.array_equal(getattr(found, name), getattr(part, name))
    bare = replace(part, uncompensated=None).placed(Placement(turn, offset))
    assert bare.uncompensated is None


def test_a_variance_that_is_negative_by_rounding_is_none() -> None:
    up = np.array([[0.0, 0.0, 1.0]])
    flat = Points(up, up, np.zeros(1), np.diag([1.0, 1.0, -1e-24])[None], None, ("a",))
    assert flat.standard_uncertainty.tolist() == [0.0]
