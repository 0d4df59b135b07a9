"""Law of every reader: a damaged file is read or refused; no other error, no hang, no warning.

A short trial; `make hard` is the long one.
"""

from __future__ import annotations

import pytest

from tests.hard.run import READERS
from tests.support.mutated_files import CORPUS, fault_of, mutated

TEXTS, BINARY = 60, 20
"""Mutated files for each reader."""
QUICK = 0.4
"""Part of them that the quick tests try."""


def _tried(name: str, first: float, last: float) -> None:
    """Mutated files from one part of their number to another."""
    reader = READERS[name]
    count = BINARY if reader.binary else TEXTS
    for number in range(int(first * count), int(last * count)):
        fault = fault_of(reader, mutated(reader, f"check {number}"))
        assert fault is None, f"python -m tests.hard.run {name} --seed check --show {number}"


@pytest.mark.parametrize("name", READERS)
def test_a_mutated_file_is_read_or_refused(name: str) -> None:
    _tried(name, 0.0, QUICK)


@pytest.mark.slow
@pytest.mark.parametrize("name", READERS)
def test_more_mutated_files_are_read_or_refused(name: str) -> None:
    _tried(name, QUICK, 1.0)


@pytest.mark.parametrize("name", READERS)
def test_samples_are_read(name: str) -> None:
    """Mutations of what is refused at its first line would try nothing more."""
    reader = READERS[name]
    if name != "refused":
        assert any(_is_read(name, sample) for sample in reader.samples)


def _is_read(name: str, content: bytes) -> bool:
    try:
        READERS[name].read(content)
    except ValueError:
        return False
    return True


@pytest.mark.parametrize(
    "place", sorted(p.relative_to(CORPUS).as_posix() for p in CORPUS.glob("*/*"))
)
def test_files_that_once_broke_a_reader(place: str) -> None:
    name = place.partition("/")[0]
    assert fault_of(READERS[name], (CORPUS / place).read_bytes()) is None
