"""Reads the texts of the documentation and of the package with proselint, and our words with it.

Read are the prose of Markdown (without code) and, of Python, docstrings and texts of two words or
more. `vocabulary.toml` beside this file lists words that only we would use, each with the word of
the field, and the checks of proselint that are used. Exit code 1 where anything is found.

    python tools/prose.py docs README.md src
"""

from __future__ import annotations

import ast
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

from proselint.checks import __register__ as general
from proselint.config import Config
from proselint.registry import CheckRegistry
from proselint.registry.checks import Check, Padding
from proselint.registry.checks.types import PreferredForms
from proselint.tools import LintFile

VOCABULARY = Path(__file__).with_name("vocabulary.toml")
CODE = re.compile(
    r"^ *```.*?^ *```|^ *(?:>>>|\.\.\.).*?(?:\n\s*\n|\Z)"
    r"|``[^`]+``|`[^`\n]+`|\]\([^)]*\)|<[^>\n]+>|https?:\S+",
    re.DOTALL | re.MULTILINE,
)
"""Code, links and marks, in Markdown and in docstrings."""
EXEMPT = re.compile(r"[\w-]+_[\w-]+|--[\w-]+|^ *\w+ : .*$", re.MULTILINE)
"""Names of options and of code, parameters with their types."""


def _blank(text: str) -> str:
    """As many lines and characters of nothing."""
    return re.sub(r"[^\n]", " ", text)


def prose_of(text: str) -> str:
    """A text with blanks in the place of its code."""
    return EXEMPT.sub(lambda m: _blank(m[0]), CODE.sub(lambda m: _blank(m[0]), text))


def texts_of_python(source: str) -> str:
    """Docstrings and texts of two words or more, each at its line."""
    lines = [""] * (source.count("\n") + 2)
    code = source.encode().split(b"\n")  # columns are counted in bytes
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            text = prose_of(node.value)
            if len(text.split()) > 1:
                long = b'"""' in code[node.lineno - 1][node.col_offset :][:5]
                for offset, line in enumerate(text.split("\n") if long else [text]):
                    lines[node.lineno - 1 + offset] += " " + " ".join(line.split())
    return "\n".join(lines)


def checks(vocabulary: dict[str, dict[str, str]]) -> tuple[Check, ...]:
    """Checks of words that only we would use, and of forms of sentences that are read twice."""
    words = PreferredForms(items=vocabulary["words"], padding=Padding.WORDS_IN_TEXT)
    forms = PreferredForms(items=vocabulary["forms"], padding=Padding.SAFE_JOIN)
    return (
        Check(words, path="vocabulary", message="'{1}': {0}"),
        Check(forms, path="vocabulary.forms", message="'{1}': {0}"),
    )


def findings(path: Path, config: Config) -> Iterator[str]:
    """What is found in a file, with its line."""
    text = path.read_text("utf-8")
    prose = texts_of_python(text) if path.suffix == ".py" else prose_of(text)
    for found in LintFile(path.name, prose).lint(config) if prose.strip() else ():
        line = found.pos[0]
        yield f"{path}:{line}: {found.check_result.check_path}: {found.check_result.message}"


def main(names: list[str]) -> int:
    """Print what is found in files and folders; 1 where that is anything."""
    vocabulary = tomllib.loads(VOCABULARY.read_text("utf-8"))
    registry = CheckRegistry()
    registry.register_many(general)
    registry.register_many(checks(vocabulary))
    used = dict.fromkeys(vocabulary["proselint"]["checks"], True)
    config = Config(max_errors=1000, checks=used)
    paths = [
        path
        for name in map(Path, names)
        for path in (sorted(name.rglob("*")) if name.is_dir() else [name])
        if path.suffix in (".md", ".py") and "_build" not in path.parts
    ]
    found = [line for path in paths for line in findings(path, config)]
    sys.stdout.write("".join(f"{line}\n" for line in found))
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
