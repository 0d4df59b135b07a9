"""The parts of the reference that are made from the code when the site is built.

A page contains a comment ``<!-- generated: NAME ARGUMENT -->``; it is replaced with Markdown. What
is new in the code is thus in the site without a change of a page. Where a second comment, `END`,
follows, the Markdown between the two is in the repository too, for those who read the page there:
``python -m docs.generated_reference`` renews it. What the code does not say, such
as the meaning of a column, is next to the pages in TOML, and what is missing there stops the build.
"""

from __future__ import annotations

import ast
import csv
import inspect
import itertools
import math
import re
import tomllib
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass
from pathlib import Path
from types import UnionType
from typing import Any, Union, get_args, get_origin, get_type_hints

from sphinx.application import Sphinx

from pretravel.cli.app import App
from pretravel.task.listed import GROUPS, task_named
from pretravel.task.task import Setting, Task, settings_of

HERE = Path(__file__).parent
END = "<!-- generated until here -->"
RENEWED = (HERE / "nomenclature.md", HERE / "reference" / "materials.md")
"""Pages whose generated parts are in the repository too."""
_MARK = re.compile(
    r"<!-- generated: (\S+) *(.*?) *-->"
    rf"(?P<written>\n(?:(?!<!-- generated:).)*?{re.escape(END)})?",
    re.DOTALL,
)


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


def renewed(text: str) -> str:
    """A page with new text between its marks, where they have an end."""

    def part(found: re.Match[str]) -> str:
        if found["written"] is None:
            return found[0]
        mark = f"<!-- generated: {f'{found[1]} {found[2]}'.strip()} -->"
        return f"{mark}\n\n{PARTS[found[1]](found[2]).strip()}\n\n{END}"

    return _MARK.sub(part, text)


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
    if group not in GROUPS:
        raise ValueError(f"the help has no group '{group}'")
    tasks = [*map(task_named, GROUPS[group]), *([App] if group == "Start" else ())]
    return "\n".join(map(_command, tasks))


def _command(task: type[Task]) -> str:
    settings = settings_of(task)
    arguments = [each for each in settings if each.field.positional]
    options = [each for each in settings if not each.field.positional]
    used = " ".join(_in_usage(each) for each in arguments)
    parts = [
        f"## pretravel {task.name}",
        _paragraphs(inspect.cleandoc(task.__doc__ or "").partition("\n\nAttributes\n")[0]),
        f"```\npretravel {task.name} [OPTIONS] {used}".rstrip() + "\n```",
        f"Example: `{task.example}`",
    ]
    if arguments:
        rows = [(code(_metavar(each)), _meaning(each)) for each in arguments]
        parts.append(table(("argument", "meaning"), rows))
    if options:
        rows = [(_spellings(each), _value(each), _meaning(each)) for each in options]
        parts.append(table(("option", "value", "meaning"), rows))
    return "\n\n".join(parts) + "\n"


def _paragraphs(text: str) -> str:
    """Paragraphs of a help text; lines that are commands become code."""
    text = text.replace("\n\n", "\0").replace("\n", " ").replace("\0", "\n\n")
    parts = re.split(r"(pretravel [a-z-]+ .*? -o \S+)", text)
    return "".join(code(p) if i % 2 else _escaped(p) for i, p in enumerate(parts))


def _metavar(setting: Setting) -> str:
    return setting.field.metavar or setting.plain_name


def _in_usage(setting: Setting) -> str:
    name = _metavar(setting) + (" …" if setting.several else "")
    return name if setting.default is MISSING else f"[{name}]"


def _spellings(setting: Setting) -> str:
    names = (*setting.option.split("/"), *filter(None, (setting.field.short,)))
    return ", ".join(map(code, names))


def _value(setting: Setting) -> str:
    """What a value is: its form, its choices, or its type with range and unit."""
    if setting.kind is bool:
        return ""
    if setting.field.metavar:
        return code(setting.field.metavar)
    if setting.choices:
        return ", ".join(map(code, setting.choices))
    name = {float: "number", int: "integer", Path: "file", str: "text"}.get(setting.kind, "value")
    low, high = setting.limits
    limits = f", {low:.9g} to {high:.9g}" if low > -math.inf or high < math.inf else ""
    return f"{name}{limits} {setting.unit}".rstrip()


def _meaning(setting: Setting) -> str:
    text = _escaped(setting.help)
    default = setting.default
    if default is MISSING:
        return text if setting.field.positional else f"{text} **Needed.**"
    if default in (None, False, True, "", ()):
        return text
    values = default if setting.several else (default,)
    return f"{text} Default: {', '.join(code(setting.text(each)) for each in values)}."


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
            "" if known.hardness is None else f"{known.hardness / 1e3:g}",
            known.source,
        )
        for name, known in sorted(known_materials().items())
    ]
    head = (
        "name",
        "Young's modulus / GPa",
        "Poisson's ratio",
        "density / g/cm³",
        "hardness / GPa",
        "source",
    )
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
    from pretravel.design.studies import conditions, definition, wish
    from pretravel.files import laboratory_file, machine_file
    from pretravel.prediction import catalogue, materials

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
            [("materials.NAME", materials.MaterialTable, False)],
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
    """The columns of every CSV file, with their meanings; columns of one meaning share a row."""
    sections = []
    for file in csv_files():
        rows = [
            (", ".join(code(name.replace("*", "…")) for name, _ in same), text)
            for text, same in itertools.groupby(file["columns"].items(), key=lambda item: item[1])
        ]
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


# Validation


@dataclass
class Published:
    """A numbered equation, table or figure of a paper, our number, and its tests."""

    paper: str
    item: str
    what: str = ""
    ours: str = ""
    theirs: str = ""
    verdict: str = ""
    command: str = ""
    tests: tuple[str, ...] = ()

    @property
    def place(self) -> tuple[int, list[int]]:
        """Where the item stands in the table: its kind and its first number."""
        kind, _, numbers = self.item.partition(" ")
        first = re.match(r"\d+(\.\d+)*", numbers)
        parts = list(map(int, first[0].split("."))) if first else []
        return ("Equation", "Table", "Figure", "Section").index(kind.removesuffix("s")), parts


def published_rows(paper: str) -> list[Published]:
    """The rows of a paper, from ``pytest.mark.published`` of the tests, in order.

    One marker of an item states all columns; markers of further tests name the paper and the item.
    """
    with (HERE / "results" / "published-without-test.csv").open(
        encoding="utf-8", newline=""
    ) as file:
        without = [Published(**row) for row in csv.DictReader(file)]  # type: ignore[arg-type]
    rows = {row.item: row for row in without if row.paper == paper}
    for path in sorted((HERE.parent / "tests").rglob("test_*.py")):
        text = path.read_text("utf-8")
        if "mark.published(" not in text:
            continue
        for name, arguments, columns in _published_markers(ast.parse(text)):
            if arguments[0] != paper:
                continue
            row = rows.setdefault(arguments[1], Published(*arguments))
            row.tests += (f"{path.stem}: `{name}`",)
            for column, value in columns.items():
                if getattr(row, column):
                    raise ValueError(f"{paper}, {row.item}: two tests state '{column}'")
                setattr(row, column, value)
    return sorted(rows.values(), key=lambda row: row.place)


def _published_markers(tree: ast.Module) -> Iterator[tuple[str, list[str], dict[str, str]]]:
    for node in ast.walk(tree):
        for call in node.decorator_list if isinstance(node, ast.FunctionDef) else ():
            if isinstance(call, ast.Call) and ast.unparse(call.func) == "pytest.mark.published":
                columns = {k.arg or "": ast.literal_eval(k.value) for k in call.keywords}
                yield node.name, [ast.literal_eval(each) for each in call.args], columns


def published(paper: str) -> str:
    """The rows of a paper as a table."""
    head = ("item", "what it is", "ours", "theirs", "test or command", "verdict")
    return table(head, (
        (row.item, row.what, row.ours, row.theirs,
         ", ".join([*row.tests, *filter(None, (code(row.command),))]), row.verdict)
        for row in published_rows(paper)
    ))  # fmt: skip


def results(name: str) -> str:
    """A table of results that a script of benchmarks printed, kept in docs/results."""
    with (HERE / "results" / f"{name}.csv").open(encoding="utf-8", newline="") as stream:
        head, *rows = csv.reader(stream)
    return table(head, rows)


# Formats


def formats(_: str) -> str:
    """The formats that are read or written."""
    from pretravel.files.format_registry import FORMATS

    head = ("format", "what it is", "read", "written", "needs", "verified against")
    listed = [each for each in FORMATS.values() if not each.refusal]
    return table(head, (
        (code(f.name), f.what, f.reads, f.writes, f.needs, f.verified) for f in listed
    ))  # fmt: skip


def refused_formats(_: str) -> str:
    """The formats that are recognised and refused."""
    from pretravel.files.format_registry import FORMATS

    head = ("format", "what it is", "why it is refused")
    refused = [each for each in FORMATS.values() if each.refusal]
    return table(head, ((code(f.name), f.what, f.refusal) for f in refused))


def statements(_: str) -> str:
    """What each format does with lines and columns that change what rows mean."""
    from pretravel.files.format_registry import FORMATS
    from pretravel.files.row_statements import statement_rows

    rows = [
        row
        for f in FORMATS.values()
        for row in statement_rows(f.name, (*f.columns, *f.statements), f.other_lines)
    ]
    head = table(("format", "statement", "changes", "outcome"), ())
    return head + "\n".join(rows) + "\n"


# The glossary


def glossary(span: str) -> str:
    """The words of the glossary from one to another, with their meanings and units."""
    from pretravel.show.glossary_terms import glossary

    first, last = span.split(" … ")
    terms = [entry.term for entry in glossary()]
    chosen = glossary()[terms.index(first) : terms.index(last) + 1]
    units = {each.term: f" [{each.unit}]" if each.unit else "" for each in chosen}
    return "".join(f"- **{each.term}**: {each.meaning}{units[each.term]}\n" for each in chosen)


# The Python interface


def interface(rooms: str) -> str:
    """The public functions and types of some rooms, from their docstrings."""
    import pretravel

    wanted = rooms.split()
    names = [n for n, home in public_names().items() if home.partition(".")[0] in wanted]
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


def public_names() -> dict[str, str]:
    """The module of each public name, as the list of the package states it."""
    import pretravel

    stub = Path(pretravel.__file__).with_suffix(".pyi").read_text("utf-8")
    imports = [node for node in ast.parse(stub).body if isinstance(node, ast.ImportFrom)]
    return {each.name: node.module or "" for node in imports for each in node.names}


# The gallery


def gallery(_: str) -> str:
    """Each script with its picture, and its number next to the published one."""
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
    "formats": formats,
    "gallery": gallery,
    "glossary": glossary,
    "interface": interface,
    "materials": materials,
    "published": published,
    "refused-formats": refused_formats,
    "results": results,
    "statements": statements,
    "toml-keys": toml_keys,
}

if __name__ == "__main__":
    for page in RENEWED:
        page.write_text(renewed(page.read_text("utf-8")), "utf-8")
