"""Each tutorial as a folder: its input files, and `run.sh` with its commands.

``python -m docs.example_folders`` makes ``examples/tutorials/`` again from the pages, which stay
the one place of the commands.
``cp $EXAMPLES/… NAME`` and ``cat > NAME <<'END'`` of a page become files
of the folder; other ``$EXAMPLES/NAME`` become ``NAME``, a file or folder next to ``run.sh``.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
DATA = ROOT / "examples" / "data"
FOLDERS = ROOT / "examples" / "tutorials"
HEAD = """\
#!/bin/sh
# The commands of docs/tutorials/{}.md, one after the other. Type: sh run.sh
set -e
"""


def blocks(text: str) -> Iterator[tuple[str, str]]:
    """Language and content of each block of a page, without the indentation of a list."""
    for found in re.finditer(r"^( *)```(\w+)\n(.*?)^ *```$", text, re.S | re.M):
        yield found[2], re.sub(rf"^{found[1]}", "", found[3], flags=re.M)


def tutorials() -> list[Path]:
    """The pages of tutorials that have commands."""
    pages = sorted((ROOT / "docs" / "tutorials").glob("*.md"))
    return [
        page for page in pages if any(kind == "sh" for kind, _ in blocks(page.read_text("utf-8")))
    ]


def content(page: Path) -> dict[str, bytes]:
    """Files of the folder of a tutorial, by their path in it."""
    files: dict[str, bytes] = {}

    def take(source: Path, name: str) -> None:
        for path in source.rglob("*") if source.is_dir() else [source]:
            files[Path(name, path.relative_to(source)).as_posix()] = path.read_bytes()

    def beside(found: re.Match[str]) -> str:
        take(DATA / found[1], found[1])
        return found[1]

    commands = []
    for kind, block in blocks(page.read_text("utf-8")):
        lines = iter(block.splitlines() if kind == "sh" else [])
        for line in lines:
            if copied := re.fullmatch(r"cp \$EXAMPLES/(\S+) (\S+)", line):
                take(DATA / copied[1], copied[2])
            elif here := re.fullmatch(r"cat > (\S+) <<'(\w+)'", line):
                text = "".join(f"{part}\n" for part in iter(lines.__next__, here[2]))
                files[here[1]] = text.encode()
            else:
                commands.append(re.sub(r"\$EXAMPLES/([\w./]+)", beside, line))
    files["run.sh"] = (HEAD.format(page.stem) + "".join(f"{c}\n" for c in commands)).encode()
    return files


def _main() -> None:
    shutil.rmtree(FOLDERS, ignore_errors=True)
    for page in tutorials():
        for name, data in content(page).items():
            path = FOLDERS / page.stem / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(data)


if __name__ == "__main__":
    _main()
