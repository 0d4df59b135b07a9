"""Shapes of a specification, by their distance from a point in closed form."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.base.errors import InputError
from pretravel.surface.local_geometry import signed_distance
from pretravel.surface.parametric import Convex
from pretravel.surface.specification import parse_surface

POINTS = np.array([[7.3, 1.9, 2.4], [-3.1, 5.8, 0.7], [2.2, -6.7, -1.3]])


def _plane(text: str, points: np.ndarray) -> np.ndarray:
    polar, azimuth = (40.0, 70.0) if "azimuth" in text else (40.0, 0.0)
    p, a = np.radians([polar, azimuth])
    return points @ [np.sin(p) * np.cos(a), np.sin(p) * np.sin(a), np.cos(p)]


def _cylindrical(points: np.ndarray, axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    along = points @ axis
    return np.linalg.norm(points - along[:, None] * axis, axis=1), along


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.0), (0.4, -0.3, 0.2)])
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("inside", [0, 1])
@pytest.mark.parametrize("shape", ["plane", "sphere", "cylinder", "cone", "torus", "ellipsoid"])
def test_distance_from_a_named_shape(
    shape: str, place: tuple[float, float, float], turned: bool, inside: int
) -> None:
    """What is not stated is the origin, the axis z (of a plane, azimuth 0) and the outside. The
    ellipsoid has three equal half-axes where one is stated."""
    needed = {
        "plane": "polar=40", "sphere": "radius=4", "cylinder": "radius=4", "ellipsoid": "a=4",
        "cone": "radius=4,half_angle=20", "torus": "radius=5,tube=1.5",
    }[shape]  # fmt: skip
    round_shape = shape in ("sphere", "ellipsoid")
    text = f"{shape}:{needed}"
    if turned and not round_shape:
        text += ",azimuth=70" if shape == "plane" else ",polar=90,azimuth=70"
    if any(place):
        text += ",x={},y={},z={}".format(*place)
    if inside and shape != "plane":
        text += ",inside=1"
    points = POINTS - place
    a = np.radians(70.0)
    axis = np.array([np.cos(a), np.sin(a), 0.0] if turned else [0.0, 0.0, 1.0])
    radial, along = _cylindrical(points, axis)
    slope = np.radians(20.0)
    expected = {
        "plane": _plane(text, points),
        "sphere": np.linalg.norm(points, axis=1) - 4.0,
        "ellipsoid": np.linalg.norm(points, axis=1) - 4.0,
        "cylinder": radial - 4.0,
        "cone": (radial - 4.0) * np.cos(slope) - along * np.sin(slope),
        "torus": np.hypot(radial - 5.0, along) - 1.5,
    }[shape]
    sign = -1.0 if "inside" in text else 1.0
    surface = parse_surface(text)
    assert signed_distance(surface, POINTS) == pytest.approx(sign * expected, abs=1e-9)
    for spaced in (text.replace(",", " , "), text.replace("=", " = ")):
        again = signed_distance(parse_surface(spaced), POINTS)
        assert again == pytest.approx(sign * expected, abs=1e-9)


def test_an_ellipsoid_with_half_axes_of_its_own() -> None:
    """On its axes, outside; where one is not stated, it is the first."""
    points = np.diag([7.0, 8.0, 9.0])
    for text, half in (
        ("a=4,b=3,c=2", (4.0, 3.0, 2.0)),
        ("a=4,c=2", (4.0, 4.0, 2.0)),
        ("a=4,b=3", (4.0, 3.0, 4.0)),
    ):
        found = signed_distance(parse_surface(f"ellipsoid:{text}"), points)
        assert found == pytest.approx(np.diag(points) - half, abs=1e-9)


def test_an_axis_without_an_azimuth_is_in_the_plane_of_x_and_z() -> None:
    a = np.radians(30.0)
    radial, _ = _cylindrical(POINTS, np.array([np.sin(a), 0.0, np.cos(a)]))
    found = signed_distance(parse_surface("cylinder:radius=2,polar=30"), POINTS)
    assert found == pytest.approx(radial - 2.0, abs=1e-9)


@pytest.mark.parametrize(("text", "numbers"), [
    ("convex", (20.0, 10.0, 45.0)), ("convex:a=7,b=5,turn=70", (7.0, 5.0, 70.0)),
])  # fmt: skip
def test_the_convex_surface_of_the_thesis(text: str, numbers: tuple[float, float, float]) -> None:
    surface, (a, b, turn) = parse_surface(text), numbers
    assert isinstance(surface, Convex)
    assert (surface.a, surface.b) == (a, b)
    assert surface.turn == pytest.approx(np.radians(turn), rel=1e-12)


def test_an_object_with_a_part_of_the_members_is_no_surface(tmp_path: Path) -> None:
    file = tmp_path / "half.py"
    file.write_text("class Half:\n    def local(self, uv): ...\n\nsurface = Half()\n")
    with pytest.raises(InputError, match="not a surface"):
        parse_surface(f"{file}#surface")
