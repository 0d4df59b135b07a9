"""The version comes from the tags, through the build, and costs nothing before it is asked for."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tomllib
from importlib.metadata import version
from pathlib import Path

import lazy_loader

import pretravel

ROOT = Path(__file__).parents[2]


def test_it_is_that_of_the_installation() -> None:
    assert pretravel.__version__ == version("pretravel")


def test_it_is_written_nowhere() -> None:
    """A number that is written down is wrong after the next release."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert project["dynamic"] == ["version"]
    assert "version" not in project
    source = (ROOT / "src/pretravel/__init__.py").read_text("utf-8")
    assert re.search(r"^__version__ *=", source, re.M) is None
    assert "\nversion:" not in (ROOT / "CITATION.cff").read_text("utf-8")


def _printed(program: str, folder: Path) -> str:
    """Of a program that finds the sources, what their import needs, and no installation of them."""
    shutil.copytree(Path(lazy_loader.__file__).parent, folder / "lazy_loader")
    places = [str(ROOT / "src"), str(folder)]
    sources = f"import sys; sys.path[:0] = {places!r}; import pretravel; "
    command = [sys.executable, "-I", "-S", "-c", sources + program]
    found = subprocess.run(command, capture_output=True, text=True, check=True)
    return found.stdout.strip()


def test_a_folder_that_is_not_installed_says_so(tmp_path: Path) -> None:
    assert _printed("print(pretravel.__version__)", tmp_path) == "0+not.installed"


def test_importing_the_package_does_not_look_for_it(tmp_path: Path) -> None:
    assert _printed("print('importlib.metadata' in sys.modules)", tmp_path) == "False"
