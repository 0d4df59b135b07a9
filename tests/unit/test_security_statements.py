"""What docs/security.md states about connections, databases and objects that are unpickled."""

from __future__ import annotations

import ast
import csv
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pretravel

PACKAGE = Path(pretravel.__file__).parent
NETWORK = {
    "aiohttp", "distributed", "fastapi", "ftplib", "http", "httpx", "nicegui", "requests",
    "smtplib", "socket", "socketserver", "ssl", "starlette", "urllib", "uvicorn",
    "webbrowser", "xmlrpc",
}  # fmt: skip
DATABASES = {"dbm", "sqlite3"}
OBJECTS = {"cloudpickle", "dill", "joblib", "marshal", "pickle", "shelve"}


def _imported(path: Path) -> Iterator[str]:
    """The first parts of the names of all modules that a file imports, also inside functions."""
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield node.module.partition(".")[0]


@cache
def _imports() -> dict[str, set[str]]:
    return {
        path.relative_to(PACKAGE).as_posix(): set(_imported(path)) for path in PACKAGE.rglob("*.py")
    }


def _importers(names: set[str]) -> set[str]:
    return {module for module, imported in _imports().items() if names & imported}


def _is_of_the_workbench(name: str) -> bool:
    """The room of the workbench, and the screens beside their tasks."""
    return name.startswith("app/") or "screen" in name.removesuffix(".py").split("/")


def test_only_the_workbench_and_dask_use_the_network() -> None:
    found = {name for name in _importers(NETWORK) if not _is_of_the_workbench(name)}
    # cli/app.py: the page that it opens in the browser.
    assert found - {"cli/app.py"} == {"design/studies/workers.py"}


def test_objects_are_unpickled_between_own_processes_only() -> None:
    assert _importers(OBJECTS) == {"app/task_process.py"}


def test_no_database_is_opened() -> None:
    """A journal beside one names other files, which SQLite deletes."""
    assert _importers(DATABASES) == set()


def test_every_test_that_the_table_of_entries_names_is_there() -> None:
    tests = Path(__file__).parents[1]
    table = tests.parent / "docs" / "results" / "security-entries.csv"
    with table.open(encoding="utf-8", newline="") as stream:
        rows = [row["shown by"] for row in csv.DictReader(stream)]
    named = [re.findall(r"`([a-z_0-9/]+\.py)(?:::(\w+))?`", row) for row in rows]
    assert len(named) > 20
    assert all(named)
    for file, test in {each for row in named for each in row}:
        assert f"def {test}(" in (tests / file).read_text("utf-8") or not test, f"{file}::{test}"


def test_the_release_runs_actions_by_their_commits() -> None:
    """A tag can be moved to other code, which would sign and publish what it likes."""
    text = (Path(__file__).parents[2] / ".github/workflows/release.yml").read_text("utf-8")
    used = re.findall(r"uses: (\S+)", text)
    assert used
    assert [each for each in used if not re.fullmatch(r"[\w-]+/[\w-]+@[0-9a-f]{40}", each)] == []
