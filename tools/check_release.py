"""Builds the package, installs it into bare environments, and tries what a user does first.

``make release-check`` runs it. It needs uv, and takes the versions of Python that uv finds; it
states what was not tried. A folder as its argument gets both distributions where all went well.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import time
import tomllib
import zipfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
PYTHONS = ("3.11", "3.12", "3.13", "3.14")
IN_WHEEL = (
    "pretravel/py.typed",
    "pretravel/example_data/sphere_touches.csv",
    "pretravel/show/templates/page.html",
    "pretravel/show/scripts/plotly.min.js.gz",
    "pretravel/show/scripts/plotly.licence.txt",
    "pretravel/controls/templates/linuxcnc/map.ngc",
    "pretravel/app/__init__.py",
)
"""Files that are not Python: tests in a checkout do not notice when the wheel loses them."""
IN_SOURCE = (
    "Makefile",
    "requirements-dev.lock",
    "docs/index.md",
    "docs/_build/site/index.html",
    "docs/_build/site/searchindex.js",
    "docs/_build/site/tutorials/first-qualification.html",
)
"""Files of the source distribution: the site is there as text, and built."""
NOT_IN_WHEEL = re.compile(r"^(tests|docs|examples|benchmarks|tools)/")


class ReleaseError(Exception):
    """Something that a user would meet."""


@dataclass
class Trials:
    """What was tried, and what was not."""

    failed: list[str] = field(default_factory=list)
    not_tried: list[str] = field(default_factory=list)

    def run(self, name: str, trial: Callable[[], None]) -> bool:
        """Try something; say how it went and how long it took."""
        begin = time.monotonic()
        try:
            trial()
        except ReleaseError as error:
            self.failed.append(name)
            print(f"FAILED  {name}\n{error}", flush=True)
            return False
        print(f"ok      {name}  ({time.monotonic() - begin:.0f} s)", flush=True)
        return True


def run(command: Sequence[str | Path], folder: Path, *, codes: tuple[int, ...] = (0,)) -> str:
    """What a program prints, without what this environment adds to its own programs."""
    kept = {
        name: value
        for name, value in os.environ.items()
        if name not in ("VIRTUAL_ENV", "PYTHONPATH", "PYTHONHOME")
    }
    found = subprocess.run(
        [str(word) for word in command],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        env={**kept, "PRETRAVEL_CACHE": str(folder / "cache"), "NO_COLOR": "1", "COLUMNS": "200"},
    )
    printed = found.stdout + found.stderr
    if found.returncode not in codes:
        words = " ".join(str(word) for word in command)
        raise ReleaseError(f"{words}\nended with {found.returncode}\n{printed[-3000:]}")
    return printed


@dataclass(frozen=True)
class Environment:
    """A virtual environment with nothing in it but what is installed here."""

    folder: Path

    @staticmethod
    def made(folder: Path, python: str, *packages: str | Path) -> Environment:
        """With packages, and what these need."""
        run(["uv", "venv", "--quiet", "--python", python, folder], folder.parent)
        found = Environment(folder)
        run(["uv", "pip", "install", "--quiet", "--python", found.python, *packages], folder.parent)
        return found

    @property
    def python(self) -> Path:
        return self.folder / "bin" / "python"

    @property
    def command(self) -> Path:
        return self.folder / "bin" / "pretravel"


def build(folder: Path) -> tuple[Path, Path]:
    """Source distribution with the built site, and the wheel that is built from it alone."""
    run(["make", "--silent", "-C", ROOT, "docs"], folder)
    run(["uv", "build", "--quiet", "--out-dir", folder, ROOT], folder)
    (source,), (wheel,) = folder.glob("*.tar.gz"), folder.glob("*.whl")
    return source, wheel


def check_source(source: Path) -> None:
    """The source distribution contains the site, its search too."""
    with tarfile.open(source) as opened:
        names = {name.partition("/")[2] for name in opened.getnames()}
    missing = [name for name in IN_SOURCE if name not in names]
    if missing:
        raise ReleaseError(f"missing in the source distribution: {missing}")


def check_content(wheel: Path) -> None:
    """Files of the wheel, and what its metadata state."""
    with zipfile.ZipFile(wheel) as opened:
        names = opened.namelist()
        (place,) = (name for name in names if name.endswith(".dist-info/METADATA"))
        metadata = opened.read(place).decode()
    missing = [name for name in IN_WHEEL if name not in names]
    extra = [name for name in names if NOT_IN_WHEEL.match(name)]
    if missing or extra:
        raise ReleaseError(f"missing in the wheel: {missing}; too much: {extra}")
    for line in ("License-Expression: MIT", f"Requires-Python: {PROJECT['requires-python']}"):
        if line not in metadata:
            raise ReleaseError(f"the metadata do not state '{line}'")


def check_first_steps(environment: Environment, folder: Path, version: str) -> None:
    """Help, version, the demonstration, and the library, in an empty folder."""
    folder.mkdir()
    if "qualify" not in run([environment.command, "--help"], folder):
        raise ReleaseError("--help does not list the commands")
    said = run([environment.command, "--version"], folder).strip()
    if said != f"pretravel {version}":
        raise ReleaseError(f"--version says '{said}', the wheel is {version}")
    run([environment.command, "demo", "-o", "demo"], folder)
    if not (folder / "demo" / "part_points.csv").exists():
        raise ReleaseError(f"demo wrote {[path.name for path in folder.glob('demo/*')]}")
    program = (
        "import pretravel; from pathlib import Path; "
        "assert not any(p.name == 'src' for p in Path(pretravel.__file__).parents); "
        "print(pretravel.read_points('demo/part_points.csv'))"
    )
    if "Points(" not in run([environment.python, "-c", program], folder):
        raise ReleaseError("the points of the demonstration cannot be read")


@dataclass(frozen=True)
class ExtraTrial:
    """What an extra is for: a command that fails with a hint without it, and works with it."""

    command: tuple[str, ...]
    hint: str
    ends: bool = True


EXTRAS: Mapping[str, ExtraTrial] = {
    "app": ExtraTrial(("app", "--no-browser"), 'pip install "pretravel[app]"', ends=False),
    "fem": ExtraTrial(("fem", "omp40-2"), 'pip install "pretravel[fem]"'),
    "cad": ExtraTrial(("faces", "part.step"), 'pip install "pretravel[cad]"'),
    "tables": ExtraTrial(
        ("convert", "touches.csv", "-o", "touches.parquet"), 'pip install "pretravel[tables]"'
    ),
    "scale": ExtraTrial(
        ("study", "preload-and-seats", "--workers", "2", "-o", "study.nc"),
        'pip install "pretravel[scale]"',
    ),
}
ALL = "all"
"""The extra that names the others."""


def check_extra(name: str, bare: Environment, full: Environment, folder: Path) -> None:
    """Without the extra a plain message, with it the result."""
    trial = EXTRAS[name]
    folder.mkdir()
    for name_here, kept in (("touches.csv", "sphere_touches.csv"), ("part.step", "part.step")):
        (folder / name_here).write_bytes((ROOT / "examples" / "data" / kept).read_bytes())
    said = run([bare.command, *trial.command], folder, codes=(2,))
    if trial.hint not in said or "Traceback" in said:
        raise ReleaseError(f"without the extra {name} the message does not help:\n{said}")
    if trial.ends:
        run([full.command, *trial.command], folder)
    else:
        run([full.python, "-c", "import pretravel.app.server"], folder)


def check_types(environment: Environment, folder: Path) -> None:
    """Type checkers accept a user's program, and find the mistakes of another one."""
    folder.mkdir()
    scripts = ROOT / "tests" / "release"
    names = ("users_script.py", "users_mistakes.py")
    for name in names:
        (folder / name).write_bytes((scripts / name).read_bytes())
    marked = {
        number
        for number, line in enumerate((folder / names[1]).read_text("utf-8").splitlines(), 1)
        if line.endswith("# mistake")
    }
    python = str(environment.python)
    pyright = ["uvx", "--quiet", "basedpyright", "--pythonpath", python, "--outputjson", *names]
    text = run(pyright, folder, codes=(0, 1))
    report = json.loads(text[text.index("{") : text.rindex("}") + 1])
    errors = [
        (Path(each["file"]).name, each["range"]["start"]["line"] + 1)
        for each in report["generalDiagnostics"]
        if each["severity"] == "error"
    ]
    _compare("pyright", errors, names[1], marked)
    mypy = ["uvx", "--quiet", "mypy", "--strict", "--python-executable", python, *names]
    text = run(mypy, folder, codes=(0, 1))
    errors = [(a, int(b)) for a, b in re.findall(r"^(\S+?):(\d+): error", text, re.M)]
    _compare("mypy", errors, names[1], marked)


def _compare(checker: str, errors: list[tuple[str, int]], name: str, marked: set[int]) -> None:
    expected = {(name, number) for number in marked}
    if set(errors) != expected:
        raise ReleaseError(
            f"{checker}: wrongly found {sorted(set(errors) - expected)}, "
            f"not found {sorted(expected - set(errors))}"
        )


def check_notebook(environment: Environment, folder: Path) -> None:
    """Jupyter executes the notebook of the examples."""
    folder.mkdir()
    packages = ["nbclient", "nbformat", "ipykernel"]
    run(["uv", "pip", "install", "--quiet", "--python", environment.python, *packages], folder)
    program = (
        "import sys, nbformat; from nbclient import NotebookClient; "
        "book = nbformat.read(sys.argv[1], 4); nbformat.validate(book); "
        "NotebookClient(book, resources={'metadata': {'path': sys.argv[2]}}).execute(); "
        "print('cards:', sum('text/html' in output.get('data', {}) for cell in book.cells "
        "for output in cell.get('outputs', [])))"
    )
    examples = ROOT / "examples"
    notebook = examples / "main_job.ipynb"
    shown = run([environment.python, "-c", program, notebook, examples], folder)
    cards = re.search(r"^cards: (\d+)$", shown, re.M)
    if cards is None or int(cards[1]) < 6:
        raise ReleaseError(f"fewer than six cells show a card or a table\n{shown}")


def interpreter(version: str) -> str | None:
    """An interpreter of this version: one that uv finds, or one of pyenv that is switched off."""
    command = ["uv", "python", "find", version]
    found = subprocess.run(command, capture_output=True, text=True, check=False)
    if found.returncode == 0:
        return found.stdout.strip()
    places = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    return next((str(path) for path in sorted(places.glob(f"{version}.*/bin/python"))), None)


def main() -> int:
    """Try everything; 1 where something failed."""
    trials = Trials()
    with tempfile.TemporaryDirectory(prefix="pretravel-release-") as name:
        folder = Path(name)
        found: dict[str, Path] = {}

        def building() -> None:
            found["source"], found["wheel"] = build(folder)

        if not trials.run("source distribution, and the wheel from it", building):
            return 1
        _try_all(trials, folder, found["source"], found["wheel"])
        if len(sys.argv) > 1 and not trials.failed:
            kept = Path(sys.argv[1])
            kept.mkdir(parents=True, exist_ok=True)
            for distribution in found.values():
                shutil.copy(distribution, kept)
    for each in trials.not_tried:
        print(f"NOT TRIED: {each}")
    print(
        f"{len(trials.failed)} failed: {', '.join(trials.failed)}" if trials.failed else "all good"
    )
    return 1 if trials.failed else 0


def _try_all(trials: Trials, folder: Path, source: Path, wheel: Path) -> None:
    version = wheel.name.split("-")[1]
    trials.run("content of the source distribution", lambda: check_source(source))
    trials.run("content of the wheel", lambda: check_content(wheel))
    found = {each: interpreter(each) for each in PYTHONS}
    pythons = {version: path for version, path in found.items() if path}
    missing = [version for version in PYTHONS if version not in pythons]
    trials.not_tried += [f"Python {version}: no interpreter here" for version in missing]
    made: dict[str, Environment] = {}

    def first_steps(python: str, package: Path) -> None:
        kind = "source" if package == source else "wheel"
        place = folder / f"{kind}-{python}"
        environment = Environment.made(place, pythons[python], package)
        made.setdefault(python, environment)
        check_first_steps(environment, folder / f"{kind}-{python}-work", version)

    for python in pythons:
        trials.run(f"Python {python}: help, demo, library", lambda p=python: first_steps(p, wheel))
    first = next(iter(pythons))
    trials.run("from the source distribution", lambda: first_steps(first, source))

    def extra(name: str, python: str) -> None:
        if name not in EXTRAS:
            raise ReleaseError(f"write in tools/check_release.py what the extra {name} is for")
        full = Environment.made(
            folder / f"{name}-{python}", pythons[python], f"pretravel[{name}] @ {wheel.as_uri()}"
        )
        check_extra(name, made[python], full, folder / f"{name}-{python}-work")

    for name in sorted(set(PROJECT["optional-dependencies"]) - {ALL}):
        for python in made:
            trials.run(f"extra {name}, Python {python}", lambda n=name, p=python: extra(n, p))
    trials.run("types of a user's program", lambda: check_types(made[first], folder / "types"))

    def notebook() -> None:
        # It shows tables of pandas and datasets of xarray.
        tables = f"pretravel[tables] @ {wheel.as_uri()}"
        environment = Environment.made(folder / "notebook-tables", pythons[first], tables)
        check_notebook(environment, folder / "notebook")

    trials.run("notebook in Jupyter", notebook)


if __name__ == "__main__":
    sys.exit(main())
