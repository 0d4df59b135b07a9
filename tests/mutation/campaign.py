"""Tests against single faults: which tests, in which order, and what they say."""

from __future__ import annotations

import ast
import os
import re
import resource
import shutil
import signal
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.mutation.faults import Fault
from tests.mutation.line_map import LineMap
from tests.mutation.scratch import PYTEST_OPTIONS, Scratch

_MAKE_MODELS = ("model", "surface", "maps")
"""Rooms that have a part in finite-element models: with a fault there, none is kept."""
_IN_OWN_PROCESS = {
    "surface/cad/file_to_brep.py": "surface/cad/kernel_process.py",
    "surface/cad/iges_bodies.py": "surface/cad/iges_reader.py",
}
"""Modules whose lines run in a process that is not followed, and the module that starts it."""
_QUICK = 1.0
"""Such tests come first. [s]"""
_SETS = (2, 6, 30)
"""Files of tests that are tried in one process, the nearest first; then all others."""
_PATIENCE = 10.0, 20.0
"""A test hangs after so many times its usual time, and so much more. [s]"""
_MEMORY = 6 * 2**30


@dataclass(frozen=True)
class Verdict:
    """What the tests say of a fault.

    Attributes
    ----------
    fault : Fault
    killer : str
        The test that failed, or what else ended; empty when the fault survived.
    tests : int
        That ran.
    executing : int
        Tests that execute the line.
    seconds : float
        Of the processor, in tests.
    """

    fault: Fault
    killer: str
    tests: int
    executing: int
    seconds: float


def try_fault(
    fault: Fault, scratch: Scratch, line_map: LineMap, patience: float, first: str = ""
) -> Verdict:
    """Run the tests that execute a fault until one fails.

    Parameters
    ----------
    fault : Fault
    scratch : Scratch
    line_map : LineMap
    patience : float
        Seconds of the processor that survivors get; a test that has begun goes on.
    first : str
        A test to begin with: the one that failed the last time.
    """
    path = f"src/pretravel/{fault.module}"
    content = (scratch.project / path).read_bytes()
    executing = tests_that_execute(fault, scratch.project, line_map)
    run, seconds = 0, 0.0
    own = fault.module.partition("/")[0] in _MAKE_MODELS
    with scratch.changed(path, fault.in_text(content)):
        for names in _in_order(fault, executing, line_map, first):
            base = scratch.temporary / ("own" if own else "shared")
            if own:
                shutil.rmtree(base, ignore_errors=True)
            base.mkdir(exist_ok=True)
            usual = {name: line_map.tests[name].seconds for name in names}
            left = patience - seconds

            def work(
                send: Callable[[Any], None],
                usual: dict[str, float] = usual, left: float = left, base: Path = base,
            ) -> None:  # fmt: skip
                _run_tests(send, usual, left, base)

            # Other work on this computer makes the clock run faster than the processor.
            sent, ended = scratch.in_fork(work, 20.0 * (left + 60.0))
            done = [s for s in sent if s[0] == "passed"]
            run += len(done)
            seconds += sum(s[2] for s in done)
            killer = next((s[1] for s in sent if s[0] == "failed"), ended)
            if killer:
                return Verdict(fault, killer, run, len(executing), seconds)
            if seconds > patience:
                break
    return Verdict(fault, "", run, len(executing), seconds)


def failing_without_fault(scratch: Scratch, line_map: LineMap, number: int = 40) -> str:
    """The first of some quick tests, of all rooms, that fails though there is no fault.

    Where there is one, every fault would look as if it were noticed.

    Parameters
    ----------
    scratch : Scratch
        With no fault in it.
    line_map : LineMap
    number : int
        Of tests, at least.

    Returns
    -------
    str
        Empty where all pass.
    """
    quick = [t for t in line_map.tests.values() if t.seconds < _QUICK]
    usual = {t.name: t.seconds for t in quick[:: max(len(quick) // number, 1)]}
    base = scratch.temporary / "without"
    base.mkdir(exist_ok=True)
    sent, ended = scratch.in_fork(lambda send: _run_tests(send, usual, 1e3, base), 1e3)
    passed = {s[1] for s in sent if s[0] == "passed"}
    missing = [name for name in usual if name not in passed]
    return next((s[1] for s in sent if s[0] == "failed"), ended) or (missing or [""])[0]


def tests_that_execute(fault: Fault, project: Path, line_map: LineMap) -> set[str]:
    """Names of tests; for a value that a module sets when it is loaded, of those that use it."""
    found = line_map.executing(fault.module, *fault.lines)
    package = project / "src/pretravel"
    if runs_when_loaded(fault.function, (package / fault.module).read_text(encoding="utf-8")):
        return found | line_map.of_module(fault.module)
    if fault.module in _IN_OWN_PROCESS and not found:
        return line_map.of_module(_IN_OWN_PROCESS[fault.module])
    if fault.function and not fault.function.rpartition(".")[2][:1].isupper():
        return found
    # A value of the module or of a class: the map has it with the test that loaded it first.
    bound = re.match(r"(\w+)\s*(:[^=]*)?=[^=]", fault.before)
    if bound:
        use = re.compile(rf"\b{bound[1]}\b")
        for path in sorted(package.rglob("*.py")):
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
                if use.search(line):
                    found |= line_map.executing(
                        path.relative_to(package).as_posix(), number, number
                    )
    return found | line_map.of_module(fault.module)


def runs_when_loaded(function: str, module: str) -> bool:
    """Whether a module calls a function of its own while it is loaded.

    Its lines belong to the test that loaded the module first; its result, to all that use it.
    """
    if not function.isidentifier():  # a method, or the module itself
        return False
    return any(
        isinstance(call, ast.Call) and isinstance(call.func, ast.Name) and call.func.id == function
        for statement in ast.parse(module).body
        if isinstance(statement, ast.Assign | ast.AnnAssign | ast.Expr)
        for call in ast.walk(statement)
    )


def _in_order(
    fault: Fault, executing: set[str], line_map: LineMap, first: str
) -> Iterable[list[str]]:
    """Sets of tests: near and quick ones first; last what else is in the same files.

    A test of the same file may use what another one made with the line.
    """
    if first in line_map.tests:
        yield [first]
    stated = {t.name for t in line_map.tests.values() if t.file.startswith(fault.tests or "-")}
    files = {line_map.tests[name].file for name in executing}
    others = {t.name for t in line_map.tests.values() if t.file in files}
    done = {first}
    for names in (stated, executing, others):
        # In the order of the map: that of each file.
        tests = [t for t in line_map.tests.values() if t.name in names - done]
        quick = [t for t in tests if t.seconds < _QUICK]
        slow = [t for t in tests if t.seconds >= _QUICK]
        quick.sort(key=lambda t: (_distance(fault, t.file), t.file))
        slow.sort(key=lambda t: t.seconds)
        for some in (quick, slow):
            yield from _parts([t.name for t in some])
        done |= names


def _parts(names: Sequence[str]) -> Iterable[list[str]]:
    sizes, files, part = list(_SETS), set[str](), list[str]()
    for name in names:
        file = name.partition("::")[0]
        if file not in files and sizes and len(files) == sizes[0]:
            yield part
            sizes, files, part = sizes[1:], set(), []
        files.add(file)
        part.append(name)
    if part:
        yield part


def _distance(fault: Fault, file: str) -> int:
    room, _, rest = fault.module.partition("/")
    if file.endswith((fault.module, f"test_{Path(rest).stem}.py")):
        return 0
    if f"/{room}/" in file:
        return 1
    return 2 if file.startswith(("tests/laws", "tests/validation")) else 3


def _run_tests(
    send: Callable[[Any], None], usual: dict[str, float], patience: float, base: Path
) -> None:
    """In a fork: send each test that passed with its time, or the one that failed."""
    import pytest

    # Reduced models are kept beside the temporary folder, as for workers that share them.
    os.environ["PYTEST_XDIST_WORKER"] = "mutation"
    resource.setrlimit(resource.RLIMIT_DATA, (_MEMORY, _MEMORY))
    order = {name: place for place, name in enumerate(usual)}
    spent = 0.0
    begun = 0.0

    def fail(what: str) -> None:
        send(("failed", what))
        os._exit(0)

    class Watch:
        @pytest.hookimpl(trylast=True)
        def pytest_collection_modifyitems(
            self, config: pytest.Config, items: list[pytest.Item]
        ) -> None:
            items[:] = sorted(
                (i for i in items if i.nodeid in order), key=lambda i: order[i.nodeid]
            )

        def pytest_collectreport(self, report: pytest.CollectReport) -> None:
            if report.failed:
                fail(f"{report.nodeid} (cannot be loaded)")

        @pytest.hookimpl(tryfirst=True)
        def pytest_runtest_logstart(self, nodeid: str) -> None:
            nonlocal begun
            begun = time.process_time()
            signal.signal(signal.SIGPROF, lambda *_: fail(f"{nodeid} (hangs)"))
            signal.setitimer(signal.ITIMER_PROF, _PATIENCE[0] * usual[nodeid] + _PATIENCE[1])

        def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
            if report.failed:
                fail(report.nodeid)

        @pytest.hookimpl(trylast=True)
        def pytest_runtest_logfinish(self, nodeid: str) -> None:
            nonlocal spent
            signal.setitimer(signal.ITIMER_PROF, 0.0)
            took = time.process_time() - begun
            spent += took
            send(("passed", nodeid, took))
            if spent > patience:
                os._exit(0)

    files = list(dict.fromkeys(name.partition("::")[0] for name in usual))
    code = pytest.main(
        [*PYTEST_OPTIONS, "--basetemp", str(base / "base"), *files], plugins=[Watch()]
    )
    if code not in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
        fail(f"pytest ended with {code}")
