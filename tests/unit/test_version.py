"""The version comes from the tags, through the build, and costs nothing before it is asked for."""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from importlib.metadata import version
from pathlib import Path

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


def _printed(program: str) -> str:
    """Of a program that finds the sources and nothing of the environment."""
    sources = f"import sys; sys.path.insert(0, {str(ROOT / 'src')!r}); import pretravel; "
    command = [sys.executable, "-I", "-S", "-c", sources + program]
    found = subprocess.run(command, capture_output=True, text=True, check=True)
    return found.stdout.strip()


def test_a_folder_that_is_not_installed_says_so() -> None:
    assert _printed("print(pretravel.__version__)") == "0+not.installed"


def test_importing_the_package_does_not_look_for_it() -> None:
    assert _printed("print('importlib.metadata' in sys.modules)") == "False"
