"""Rules of the house that a linter does not check."""

from __future__ import annotations

import ast
import inspect
import re
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pretravel
from tests.api import public_names

PACKAGE = Path(pretravel.__file__).parent
MOST_LINES, MOST_PARAMETERS = 60, 7
Function = ast.FunctionDef | ast.AsyncFunctionDef

# Names that two homes have, each with the reason.
SHARED_NAMES = {
    "MODEL": "the object of a compliance model: the registry finds it under this name",
    "laboratory/outliers": "of rig traces and of readings, each beside its evaluation",
}


@cache
def _modules() -> dict[str, tuple[str, ast.Module]]:
    """Source and tree of each module, by its path in the package."""
    found = {}
    for path in sorted(PACKAGE.rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        found[path.relative_to(PACKAGE).as_posix()] = (text, ast.parse(text))
    return found


@cache
def _nodes(module: str) -> list[ast.AST]:
    """All nodes of a module."""
    return list(ast.walk(_modules()[module][1]))


def _functions() -> Iterator[tuple[str, str, Function]]:
    """Module, source, function; methods and inner functions too."""
    for name, (text, _) in _modules().items():
        for node in _nodes(name):
            if isinstance(node, Function):
                yield name, text, node


_lines = cache(str.splitlines)


def _lines_of_code(text: str, function: Function) -> int:
    """Without signature, docstring, comments and empty lines."""
    body = function.body
    first = body[0].lineno
    if ast.get_docstring(function, clean=False) is not None:
        first = body[1].lineno if len(body) > 1 else (function.end_lineno or first) + 1
    lines = _lines(text)[first - 1 : function.end_lineno]
    return sum(1 for line in lines if line.strip() and not line.strip().startswith("#"))


def _parameters(function: Function) -> int:
    given = function.args
    names = [a.arg for a in (*given.posonlyargs, *given.args, *given.kwonlyargs)]
    return len(names) - (bool(names) and names[0] in ("self", "cls"))


def test_folders_of_the_makefile_are_there() -> None:
    """Some of its targets run once in a release."""
    text = (PACKAGE.parents[1] / "Makefile").read_text(encoding="utf-8")
    named = re.findall(r"tests/\w+", text)
    for inner in re.findall(r"\(addprefix tests/unit/,([^)]+)\)", text.replace("\\\n", "")):
        named += [f"tests/unit/{name}" for name in inner.split()]
    assert len(named) > 15
    assert [name for name in named if not (PACKAGE.parents[1] / name).exists()] == []


def test_functions_are_short() -> None:
    found = {
        f"{module}:{function.name}"
        for module, text, function in _functions()
        if _lines_of_code(text, function) > MOST_LINES
    }
    assert found == set()


def test_functions_have_few_parameters() -> None:
    """Not those of the command line: a command has a parameter for each of its options."""
    found = {
        f"{module}:{function.name}"
        for module, _, function in _functions()
        if not module.startswith("cli/") and _parameters(function) > MOST_PARAMETERS
    }
    # Its keywords are the settings of `QualificationSetup`, which people state one by one.
    assert found == {"qualification/qualifying.py:qualify"}


def test_no_file_imports_itself_through_others() -> None:
    """Imports inside functions and for types alone too: what a file needs lies below it."""
    needed = {
        module: sorted(set(_imported(module)) - {module, "__init__.py"}) for module in _modules()
    }
    assert sum(map(len, needed.values())) > 1000
    TopologicalSorter(needed).prepare()  # a circle is a CycleError, which names its files


def _imported(module: str) -> Iterator[str]:
    """Modules of the package that a module imports, by their paths."""
    for node in _nodes(module):
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("pretravel"):
            assert node.module is not None
            for alias in node.names:
                behind = _door(node.module).get(alias.name)
                name = f"{node.module}.{alias.name}"
                yield behind or _path_of(name) or _path_of(node.module) or "__init__.py"
        if isinstance(node, ast.Import):
            yield from filter(None, (_path_of(alias.name) for alias in node.names))


@cache
def _door(module: str) -> dict[str, str]:
    """The files that have the names of a room's door; none of what is no room."""
    stub = PACKAGE / "/".join(module.split(".")[1:]) / "__init__.pyi"
    if module == "pretravel" or not stub.exists():
        return {}
    lines = re.findall(r"^from \.([\w.]*) import (\w+) as", stub.read_text("utf-8"), re.M)
    paths = {name: _path_of(f"{module}.{place or name}") for place, name in lines}
    return {name: path for name, path in paths.items() if path is not None}


def _room(module: str) -> str:
    """The room of a module: of the tasks each is one."""
    parts = module.split(".")[1:]
    return ".".join(parts[:2] if parts[:1] == ["tasks"] else parts[:1])


def test_rooms_use_each_other_through_their_doors() -> None:
    """Names of another room come from its ``__init__``, which imports them when they are used."""
    found = set()
    for path in _modules():
        here = _room("pretravel." + path.removesuffix(".py").replace("/", "."))
        for node in _nodes(path):
            module = node.module or "" if isinstance(node, ast.ImportFrom) else ""
            room = _room(module) if module.startswith("pretravel.") else here
            if room != here and path != "__init__.py" and module != f"pretravel.{room}":
                found.add(f"{path}: {module}")
    assert found == set()


def test_doors_have_what_is_used_and_no_more() -> None:
    everything = [
        path.read_text("utf-8")
        for folder in ("src", "tests", "docs", "benchmarks", "examples")
        for path in (PACKAGE.parents[1] / folder).rglob("*")
        if path.suffix in (".py", ".md") and path.name != "__init__.pyi"
    ]
    used = set()
    for text in everything:
        for module, names in re.findall(r"from pretravel([\w.]*) import (\([^)]*\)|.*)", text):
            used |= {f"{module}.{name}" for name in re.findall(r"\w+", names)}
        used |= {name.removeprefix("pretravel") for name in re.findall(r"pretravel[\w.]+", text)}
        for module, name in re.findall(r"([\w.]+):(\w+)", text):  # loaded by its place
            used.add(f".{module.removeprefix('pretravel.')}.{name}")
    idle = {
        f"{room}: {name}"
        for stub in PACKAGE.rglob("*/__init__.pyi")
        for room in [".".join(stub.parent.relative_to(PACKAGE).parts)]
        for name in re.findall(r" as (\w+)$", stub.read_text("utf-8"), re.M)
        if f".{room}.{name}" not in used
    }
    assert idle == set()


def _path_of(name: str) -> str | None:
    """The path of a module of the package, None for any other name."""
    parts = "/".join(name.split(".")[1:])
    paths = (f"{parts}.py", f"{parts}/__init__.py") if parts else ("__init__.py",)
    return next((path for path in paths if path in _modules()), None)


def _public_names(tree: ast.Module) -> Iterator[str]:
    """Types and constants that a module defines."""
    for node in tree.body:
        if isinstance(node, ast.ClassDef):
            yield node.name
        targets = node.targets if isinstance(node, ast.Assign) else []
        targets = [node.target] if isinstance(node, ast.AnnAssign) else targets
        for target in targets:
            for part in ast.walk(target):
                if isinstance(part, ast.Name):
                    yield part.id


def test_types_modules_and_constants_have_names_of_their_own() -> None:
    """A module within its room; those of commands, tasks and screens are called like these."""
    homes: dict[str, list[str]] = defaultdict(list)
    for module, (_, tree) in _modules().items():
        *folders, stem = module.removesuffix("/__init__.py").removesuffix(".py").split("/")
        if not {"cli", "tasks", "screen"} & set(folders) and folders[-1:] != [stem]:
            homes["/".join([*folders[:1], stem])].append(module)
        for name in set(_public_names(tree)):
            if name[0].isupper():
                homes[name].append(module)
    found = {name for name, modules in homes.items() if len(modules) > 1}
    assert found == set(SHARED_NAMES)


def test_public_names_are_documented() -> None:
    """Functions and types have a docstring of their own, not one of a base class."""
    for name in pretravel.__all__:
        value = getattr(pretravel, name)
        if inspect.isroutine(value) or inspect.isclass(value):
            text = (value.__doc__ or "").strip()
            assert text, name
            # A dataclass without a docstring has its signature there.
            assert not text.startswith(f"{name}("), name


def test_public_names_are_written_down() -> None:
    """What is new: ``python -m tests.api.public_names``. What goes: docs/stability.md."""
    new = set(public_names.current_lines())
    new -= set(public_names.recorded_lines(public_names.FILE.read_text("utf-8")))
    assert new == set(), "python -m tests.api.public_names writes them down"


def test_messages_of_the_library_name_quantities_not_options() -> None:
    """The command line adds its options to a message: cli/command.py. Screens show commands.

    Of tasks only faults are messages of the library: their settings and warnings name options.
    """
    found = set()
    for module, (_, tree) in _modules().items():
        parts = set(module.split("/"))
        if parts & {"cli", "screen", "screen.py", "every_task.py"}:
            continue
        raised = [node for node in _nodes(module) if isinstance(node, ast.Raise)]
        told = raised if parts & {"task", "tasks", "demo"} else [tree]
        if any(_names_an_option(text) for part in told for text in _strings(part)):
            found.add(module)
    assert found == set()


def _strings(tree: ast.AST) -> Iterator[str]:
    """Not the strings that are statements: docstrings of modules, classes, functions, values."""
    docstrings = {node.value for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        text = node.value if isinstance(node, ast.Constant) else None
        if isinstance(text, str) and node not in docstrings:
            yield text


def _names_an_option(text: str) -> bool:
    return re.search(r"(?<![\w-])--[a-z]", text) is not None
