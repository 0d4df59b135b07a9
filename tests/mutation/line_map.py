"""Which tests execute which lines: each file of tests runs once under coverage, and is kept.

A kept map stays of use when the code moves: lines are followed by their text. A file of tests runs
again when it has changed itself.
"""

from __future__ import annotations

import difflib
import hashlib
import json
import os
import sys
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from tests.mutation.processes import in_processes
from tests.mutation.scratch import PROJECT, PYTEST_OPTIONS, ROOMS, Scratch

_OTHER_FOLDERS = ("browser", "machine", "hard", "mutation", "benchmarks")
"""Tests there drive a browser or a control, or do not concern these rooms."""
_DOCUMENTS = (
    "docs/in_python.md",
    "docs/finite_elements.md",
    "docs/surfaces.md",
    "docs/laboratory.md",
)
_LONGEST = 1800.0
"""A set of tests that takes longer is not used. [s]"""


@dataclass(frozen=True)
class MappedTest:
    """A test that passes.

    Attributes
    ----------
    name : str
        As pytest names it.
    seconds : float
        Of the processor, under coverage.
    """

    name: str
    seconds: float

    @property
    def file(self) -> str:
        return self.name.partition("::")[0]


class LineMap:
    """The tests that execute lines.

    Parameters
    ----------
    project : Path
        Whose lines are asked for.
    kept : Path
        Folder of the maps.
    """

    def __init__(self, project: Path, kept: Path) -> None:
        self.tests: dict[str, MappedTest] = {}
        self._lines: dict[str, dict[int, set[str]]] = defaultdict(lambda: defaultdict(set))
        self._project, self._kept = project, kept
        for name in sets_of_tests(project):
            if (path := _path(kept, name)).is_file():
                self._add(json.loads(path.read_text(encoding="utf-8")))

    def _add(self, record: dict[str, Any]) -> None:
        names: list[str] = record["tests"]
        self.tests |= {
            name: MappedTest(name, seconds)
            for name, seconds, passed in zip(
                names, record["seconds"], record["passed"], strict=True
            )
            if passed and (self._project / name.partition("::")[0]).is_file()
        }
        for module, (digest, lines) in record["lines"].items():
            path = self._project / "src/pretravel" / module
            if not path.is_file():
                continue
            places = _followed(self._kept / "sources" / digest, path)
            for old, executing in lines.items():
                for new in places.get(int(old), ()):
                    self._lines[module][new] |= {names[i] for i in executing} & self.tests.keys()

    def executing(self, module: str, first: int, last: int) -> set[str]:
        """Names of the tests that execute any of the lines first to last of a module."""
        lines = self._lines[module]
        return set().union(*(lines[n] for n in range(first, last + 1) if n in lines))

    def of_module(self, module: str) -> set[str]:
        """Names of the tests that execute any line of a module's functions."""
        return set().union(*self._lines[module].values())


def sets_of_tests(project: Path) -> dict[str, list[str]]:
    """Files that run in one process, by a name: a file of tests, or the doctests of a folder."""
    found = {}
    for path in sorted((project / "tests").rglob("test_*.py")):
        relative = path.relative_to(project)
        if relative.parts[1] not in _OTHER_FOLDERS:
            found[relative.as_posix()] = [relative.as_posix()]
    doctests = defaultdict(list)
    for path in sorted((project / "src").rglob("*.py")):
        if ">>>" in path.read_text(encoding="utf-8"):
            doctests[path.parent.relative_to(project).as_posix()].append(
                path.relative_to(project).as_posix()
            )
    documents = {name: [name] for name in _DOCUMENTS if (project / name).is_file()}
    return {**found, **doctests, **documents}


def make_line_map(folder: Path, kept: Path, processes: int = 1, project: Path = PROJECT) -> None:
    """Run the sets of tests whose map is missing or old.

    Parameters
    ----------
    folder : Path
        For copies of the project.
    kept : Path
        Where the maps are, and are put.
    processes : int
    project : Path
    """
    (kept / "sources").mkdir(parents=True, exist_ok=True)
    sets = sets_of_tests(project)

    def one(scratch: Scratch, name: str) -> str:
        sent, fault = scratch.in_fork(lambda send: send(_covered(sets[name])), _LONGEST)
        record = sent[0] if sent else {"tests": [], "seconds": [], "passed": [], "lines": {}}
        record["digest"] = _digest(scratch.project, sets[name])
        for module, value in record["lines"].items():
            content = (scratch.project / "src/pretravel" / module).read_bytes()
            digest = hashlib.sha256(content).hexdigest()[:16]
            (kept / "sources" / digest).write_bytes(content)
            record["lines"][module] = [digest, value]
        _path(kept, name).write_text(json.dumps(record), encoding="utf-8")
        failed = [t for t, ok in zip(record["tests"], record["passed"], strict=True) if not ok]
        seconds = sum(record["seconds"])
        return f"{len(record['tests'])} tests, {seconds:.1f} s {fault} {' '.join(failed)}"

    missing = [n for n in sets if _record(kept, n, project, sets[n]) is None]
    for done, (name, said) in enumerate(in_processes(processes, missing, one, folder, project), 1):
        print(f"map {done}/{len(missing)}: {name}: {said}", file=sys.stderr, flush=True)


def _covered(files: Sequence[str]) -> dict[str, Any]:
    """In a fork: the tests of files, and the lines of the rooms that each executes."""
    import coverage
    import pytest

    source = Path("src/pretravel").resolve()
    os.environ["COVERAGE_CORE"] = "ctrace"
    measured = coverage.Coverage(
        data_file=None, config_file=False, include=[f"{source}/{room}/*" for room in ROOMS]
    )
    tests: dict[str, list[Any]] = {}

    class Contexts:
        @pytest.hookimpl(wrapper=True)
        def pytest_runtest_protocol(self, item: pytest.Item) -> Iterator[None]:
            measured.switch_context(item.nodeid)
            began = time.process_time()
            result = yield
            tests[item.nodeid][0] = time.process_time() - began
            measured.switch_context("")
            return result

        def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
            entry = tests.setdefault(report.nodeid, [0.0, True])
            entry[1] &= report.outcome == "passed"

    measured.start()
    pytest.main([*PYTEST_OPTIONS, "-m", "not slow", *files], plugins=[Contexts()])
    measured.stop()
    number = {name: i for i, name in enumerate(tests)}
    data, lines = measured.get_data(), {}
    for path in data.measured_files():
        contexts = data.contexts_by_lineno(path)
        lines[Path(path).relative_to(source).as_posix()] = {
            line: sorted(number[c] for c in names if c in number)
            for line, names in contexts.items()
            if any(c in number for c in names)
        }
    return {
        "tests": list(tests),
        "seconds": [round(t[0], 3) for t in tests.values()],
        "passed": [t[1] for t in tests.values()],
        "lines": lines,
    }


def _path(kept: Path, name: str) -> Path:
    return kept / f"{name.replace('/', '.')}.json"


def _digest(project: Path, files: Sequence[str]) -> str:
    """Of tests; doctests are in the code, which moves: their names."""
    code = [f for f in files if f.startswith("src/")]
    tests = b"".join((project / f).read_bytes() for f in files if f not in code)
    return hashlib.sha256(tests + "\n".join(code).encode()).hexdigest()


def _record(kept: Path, name: str, project: Path, files: Sequence[str]) -> dict[str, Any] | None:
    path = _path(kept, name)
    if not path.is_file():
        return None
    record: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return record if record["digest"] == _digest(project, files) else None


@cache
def _followed(old: Path, new: Path) -> dict[int, list[int]]:
    """Lines of the new text for each line of the old one.

    A line that is new goes with both of its neighbours: more tests than needed, but none too few.
    """
    before = old.read_text(encoding="utf-8").splitlines()
    after = new.read_text(encoding="utf-8").splitlines()
    matched = {}
    for block in difflib.SequenceMatcher(None, before, after, autojunk=False).get_matching_blocks():
        matched |= {block.b + i: block.a + i for i in range(block.size)}
    found: dict[int, list[int]] = defaultdict(list)
    for lines in (range(len(after)), range(len(after) - 1, -1, -1)):
        last = 0
        for line in lines:
            last = matched.get(line, last)
            if line + 1 not in found[last + 1]:
                found[last + 1].append(line + 1)
    return found
