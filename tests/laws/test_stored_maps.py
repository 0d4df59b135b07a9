"""Law of map files: whatever is changed in one, it is refused, or the same map is read."""

from __future__ import annotations

import copy
import json
import random
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from pretravel.base.errors import InputError, PretravelError
from pretravel.files.map_datasets import map_dataset
from pretravel.maps.pretravel_map import PretravelMap
from tests.support.example_maps import example_map
from tests.support.stored_maps import averaged_example, map_of, sealed, small_harmonic_map, stored

Path = tuple[str | int, ...]

MAPS: dict[str, Callable[[], PretravelMap]] = {
    "harmonic": lambda: replace(small_harmonic_map(), feed=50.0),
    "harmonic with delay": lambda: replace(
        small_harmonic_map(), feed=0.0, delay=0.01, u_delay=1e-4, fixed_scatter=1e-4,
        delay_effect=np.full(3, 1e-5),
    ),
    "wozniak": lambda: example_map("wozniak"),
    "sectors": lambda: example_map("sectors"),
    "averaged": averaged_example,
}  # fmt: skip


@cache
def _content(name: str) -> bytes:
    return stored(MAPS[name]())


def _places(value: Any, place: Path = ()) -> Iterator[Path]:
    """All values of a file; of a list the first and the last."""
    if place:
        yield place
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _places(inner, (*place, key))
    elif isinstance(value, list) and value:
        for row in sorted({0, len(value) - 1}):
            yield from _places(value[row], (*place, row))


def _at(content: Any, place: Path) -> Any:
    for key in place:
        content = content[key]
    return content


def _with(content: Any, place: Path, new: Any) -> Any:
    changed = copy.deepcopy(content)
    _at(changed, place[:-1])[place[-1]] = new
    return changed


def _without(content: Any, place: Path) -> Any:
    changed = copy.deepcopy(content)
    del _at(changed, place[:-1])[place[-1]]
    return changed


def _next(value: Any) -> Any:
    """Another value of the same type: of a number, its neighbour."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, int):
        return value + 1
    if isinstance(value, float):
        return float(np.nextafter(value, np.inf))
    if isinstance(value, str):
        return value[:-1] + chr(ord(value[-1]) ^ 1) if value else "x"
    return 1.5 if value is None else [1]


@pytest.mark.parametrize("name", MAPS)
def test_a_map_is_read_as_it_was_written(name: str) -> None:
    assert stored(map_of(_content(name))) == _content(name)
    assert sealed(json.loads(_content(name)))[:-1].rpartition(b'"content')[2] in _content(name)


@pytest.mark.parametrize("name", MAPS)
def test_a_map_is_a_dataset(name: str) -> None:
    """With all arrays of its basis, whose axes have one size each."""
    made = MAPS[name]()
    found = map_dataset(made)
    for key, array in made.basis.arrays().items():
        assert np.array_equal(found[key].values, array.values)
        assert found[key].attrs["units"] == array.unit


@pytest.mark.parametrize("name", MAPS)
def test_every_change_is_noticed(name: str) -> None:
    whole = json.loads(_content(name))
    places = [place for place in _places(whole) if _at(whole, place) is not whole]
    assert len(places) > 30
    for place in places:
        for changed in (_with(whole, place, _next(_at(whole, place))), _without(whole, place)):
            with pytest.raises(PretravelError):
                map_of(json.dumps(changed).encode())


@pytest.mark.parametrize("name", MAPS)
def test_the_layout_does_not_matter(name: str) -> None:
    """The digest is that of the content: a program may write the lines in another way."""
    whole = json.loads(_content(name))
    other = json.dumps(dict(reversed(list(whole.items()))), separators=(",", ":")).encode()
    assert stored(map_of(other)) == _content(name)


def test_single_bits_anywhere_in_the_file() -> None:
    """In 200 places; `make hard` tries thousands."""
    content = _content("wozniak")
    chance = random.Random(16)
    refused = 0
    for _ in range(200):
        place, bit = chance.randrange(len(content)), chance.randrange(8)
        changed = bytearray(content)
        changed[place] ^= 1 << bit
        try:
            assert stored(map_of(bytes(changed))) == content, (place, bit)
        except PretravelError:
            refused += 1
    assert refused > 150


_WRONG: tuple[Any, ...] = (
    None, True, -1.0, 1e999, float("nan"), 10**400, 10**17, "", "x", [], [[]], [1.0, [2.0]],
    [["a", 1.0]], {}, {"values": []}, [[[1.0]]], [None],
)  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize("name", ["wozniak", "harmonic with delay"])
def test_wild_content_with_a_digest_that_fits(name: str) -> None:
    """Everyone can make one: each value is refused, or makes a map with finite values."""
    whole = json.loads(_content(name))
    refused = 0
    for place in [place for place in _places(whole) if place[0] != "content_sha256"]:
        for wrong in _WRONG:
            try:
                found = map_of(sealed(_with(whole, place, wrong)))
            except InputError:
                refused += 1
            else:
                normals = found.support.nodes[:3] @ found.rotation.T
                assert np.isfinite(found.pretravel_and_uncertainty(normals, extrapolate=True)).all()
    assert refused > 300


@pytest.mark.parametrize(
    ("place", "new", "said"),
    [
        (("schema",), "a map", "key schema"),
        (("version",), 2, "version 1"),
        (("version",), True, "version 1"),
        (("kind",), [1], "key kind must be a text"),
        (("kind",), "cubic", "not known"),
        (("tip_radius_mm",), "3", "tip_radius_mm must be one number"),
        (("tip_radius_mm",), True, "tip_radius_mm must be one number"),
        (("repeatability_mm",), [1.0, 2.0], "repeatability_mm must be one number"),
        (("repeatability_dof",), "many", "repeatability_dof must be one number"),
        (("feed_mm_min",), -1.0, "feed_mm_min is -1; it must be finite and positive"),
        (("provenance",), [1], "provenance must be an object"),
        (("provenance",), {"origin": "made", "source": [1]}, "source must be"),
        (("provenance",), {"source": "predicted"}, "provenance cannot be read"),
        (("provenance",), {"origin": "made", "setup": {"radius": 1}}, "provenance cannot be read"),
        (("covariance_form",), "wide", "covariance_form is 'wide'; there are"),
        (("covariance_form",), "independent", "covariance_mm2 must have 1 axes"),
        (("covariance_mm2", 0), [1.0], "covariance_mm2: its rows have different lengths"),
        (("covariance_mm2", 0, 0), -1.0, "no negative variance"),
        (("covariance_mm2", 0, 1), 1.0, "symmetric"),
        (("coefficients_mm", 0), "a", "coefficients_mm contains 'a'"),
        (("coefficients_mm", 0), True, "coefficients_mm contains True"),
        (("coefficients_mm",), [10**17, 0, 0], "coefficients_mm contains a number that is too"),
        (("support",), [[0.0, 0.0, 1.0, 0.0]], "shape"),
        (("support", 0), [0.0, 0.0, 2.0], "support directions"),
        (("support", 0), [0.0, 0.0, -1.0], "above 170"),
        (("rotation", 0), [2.0, 0.0, 0.0], "axes of the probe"),
        (("basis", "arrays", "degree", "values", 1), 10**9, "degrees 0 to 60"),
        (("basis", "arrays", "order", "values", 1), -99, "orders from -degree"),
        (("basis", "arrays", "degree", "values", 1), 1.0, "degrees 0 to 60"),
        (("basis", "arrays", "degree"), [1], "degree must have a unit and values"),
        (("basis", "arrays", "degree", "unit"), 1, "unit must be a text"),
        (("basis", "attributes"), {"a": []}, "must be a number or a text"),
    ],
)  # fmt: skip
def test_what_a_refusal_says(place: Path, new: object, said: str) -> None:
    whole = json.loads(_content("harmonic"))
    with pytest.raises(InputError, match=said) as refusal:
        map_of(sealed(_with(whole, place, new)))
    assert str(refusal.value).startswith("map.json: ")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (b"", "empty"),
        (b"hello", "not a text in JSON"),
        (b"\xff\xfe\x00", "not a text in JSON"),
        (b"[1]", "no JSON object"),
        (b"{}", "key schema"),
        (b'{"schema": "pretravel map", "schema": "pretravel map"}', "'schema' is there twice"),
        (b'{"schema": NaN}', "the word NaN"),
        (b'{"schema": [-Infinity]}', "the word -Infinity"),
        (b'{"a": ' + b"[" * 100_000, "16 levels of nested brackets"),
        (b'{"a": ' * 17 + b"1" + b"}" * 17, "16 levels of nested brackets"),
        (b'{"schema": "' + b"[" * 40 + b'"}', "key schema"),
        (b'{"' + b'\\"' * 1_000_000 + b"[" * 20, "not a text in JSON"),
        (b'{"a": ' + b"9" * 10_000 + b"}", "not a text in JSON"),
    ],
)
def test_hostile_text(text: bytes, said: str) -> None:
    with pytest.raises(InputError, match=said):
        map_of(text)


def test_keys_of_a_later_version_are_not_passed_over() -> None:
    whole = json.loads(_content("wozniak"))
    with pytest.raises(InputError, match="key 'spin' is not known"):
        map_of(sealed(whole | {"spin": 1.0}))


def test_large_files(monkeypatch: pytest.MonkeyPatch) -> None:
    """Neither written nor read."""
    monkeypatch.setattr("pretravel.files.map_json.LARGEST_MAP", 1000)
    with pytest.raises(PretravelError, match="use fewer directions"):
        stored(MAPS["wozniak"]())
    with pytest.raises(InputError, match="a map has at most"):
        map_of(b" " * 1001)


def test_names_that_are_no_unicode() -> None:
    """A name of a file in Linux is a list of bytes."""
    made = MAPS["wozniak"]()
    strange = replace(made, provenance=replace(made.provenance, touches_file="a\udcffµ.csv"))
    assert map_of(stored(strange)).provenance == strange.provenance
    usual = replace(made, provenance=replace(made.provenance, touches_file="aµ.csv"))
    assert "aµ.csv" in stored(usual).decode()


def test_lines_of_a_file() -> None:
    """A row of a matrix, a number of a list: `diff` shows the coefficient that differs."""
    made = MAPS["harmonic"]()
    coefficients = made.coefficients.copy()
    coefficients[2] = np.nextafter(coefficients[2], 1.0)
    lines = [stored(each).decode().splitlines() for each in (
        made, replace(made, coefficients=coefficients))]  # fmt: skip
    assert len(lines[0]) == len(lines[1])
    changed = [(a, b) for a, b in zip(*lines, strict=True) if a != b]
    assert len(changed) == 2  # the digest is the other one
    assert float(changed[0][1].strip(" ,")) == coefficients[2]
    assert changed[1][0].strip().startswith('"content_sha256"')
