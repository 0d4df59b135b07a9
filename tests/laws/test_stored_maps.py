"""Law of map files: whatever is changed in one, it is refused, or the same map is read."""

from __future__ import annotations

import io
import random
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from typing import Any

import h5py
import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.maps.pretravel_map import PretravelMap
from tests.support.example_maps import example_map
from tests.support.stored_maps import averaged_example, everything, map_of, stored

Change = Callable[[h5py.File], None]

MAPS: dict[str, Callable[[], PretravelMap]] = {
    "harmonic": lambda: replace(example_map("harmonic"), feed=50.0),
    "harmonic with delay": lambda: replace(
        example_map("harmonic"), feed=0.0, delay=0.01, u_delay=1e-4, fixed_scatter=1e-4,
        delay_effect=np.full(len(example_map("harmonic").coefficients), 1e-5),
    ),
    "wozniak": lambda: example_map("wozniak"),
    "sectors": lambda: example_map("sectors"),
    "averaged": averaged_example,
}  # fmt: skip


def _changed_text(text: str) -> str:
    middle = len(text) // 2
    return text[:middle] + chr(ord(text[middle]) ^ 1) + text[middle + 1 :] if text else "x"


def _changed_number(values: np.ndarray) -> np.ndarray:
    """The lowest bit of the number in the middle is turned."""
    changed = np.array(values)
    bits = changed.reshape(-1).view(f"u{changed.dtype.itemsize}")
    bits[len(bits) // 2] ^= 1
    return changed


def _changed(value: Any) -> Any:
    if isinstance(value, (str, bytes)):
        return _changed_text(value if isinstance(value, str) else value.decode())
    array = np.asarray(value)
    if array.dtype.kind in "fiu":
        return _changed_number(array)
    if array.dtype.kind in "SUO" and all(isinstance(v, (str, bytes)) for v in array.ravel()):
        texts = [v.decode() if isinstance(v, bytes) else v for v in array.ravel().tolist()]
        texts[len(texts) // 2] = _changed_text(texts[len(texts) // 2])
        return np.array(texts, dtype=object).reshape(array.shape)
    return None  # a reference of HDF5 to another array; it is deleted instead


def _changes_of_attribute(place: str, name: str) -> Iterator[tuple[str, Change]]:
    def changed(file: h5py.File) -> None:
        new = _changed(file[place].attrs[name])
        del file[place].attrs[name]
        if new is not None:
            file[place].attrs[name] = new

    def deleted(file: h5py.File) -> None:
        del file[place].attrs[name]

    yield f"{place} @{name} changed", changed
    yield f"{place} @{name} deleted", deleted


def _changes(content: bytes) -> Iterator[tuple[str, Change]]:
    """Of each attribute and each array that the file contains, as HDF5 lists them."""
    places: list[str] = ["/"]
    with h5py.File(io.BytesIO(content), "r") as file:
        file.visit(places.append)
        attributes = {place: list(file[place].attrs) for place in places}
        arrays = [place for place in places if isinstance(file[place], h5py.Dataset)]
    for place in places:
        for name in attributes[place]:
            yield from _changes_of_attribute(place, name)

        def added(file: h5py.File, place: str = place) -> None:
            file[place].attrs["another"] = 1.0

        yield f"{place} @another added", added
    for place in arrays:

        def changed(file: h5py.File, place: str = place) -> None:
            new = _changed(file[place][()])
            assert new is not None
            file[place][...] = new

        def deleted(file: h5py.File, place: str = place) -> None:
            del file[place]

        yield f"{place} changed", changed
        yield f"{place} deleted", deleted


def _with(content: bytes, change: Change) -> bytes:
    stream = io.BytesIO(content)
    with h5py.File(stream, "r+") as file:
        change(file)
    return stream.getvalue()


_QUICK = (("harmonic with delay", "changed"), ("wozniak", "deleted"))
_EVERY = 4
"""Of the changes in `_QUICK`, make check tries every fourth."""


@cache
def _content(name: str) -> bytes:
    return stored(MAPS[name]())


@pytest.mark.parametrize("name", MAPS)
def test_a_map_is_read_as_it_was_written(name: str) -> None:
    assert everything(map_of(_content(name))) == everything(MAPS[name]())


@pytest.mark.parametrize(
    ("name", "way", "every"),
    [
        *((name, way, _EVERY) for name, way in _QUICK),
        *(
            pytest.param(name, way, 1, marks=pytest.mark.slow)
            for name in MAPS
            for way in ("changed", "deleted", "added")
        ),
    ],
)
def test_whatever_is_changed_is_noticed(name: str, way: str, every: int) -> None:
    content, same = _content(name), everything(MAPS[name]())
    refused = 0
    changes = [(what, change) for what, change in _changes(content) if way in what]
    for what, change in changes[::every]:
        try:
            found = map_of(_with(content, change))
        except PretravelError:
            refused += 1
        else:  # what HDF5 and NetCDF keep for themselves
            assert everything(found) == same, what
    assert refused >= 10


def test_single_bits_anywhere_in_the_file() -> None:
    """In 40 places; `make hard` tries thousands."""
    content, same = _content("harmonic"), everything(MAPS["harmonic"]())
    chance = random.Random(16)
    refused = 0
    for _ in range(40):
        place, bit = chance.randrange(len(content)), chance.randrange(8)
        changed = bytearray(content)
        changed[place] ^= 1 << bit
        try:
            assert everything(map_of(bytes(changed))) == same, (place, bit)
        except PretravelError:
            refused += 1
    assert refused > 8
