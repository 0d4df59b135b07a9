"""Refusal of touches that allow no qualification: the reason and the remedy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap, sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.files.touches_csv import read_touches
from pretravel.maps.provenance import QualificationSetup
from pretravel.qualification.observe import observe
from pretravel.touches import Touches
from tests.support.examples import EXAMPLES
from tests.support.plain_qualification import qualify_plainly as qualify
from tests.support.reference_touches import sphere_touches


def _example() -> Touches:
    return read_touches(EXAMPLES / "sphere_touches.csv")


def _in_inches(touches: Touches) -> Touches:
    return Touches(touches.positions / 25.4, touches.normals)


def _plane(touches: Touches) -> Touches:
    return touches.take(np.abs(touches.normals[:, 2]) < 0.01)


def _turned_normals(touches: Touches) -> Touches:
    return Touches(touches.positions, -touches.normals)


def _stray(touches: Touches) -> Touches:
    positions = touches.positions.copy()
    positions[20, 2] += 1000.0
    return Touches(positions, touches.normals, lines=touches.lines)


def _one_wrong_normal(touches: Touches) -> Touches:
    normals = touches.normals.copy()
    normals[7] = [0.0, 0.0, 1.0]
    return Touches(touches.positions, normals, lines=touches.lines)


@pytest.mark.parametrize("kind", ["mean", "harmonic"])
@pytest.mark.parametrize(
    ("change", "options", "words"),
    [
        (lambda t: t.take([0, 3]), {}, "2 touches in 2 directions are too few"),
        (lambda t: t.take([0, 1, 2]), {}, "in 1 direction are too few"),
        (_plane, {}, "in one plane (perpendicular to Z)"),
        (_in_inches, {}, "look like inches"),
        (_in_inches, {"tip_diameter": None}, "look like inches"),
        (
            lambda t: t,
            {"diameter": 24.9987 / 25.4, "tip_diameter": 6 / 25.4},
            "diameters look like",
        ),
        (lambda t: t, {"diameter": 24.0}, "with this tip the sphere would measure 24.966"),
        (lambda t: t, {"diameter": 25.4}, "probes deflect by 1 to 80"),
        (_stray, {}, "touch 21 (line 22) lies 1000"),
        (_stray, {"tip_diameter": None}, "its position is wrong"),
        (lambda t: t, {"diameter": 12.49935}, "radius given as its diameter"),
        (lambda t: t, {"tip_diameter": 3.0}, "tip's radius given as its diameter"),
        (lambda t: t, {"diameter": 30.9987}, "pretravel"),
        (lambda t: t, {"diameter": 30.9987, "tip_diameter": None}, "Check the diameter"),
        (lambda t: t, {"diameter": -25.0}, "must be positive"),
        (lambda t: t, {"diameter": float("nan")}, "must be positive"),
        (lambda t: t, {"tip_diameter": 0.0}, "must be positive"),
        (_turned_normals, {}, "point the wrong way"),
        (_one_wrong_normal, {}, "touch 8 (line 9)"),
        (lambda t: t, {"axis": (0.0, 0.0, 2.0)}, "length 2"),
    ],
)
def test_qualification_refuses(
    kind: str, change: Callable[[Touches], Touches], options: dict[str, object], words: str
) -> None:
    arguments = {"diameter": 24.9987, "tip_diameter": 6.0, "kind": kind, **options}
    with pytest.raises(PretravelError) as error:
        qualify(change(_example()), **arguments)  # type: ignore[arg-type]
    assert words in str(error.value)


def test_surface_points_are_not_tip_centres() -> None:
    n = sphere_pattern_25()
    with pytest.raises(PretravelError, match="already compensated"):
        qualify(Touches(12.5 * n, n), 25.0, tip_diameter=6.0)


def test_sectors_without_a_touch() -> None:
    n = sphere_pattern_25()
    keep = ~((np.abs(n[:, 2]) < 0.5) & (n[:, 0] > 0.5))
    with pytest.raises(PretravelError, match=r"sector X?.*30°"):
        qualify(
            sphere_touches(np.full(25, 0.01)).take(keep), 25.0, tip_diameter=6.0, kind="sectors"
        )


def test_refusals_begin_with_the_name_of_the_file() -> None:
    n = fibonacci_cap(3, 1.2)
    for source, begin in (("bolt.csv", "bolt.csv: 3 touches"), ("", "3 touches")):
        with pytest.raises(PretravelError) as refused:
            observe(Touches(15.5 * n, n, source=source), QualificationSetup(25.0, tip_diameter=6.0))
        assert str(refused.value).startswith(begin)
