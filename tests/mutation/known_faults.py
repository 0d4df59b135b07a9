"""Faults that always run; each is kept by its line, so that it stays valid when lines move."""

from __future__ import annotations

import ast
import tomllib
from pathlib import Path
from typing import Any

from tests.mutation.faults import Fault

_FOLDER = Path(__file__).parent


def named(package: Path) -> list[Fault]:
    """Faults that once survived all tests.

    Parameters
    ----------
    package : Path
        Folder of the package's rooms.

    Raises
    ------
    ValueError
        A line is not in the code any more: the list must follow the code.
    """
    text = (_FOLDER / "named.toml").read_text(encoding="utf-8")
    return [_named(package, f) for f in tomllib.loads(text)["named"]]


def _named(package: Path, stated: dict[str, Any]) -> Fault:
    module, line = stated["module"], stated["line"]
    content = (package / module).read_bytes()
    lines = content.splitlines(keepends=True)
    places = [n for n, text in enumerate(lines) if text.decode().strip() == line]
    if not places:
        raise ValueError(f"named.toml: {module} has no line {line!r}: state the line as it is now")
    number = places[0]
    start = sum(len(text) for text in lines[:number])
    start += len(lines[number]) - len(lines[number].lstrip())
    tree = ast.parse(content if module.endswith(".py") else b"")
    function, statement = _around(tree, number + 1)
    return Fault(
        module, function, line, stated["fault"], stated["what"], statement,
        (start, start + len(line.encode())), stated["fault"].encode(),
        tuple(stated["tests"]),
    )  # fmt: skip


def _around(tree: ast.Module, line: int) -> tuple[str, tuple[int, int]]:
    """Name of the function around a line, and the lines of its statement."""
    names: list[str] = []
    found, body = (line, line), tree.body
    while body:
        inside = [s for s in body if s.lineno <= line <= (s.end_lineno or s.lineno)]
        if not inside:
            break
        statement = inside[0]
        if isinstance(statement, ast.FunctionDef | ast.ClassDef):
            names.append(statement.name)
        inner = [s for s in ast.iter_child_nodes(statement) if isinstance(s, ast.stmt)]
        if not inner:
            found = (statement.lineno, statement.end_lineno or line)
        body = inner
    return ".".join(names), found
