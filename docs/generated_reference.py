"""The parts of the reference that are made from the code when the site is built.

A page contains a comment ``<!-- generated: NAME ARGUMENT -->``; it is replaced with Markdown. What
is new in the code is thus in the site without a change of a page. What the code does not say, such
as the meaning of a column, is beside the pages in TOML, and what is missing there stops the build.
"""

from __future__ import annotations

import ast
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import typer
from sphinx.application import Sphinx

HERE = Path(__file__).parent
_MARK = re.compile(r"<!-- generated: (\S+) *(.*?) *-->")


def setup(app: Sphinx) -> dict[str, Any]:
    """Connect the extension to Sphinx."""
    from pygments.lexers import TextLexer

    app.connect("source-read", _fill_in)
    app.add_lexer("nc", TextLexer)  # programs of controls, whose words no lexer knows
    return {"parallel_read_safe": True, "version": "1"}


def _fill_in(app: Sphinx, docname: str, source: list[str]) -> None:
    del app
    up = "../" * docname.count("/")
    text = source[0].replace(f"({up}../CHANGELOG.md", f"({up}reference/changelog.md")
    source[0] = _MARK.sub(lambda found: PARTS[found[1]](found[2]), text)


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table in Markdown; line ends and bars in its cells do no harm."""
    lines = [list(head), ["---"] * len(head), *map(list, rows)]
    return "\n".join(f"| {' | '.join(map(_cell, line))} |" for line in lines) + "\n"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", r"\|")


def code(text: str) -> str:
    """Text as code; empty text stays empty."""
    return f"`{text}`" if text else ""


# Commands


def commands(group: str) -> str:
    """Every command of a group of the help, with its arguments and options."""
    from pretravel.cli.main import app

    everything: Any = typer.main.get_command(app)
    found = {n: c for n, c in everything.commands.items() if c.rich_help_panel == group}
    if not found:
        raise ValueError(f"the help has no group '{group}'")
    sections = []
    for name, command in found.items():
        for own_name, own in _leaves(name, command):
            sections.append(_command(own_name, own))
    return "\n".join(sections)


def groups() -> set[str]:
    """The groups of the help."""
    from pretravel.cli.main import app

    everything: Any = typer.main.get_command(app)
    return {command.rich_help_panel for command in everything.commands.values()}


def _leaves(name: str, command: Any) -> Iterator[tuple[str, Any]]:
    inside = getattr(command, "commands", None)
    if inside is None:
        yield name, command
        return
    for own_name, own in inside.items():
        yield from _leaves(f"{name} {own_name}", own)


def _command(name: str, command: Any) -> str:
    arguments = [p for p in command.params if p.param_type_name == "argument"]
    options = [p for p in command.params if p.param_type_name == "option"]
    used = " ".join(_in_usage(p) for p in arguments)
    parts = [
        f"## pretravel {name}",
        _paragraphs(command.help or ""),
        f"```\npretravel {name} [OPTIONS] {used}".rstrip() + "\n```",
        re.sub(r"^Example: (.*)$", r"Example: `\1`", command.epilog or ""),
    ]
    if arguments:
        rows = [(code(_metavar(p)), _meaning(p)) for p in arguments]
        parts.append(table(("argument", "meaning"), rows))
    if options:
        rows = [(_spellings(p), _value(p), _meaning(p)) for p in options]
        parts.append(table(("option", "value", "meaning"), rows))
    return "\n\n".join(parts) + "\n"


def _paragraphs(text: str) -> str:
    """Paragraphs of a help text; lines that are commands become code."""
    text = text.replace("\n\n", "\0").replace("\n", " ").replace("\0", "\n\n")
    parts = re.split(r"(pretravel [a-z-]+ .*? -o \S+)", text)
    return "".join(code(p) if i % 2 else _escaped(p) for i, p in enumerate(parts))


def _metavar(parameter: Any) -> str:
    return str(parameter.metavar or parameter.name).strip("{}")


def _in_usage(parameter: Any) -> str:
    name = _metavar(parameter) + (" …" if parameter.nargs == -1 else "")
    return name if parameter.required else f"[{name}]"


def _spellings(parameter: Any) -> str:
    return ", ".join(code(name) for name in (*parameter.opts, *parameter.secondary_opts))


def _value(parameter: Any) -> str:
    """What a value is: its choices, its range, or its type."""
    if parameter.is_flag:
        return ""
    if parameter.metavar:
        return code(str(parameter.metavar))
    kind = _without_none(parameter.type_descriptor.annotation)
    if get_origin(kind) is list:
        kind = get_args(kind)[0]
    if get_origin(kind) is Literal:
        return ", ".join(code(str(choice)) for choice in get_args(kind))
    name = {float: "number", int: "integer", Path: "file", str: "text"}.get(kind, "value")
    low, high = getattr(parameter, "min", None), getattr(parameter, "max", None)
    if low is None and high is None:
        return name
    return f"{name}, {low if low is not None else '…'} to {high if high is not None else '…'}"


def _meaning(parameter: Any) -> str:
    text = _escaped(parameter.help or "")
    if parameter.required and parameter.param_type_name == "option":
        text += " **Needed.**"
    default = parameter.default
    if default not in (None, False, True, "", ()) and not callable(default):
        text += f" Default: {code(str(default))}."
    return text


def _escaped(text: str) -> str:
    """Signs that Markdown would take for markup."""
    return re.sub(r"([*_<>#\[\]])", r"\\\1", text)


# Materials


def materials(_: str) -> str:
    """The materials by name, with their values."""
    from pretravel.prediction.materials import known_materials

    rows = [
        (
            code(name),
            f"{known.youngs_modulus / 1e3:g}",
            f"{known.poissons_ratio:g}",
            f"{known.density * 1e6:g}",
            known.source,
        )
        for name, known in sorted(known_materials().items())
    ]
    head = ("name", "Young's modulus / GPa", "Poisson's ratio", "density / g/cm³", "source")
    return table(head, rows)


# Keys of TOML files


def toml_keys(kind: str) -> str:
    """The tables of a kind of TOML file with their keys, types and usual values."""
    structure, whole, listed = _toml_kinds()[kind]
    meanings = tomllib.loads((HERE / "reference" / "toml_keys.toml").read_text("utf-8"))
    found = []
    for name, of_table, many in listed or _tables_of(whole):
        own = meanings.get(kind, {}).get(name, {})
        found.append(f"### {_table_head(name, many)}\n\n{own.pop('', '')}".rstrip())
        rows = []
        keys, hints = structure.keys(of_table), get_type_hints(of_table)
        for field in fields(of_table):
            if field.name not in keys:
                continue
            key = keys[field.name]
            meaning = field.metadata.get("meaning") or own.pop(key, None)
            if meaning is None:
                raise ValueError(f"toml_keys.toml has no meaning of [{name}] {key} ({kind})")
            type_words = _type_words(hints[field.name])
            rows.append((code(key), type_words, _usual(field, key), meaning))
        if own:
            raise ValueError(f"toml_keys.toml has unknown keys of [{name}] ({kind}): {own}")
        found.append(table(("key", "value", "usual", "meaning"), rows))
    return "\n\n".join(found)


def _table_head(name: str, many: bool) -> str:
    if not name:
        return "Above the tables"
    return f"`[[{name}]]`, any number" if many else f"`[{name}]`"


def _toml_kinds() -> dict[str, tuple[Any, Any, Any]]:
    """Structure and root of each kind of file; instead of the root, its tables."""
    from pretravel.base.toml_file import TomlStructure
    from pretravel.files import laboratory_file, machine_file
    from pretravel.prediction import catalogue, materials
    from pretravel.studies import conditions, definition, wish

    condition_tables = [
        ("prediction", conditions.Prediction, False),
        ("touch", conditions.TouchConditions, False),
        ("calibration", conditions.Calibration, False),
    ]
    return {
        "description": (catalogue._structure(()), catalogue._Description, None),
        "material": (
            materials._STRUCTURE,
            None,
            [("materials.NAME", materials._MaterialTable, False)],
        ),
        "machine": (machine_file._STRUCTURE, machine_file._Tables, None),
        "laboratory": (TomlStructure(), laboratory_file.LaboratoryStatements, None),
        "study": (definition._structure(), definition.StudyParts, None),
        "conditions": (conditions._structure(), None, condition_tables),
        "wish": (wish._structure(), wish._Whole, None),
    }


def _tables_of(whole: Any) -> Iterator[tuple[str, Any, bool]]:
    """Name, dataclass, and whether there are many, for each table of a root."""
    hints = get_type_hints(whole)
    for field in fields(whole):
        kind = _without_none(hints[field.name])
        many = get_origin(kind) is tuple
        of_table = get_args(kind)[0] if many else kind
        if is_dataclass(of_table):
            yield field.name, of_table, many


def _without_none(kind: Any) -> Any:
    if get_origin(kind) in (Union, UnionType):
        (kind,) = [part for part in get_args(kind) if part is not type(None)]
    return kind


def _type_words(kind: Any) -> str:
    kind = _without_none(kind)
    if get_origin(kind) is tuple:
        parts = get_args(kind)
        many = "a list of " if parts[-1] is Ellipsis else f"{len(parts)} "
        return many + {"number": "numbers", "text": "texts"}.get(_type_words(parts[0]), "values")
    name = getattr(kind, "__name__", "")
    if get_origin(kind) is not None:
        return "a table"
    return {
        "float": "number", "int": "integer", "str": "text", "bool": "true or false",
        "Material": "name of a material", "_Solids": "names of solids", "_ToolNumber": "number",
        "AngleList": "angles", "Levels": "list of numbers or texts",
    }.get(name, "value")  # fmt: skip


def _usual(field: Any, key: str) -> str:
    """The value where the key is missing, in the unit of the key."""
    from pretravel.base.toml_file import _UNITS

    if field.default is MISSING and field.default_factory is MISSING:
        return "needed"
    value = field.default if field.default is not MISSING else field.default_factory()
    if value is None or value == "" or value == {} or value == ():
        return ""
    endings = [ending for ending in _UNITS if key.endswith(ending)]
    if isinstance(value, float):
        value = value / _UNITS[max(endings, key=len)] if endings else value
        return "" if value in (float("inf"), float("-inf")) else f"{value:.6g}"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, tuple):
        return ", ".join(map(str, value))
    return str(value)


# Columns of CSV files


def columns(_: str) -> str:
    """The columns of every CSV file, with their meanings."""
    sections = []
    for file in csv_files():
        rows = [(code(name.replace("*", "…")), text) for name, text in file["columns"].items()]
        uses = [f"Written by {file['written_by']}."] if "written_by" in file else []
        uses += [f"Read by {file['read_by']}."] if "read_by" in file else []
        words = " ".join([*uses, file.get("note", "")]).rstrip()
        sections.append(f"## {file['title']}\n\n{words}\n\n{table(('column', 'meaning'), rows)}")
    return "\n\n".join(sections)


def csv_files() -> list[dict[str, Any]]:
    """Title, columns, and the commands that write and read it, of every kind of CSV file."""
    text = (HERE / "reference" / "columns.toml").read_text("utf-8")
    found: list[dict[str, Any]] = tomllib.loads(text)["file"]
    return found


# The Python interface


def interface(rooms: str) -> str:
    """The public functions and types of some rooms, from their docstrings."""
    import pretravel

    wanted = rooms.split()
    names = [n for n, home in pretravel._PUBLIC.items() if home.partition(".")[0] in wanted]
    blocks = []
    for name in names:
        value = getattr(pretravel, name)
        kind = "autoclass" if isinstance(value, type) else "autofunction"
        kind = "autoexception" if kind == "autoclass" and issubclass(value, Exception) else kind
        members = "\n   :members:" if kind == "autoclass" else ""
        blocks.append(
            f"## {name}\n\n```{{eval-rst}}\n.. currentmodule:: pretravel\n\n"
            f".. {kind}:: {name}{members}\n```"
        )
    return "\n\n".join(blocks)


# The gallery


def gallery(_: str) -> str:
    """Each script with its picture, and its number beside the published one."""
    folder = HERE / "gallery"
    numbers = tomllib.loads((folder / "numbers.toml").read_text("utf-8"))
    scripts = sorted(folder.glob("plot_*.py"), key=lambda path: ("_fig_" not in path.stem, path))
    return "\n\n".join(_gallery_section(script, numbers[script.stem]) for script in scripts)


def _gallery_section(script: Path, number: float) -> str:
    text = script.read_text("utf-8")
    tree = ast.parse(text)
    title, _, about = (ast.get_docstring(tree) or "").partition("\n")
    (picture,) = re.findall(r'finish\(__file__, "(.*?)"', text)
    stated = _statement(tree)
    row = (stated["quantity"], stated["published"], f"{number:.4g}", stated["source"])
    head = ("number", "published", "ours", "source")
    limits = f"{float(stated['low']):.5g} to {float(stated['high']):.5g}"
    return (
        f"## {title.rstrip('.')}\n\n{_escaped(about.strip())}\n\n"
        f"![{title}](../pictures/{picture})\n\n{table(head, [row])}\n"
        f"The script asserts {limits}: {stated['reason']}.\n\n"
        f"<details><summary>Script {script.name}</summary>\n\n"
        f"```{{literalinclude}} {script.name}\n:language: python\n```\n\n</details>"
    )


def _statement(tree: ast.Module) -> dict[str, str]:
    """The arguments of a script's STATEMENT, whose numbers may be sums and quotients."""
    (call,) = (
        node.value
        for node in tree.body
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "STATEMENT"
    )
    assert isinstance(call, ast.Call)
    names = ("quantity", "published", "source", "low", "high", "reason")
    return {n: str(eval(ast.unparse(a))) for n, a in zip(names, call.args, strict=True)}


def changelog(_: str) -> str:
    """The changelog of the repository; its links lead to the same pages from the site."""
    text = (HERE.parent / "CHANGELOG.md").read_text("utf-8")
    text = re.sub(r"\]\((?!docs/|[a-z]+:|#)", "](../../", text.partition("\n")[2])
    return text.replace("](docs/", "](../")


PARTS: dict[str, Callable[[str], str]] = {
    "commands": commands,
    "changelog": changelog,
    "columns": columns,
    "gallery": gallery,
    "interface": interface,
    "materials": materials,
    "toml-keys": toml_keys,
}
