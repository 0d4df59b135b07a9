"""The driver notices every kind of fault, and repeats its files."""

from __future__ import annotations

import os
import time

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from tests.hard import run
from tests.support.mutated_files import Reader, fault_of, mutated

SAMPLE = b"G1 X1.0 Y2.0\n" * 20


def _refuses(_: bytes) -> None:
    raise PretravelError("this is refused")


def _overflows(_: bytes) -> object:
    return np.array([1e300]) * 1e300


def _breaks(content: bytes) -> int:
    return int(content)


def _ends_the_process(_: bytes) -> None:
    os._exit(3)


def _takes_memory(_: bytes) -> object:
    return bytearray(2 * run.MEMORY)


class TestFaults:
    def test_what_is_read_or_refused_is_no_fault(self) -> None:
        for read in (len, _refuses):
            assert fault_of(Reader("a", read, (SAMPLE,)), SAMPLE) is None

    @pytest.mark.parametrize(("read", "name"), [(_breaks, "Value"), (_overflows, "RuntimeWarn")])
    def test_another_exception_is_a_fault(self, read: object, name: str) -> None:
        fault = fault_of(Reader("a", read, (SAMPLE,)), SAMPLE)  # type: ignore[arg-type]
        assert fault is not None
        assert fault.startswith(name)

    def test_a_hang_is_a_fault(self) -> None:
        fault = fault_of(Reader("a", lambda _: time.sleep(60.0), (SAMPLE,)), SAMPLE, longest=0.05)
        assert fault is not None
        assert fault.startswith("HangError")


class TestTrial:
    def test_a_reader_without_faults(self) -> None:
        trial = run.try_reader(Reader("a", len, (SAMPLE,)), seed="1", inputs=5)
        assert (trial.inputs, trial.faults) == (5, {})

    def test_a_crash_is_counted_and_the_trial_goes_on(self) -> None:
        trial = run.try_reader(Reader("a", _ends_the_process, (SAMPLE,)), seed="1", inputs=3)
        assert trial.faults == {"the process crashes": 3}
        assert trial.examples == {"the process crashes": [0, 1, 2]}

    def test_memory_is_limited(self) -> None:
        trial = run.try_reader(Reader("a", _takes_memory, (SAMPLE,)), seed="1", inputs=1)
        assert [name.partition(" ")[0] for name in trial.faults] == ["MemoryError"]


@pytest.mark.parametrize("binary", [False, True])
def test_files_are_repeated_and_differ(binary: bool) -> None:
    reader = Reader("a", len, (SAMPLE,), binary=binary)
    files = [mutated(reader, f"1 {number}") for number in range(50)]
    assert files == [mutated(reader, f"1 {number}") for number in range(50)]
    assert len(set(files)) > 40
