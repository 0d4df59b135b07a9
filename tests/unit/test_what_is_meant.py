"""Python takes what is meant (a file, an array, a qualification), or says what to give instead."""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import pretravel
from pretravel import PretravelError, Qualification, Touches
from tests.support.example_maps import example_qualification
from tests.support.examples import EXAMPLES

SPHERE, PART = EXAMPLES / "sphere_touches.csv", EXAMPLES / "part_touches.csv"


@pytest.fixture(scope="module")
def made() -> Qualification:
    return example_qualification("mean")


@pytest.fixture(scope="module")
def part() -> Touches:
    return pretravel.read_touches(PART)


@pytest.mark.parametrize("of", [str, Path])
def test_a_file_stands_for_its_touches(of: type, made: Qualification) -> None:
    """It ended in: 'str' object has no attribute 'positions'."""
    found = pretravel.qualify(of(SPHERE), 24.9987, tip_diameter=6.0, kind="mean")
    assert found.effective_radius == made.effective_radius


def test_positions_on_a_sphere_need_no_normals(tmp_path: Path, made: Qualification) -> None:
    """As of the command; the normals of the fitted sphere differ from the targets' by 0.1°."""
    path = tmp_path / "positions.csv"
    rows = [line.split(",")[:3] for line in SPHERE.read_text().splitlines() if line[0] != "#"]
    path.write_text("\n".join(",".join(row) for row in rows))
    found = pretravel.qualify(path, 24.9987, tip_diameter=6.0, kind="mean")
    assert found.effective_radius == pytest.approx(made.effective_radius, abs=1e-5)
    read = pretravel.read_touches(path, pretravel.ReadingOptions(reference_diameter=24.9987))
    assert np.sum(read.normals * pretravel.read_touches(SPHERE).normals, axis=1).min() > 0.9999
    with pytest.raises(PretravelError, match="touches need the columns nx, ny, nz"):
        pretravel.read_touches(path)


def test_an_array_with_normals_is_touches(made: Qualification) -> None:
    touches = pretravel.read_touches(SPHERE)
    rows = np.hstack([touches.positions, touches.normals])
    found = pretravel.qualify(rows, 24.9987, tip_diameter=6.0, kind="mean")
    assert found.effective_radius == made.effective_radius


@pytest.mark.long
def test_a_qualification_has_one_map(made: Qualification, part: Touches, tmp_path: Path) -> None:
    expected = pretravel.apply(part, made.pretravel_map, extrapolate=True)
    path = tmp_path / "map.json"
    pretravel.write_map(path, made)
    for given in (made, path, str(path)):
        points = pretravel.apply(PART, given, extrapolate=True)
        assert points.positions == pytest.approx(expected.positions, abs=1e-12)
    back = pretravel.embed(expected.positions, expected.normals, made, extrapolate=True)
    assert back.positions == pytest.approx(part.positions, abs=1e-9)
    assert pretravel.compare_corrections(made).rows
    again = pretravel.qualify_like(SPHERE, made, 24.9987)
    assert again.effective_radius == made.effective_radius


def test_a_map_of_a_qualification_is_verified() -> None:
    assert not pretravel.verify(SPHERE, example_qualification("physical"), 24.9987).changed


def test_a_file_stands_for_its_points(made: Qualification, tmp_path: Path) -> None:
    points = pretravel.apply(SPHERE, made)
    path = tmp_path / "points.json"
    pretravel.write_points(path, points)
    expected = pretravel.measure_feature(points, "sphere").quantity("diameter").value
    found = pretravel.measure_feature(path, "sphere").quantity("diameter").value
    assert found == pytest.approx(expected, rel=1e-9)


def test_what_is_not_meant_is_told(made: Qualification, part: Touches) -> None:
    wrong: list[tuple[Any, tuple[Any, ...], str]] = [
        (pretravel.qualify, (part.positions, 25.0), r"a normal for each position.*\(140, 3\)"),
        (pretravel.qualify, (7.0, 25.0), "expected touches, not a float: read_touches"),
        (pretravel.qualify, (None, 25.0), "expected touches, not a NoneType"),
        (pretravel.apply, (made.pretravel_map, part), "expected touches, not a PretravelMap"),
        (pretravel.apply, (part, part), "expected a map, not a Touches: qualify"),
        (pretravel.measure_feature, (part, "plane"), "expected points, not a Touches: apply"),
        (pretravel.qualify, (part, "large"), "the sphere's diameter is large; it must be a number"),
    ]
    for call, given, told in wrong:
        with pytest.raises(PretravelError, match=told):
            call(*given)


def test_a_mistyped_keyword_is_named(part: Touches) -> None:
    """It ended in a message about QualificationSetup.__init__."""
    options: Any = {"tip_dia": 6.0}
    with pytest.raises(
        TypeError, match=r"qualify\(\) got an unexpected keyword argument 'tip_dia'"
    ):
        pretravel.qualify(part, 25.0, **options)


def test_qualify_shows_its_keywords() -> None:
    """In help and in notebooks; the defaults are those of the setup."""
    shown = inspect.signature(pretravel.qualify).parameters
    setup = inspect.signature(pretravel.QualificationSetup).parameters
    assert list(shown) == ["touches", "diameter", "kind", *(n for n in setup if n != "diameter")]
    for name in set(shown) & set(setup) - {"diameter"}:
        assert shown[name].default == setup[name].default
    assert shown["tip_diameter"].annotation == "float | None"


@pytest.mark.parametrize(
    ("keyword", "value"), [("u_diameter", 0.1), ("sphere_form", 0.13), ("axial_pretravel", 1.0)]
)
def test_micrometres_in_the_place_of_millimetres_are_refused(
    keyword: str, value: float, part: Touches
) -> None:
    """u_diameter=0.1 was taken as 100 µm, without a word. All are in mm."""
    options: Any = {keyword: value}
    with pytest.raises(PretravelError, match=r"Were µm meant\? 1 µm is 0.001 mm"):
        pretravel.qualify(part, 25.0, tip_diameter=6.0, **options)
