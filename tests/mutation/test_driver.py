"""The driver of the faults: what it changes, which tests it runs, and what it says of them."""

from __future__ import annotations

from pathlib import Path

import pytest

import pretravel
from tests.mutation import campaign
from tests.mutation.campaign import failing_without_fault, try_fault
from tests.mutation.faults import Fault, faults_of
from tests.mutation.known_faults import named
from tests.mutation.line_map import LineMap, make_line_map
from tests.mutation.scratch import Scratch

# Workers have a thread that a fork does not need.
pytestmark = pytest.mark.filterwarnings("ignore:.*multi-threaded.*fork:DeprecationWarning")

MODULE = '''"""Sides, 1 + 2."""

import time

LEAST = 2


def area(width: float, height: float = 3) -> float:
    """Area, with 1 < 2."""
    if width < 0:
        raise ValueError(f"a width of {width + 1}")
    return width * height


def untested(width: float) -> float:
    return width * 4


def wait(count: int) -> int:
    done = 0
    while done < count:
        done += 1
    return done


def least() -> int:
    return LEAST
'''
TESTS = """import pytest

from pretravel.prediction import sides


def test_area() -> None:
    assert sides.area(2, 5) == 10


def test_area_of_a_high_wall() -> None:
    assert sides.area(2) == 6


def test_waiting() -> None:
    assert sides.wait(4) == 4


def test_least() -> None:
    assert sides.least() == 2


def test_that_fails_anyway() -> None:
    assert sides.area(1, 1) == 2
"""


def _fault(after: str, content: str = MODULE) -> Fault:
    faults = [f for f in faults_of("prediction/sides.py", content.encode()) if f.after == after]
    assert len(faults) == 1, after
    return faults[0]


@pytest.fixture(scope="module")
def project(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A project with one room of one module."""
    folder = tmp_path_factory.mktemp("faults") / "small"
    room = folder / "src/pretravel/prediction"
    room.mkdir(parents=True)
    (room / "__init__.py").write_text("")
    (room.parent / "__init__.py").write_text("")
    (room / "sides.py").write_text(MODULE)
    (folder / "tests/unit").mkdir(parents=True)
    (folder / "tests/unit/test_sides.py").write_text(TESTS)
    (folder / "pyproject.toml").write_text(
        '[tool.pytest.ini_options]\naddopts = "--import-mode=importlib"\n'
    )
    return folder


@pytest.fixture(scope="module")
def tried(project: Path) -> tuple[Scratch, LineMap]:
    kept = project.parent / "kept"
    make_line_map(project.parent / "copies", kept, 2, project)
    scratch = Scratch(project.parent / "scratch", project)
    return scratch, LineMap(scratch.project, kept)


def test_only_what_has_an_effect_is_changed() -> None:
    """Texts, annotations and errors are not; a check as a whole is."""
    assert [f.after for f in faults_of("prediction/sides.py", MODULE.encode())] == [
        "LEAST = 3",
        "def area(width: float, height: float = 4) -> float:",
        "if False:",
        "if width <= 0:",
        "if width >= 0:",
        "if width < 1:",
        "return width / height",
        "return width / 4",
        "return width * 5",
        "done = 1",
        "while done <= count:",
        "while done >= count:",
        "pass",
        "done -= 1",
        "done += 2",
    ]  # fmt: skip


def test_a_fault_changes_one_line() -> None:
    fault = _fault("return width / height")
    changed = fault.in_text(MODULE.encode()).decode()
    assert changed == MODULE.replace("width * height", "width / height")
    assert (fault.function, fault.before) == ("area", "return width * height")


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("np.sum(a, axis=1)", "np.sum(a)"),
        ("f(a, key=b, other=c)", "f(a, other=c)"),
        ("max(a, b)", "min(a, b)"),
        ("a.T @ b", "a @ b"),
        ("np.cos(-a)", "np.cos(a)"),
        ("a[1:]", "a[2:]"),
        ("a[:n]", "a[:(n) - 1]"),
        ("a & b", "a | b"),
        ("a is not None", "a is None"),
        ("a not in b", "a in b"),
        ("0.5 * a", "0.25 * a"),
        ("(a) - (b)", "(a) + (b)"),
        ("a < b <= c", "a < b < c"),
        ("f(strict=True, dtype=float)", None),
        ("f'{a + b}'", None),
        ("1e-12", None),
    ],
)  # fmt: skip
def test_kinds_of_faults(before: str, after: str | None) -> None:
    found = [f.after for f in faults_of("a.py", f"y = {before}".encode())]
    assert (f"y = {after}" in found) if after else found == []


def test_a_fault_is_drawn_by_what_it_is_not_by_where() -> None:
    moved = _fault("return width / height", f"\n\n{MODULE}")
    assert moved.rank("1") == _fault("return width / height").rank("1") != moved.rank("2")


@pytest.mark.slow
def test_tests_notice_faults(tried: tuple[Scratch, LineMap]) -> None:
    """A number, a default value, a value of the module, a loop without an end."""
    for after, test in {
        "return width / height": "test_area",
        "def area(width: float, height: float = 4) -> float:": "test_area_of_a_high_wall",
        "LEAST = 3": "test_least",
        "done += 2": None,
    }.items():
        verdict = try_fault(_fault(after), *tried, patience=20.0)
        expected = f"tests/unit/test_sides.py::{test}" if test else ""
        assert verdict.killer == expected, after


@pytest.mark.slow
def test_a_line_that_no_test_executes_is_a_survivor(tried: tuple[Scratch, LineMap]) -> None:
    verdict = try_fault(_fault("return width * 5"), *tried, patience=20.0)
    assert (verdict.killer, verdict.tests, verdict.executing) == ("", 0, 0)


@pytest.mark.slow
def test_survivors_run_the_other_tests_of_the_file(tried: tuple[Scratch, LineMap]) -> None:
    """The test that fails without a fault does not count."""
    verdict = try_fault(_fault("if width < 1:"), *tried, patience=20.0)
    assert (verdict.killer, verdict.tests, verdict.executing) == ("", 4, 2)


@pytest.mark.slow
def test_a_module_that_cannot_be_loaded_is_noticed(tried: tuple[Scratch, LineMap]) -> None:
    whole = len(MODULE.encode())
    fault = Fault("prediction/sides.py", "", "", "", "", (5, 5), (whole, whole), b"\n1 / 0\n")
    assert "cannot be loaded" in try_fault(fault, *tried, patience=20.0).killer


@pytest.mark.slow
def test_a_process_that_crashes_is_noticed(tried: tuple[Scratch, LineMap]) -> None:
    end = b"    import os; os._exit(7)\n"
    place = MODULE.encode().index(b"    return LEAST")
    fault = Fault("prediction/sides.py", "least", "", "", "", (27, 27), (place, place), end)
    assert try_fault(fault, *tried, patience=20.0).killer == "crashed"


@pytest.mark.slow
def test_tests_that_fail_without_a_fault_are_told(tried: tuple[Scratch, LineMap]) -> None:
    """Every fault would look as if it were noticed."""
    scratch, line_map = tried
    assert failing_without_fault(scratch, line_map) == ""
    content = MODULE.replace("return width * height", "return width").encode()
    with scratch.changed("src/pretravel/prediction/sides.py", content):
        assert "test_area" in failing_without_fault(scratch, line_map)
    with scratch.changed("src/pretravel/prediction/sides.py", b"import os\nos.abort()\n"):
        assert failing_without_fault(scratch, line_map) == "crashed"


@pytest.mark.slow
def test_the_file_is_whole_again(tried: tuple[Scratch, LineMap]) -> None:
    scratch, _ = tried
    assert (scratch.project / "src/pretravel/prediction/sides.py").read_text() == MODULE


@pytest.mark.slow
def test_the_map_follows_lines_that_move(project: Path, tried: tuple[Scratch, LineMap]) -> None:
    moved = project.parent / "moved"
    scratch = Scratch(moved, project)
    content = MODULE.replace("import time\n", "import time\n\n# one\n# two\n")
    content = content.replace(
        "    return width * height", "    size = 1\n    return width * height"
    )
    (scratch.project / "src/pretravel/prediction/sides.py").write_text(content)
    line_map = LineMap(scratch.project, project.parent / "kept")
    line = content.splitlines().index("    return width * height") + 1
    for place in (line - 1, line):
        assert line_map.executing("prediction/sides.py", place, place) == {
            "tests/unit/test_sides.py::test_area",
            "tests/unit/test_sides.py::test_area_of_a_high_wall",
        }


@pytest.mark.slow
def test_a_function_that_makes_a_value_of_the_module_concerns_all_its_tests(
    tried: tuple[Scratch, LineMap],
) -> None:
    """Its lines run while the module is loaded, in whichever test is the first."""
    loaded = f"{MODULE}\n\nSIDES = [untested(2.0)]\n"
    assert [campaign.runs_when_loaded(name, loaded) for name in ("untested", "area", "")] == [
        1,
        0,
        0,
    ]
    scratch, line_map = tried
    fault = _fault("return width * 5")
    path = scratch.project / "src/pretravel/prediction/sides.py"
    assert campaign.tests_that_execute(fault, scratch.project, line_map) == set()
    path.write_text(loaded)
    try:
        assert len(campaign.tests_that_execute(fault, scratch.project, line_map)) == 4
    finally:
        path.write_text(MODULE)


@pytest.mark.slow
def test_a_value_of_the_module_concerns_all_its_tests(tried: tuple[Scratch, LineMap]) -> None:
    """Its line is executed while the module is loaded, in whichever test is the first."""
    scratch, line_map = tried
    fault = _fault("LEAST = 3")
    assert len(line_map.of_module("prediction/sides.py")) == 4
    assert campaign.tests_that_execute(fault, scratch.project, line_map) == line_map.of_module(
        "prediction/sides.py"
    )


def test_the_named_faults_are_of_this_code() -> None:
    """Every one has its line, and the tests that notice it."""
    package = Path(pretravel.__file__).parent
    assert all(f.in_text((package / f.module).read_bytes()) for f in named(package))
