"""The version is written in pyproject.toml alone, and costs nothing before it is asked for."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
from importlib.metadata import metadata, version
from pathlib import Path

import lazy_loader
import pytest

import pretravel

ROOT = Path(__file__).parents[2]


def test_it_is_that_of_the_installation() -> None:
    assert pretravel.__version__ == version("pretravel")


def test_what_states_it_too_agrees() -> None:
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]
    assert stated == version("pretravel")
    source = (ROOT / "src/pretravel/__init__.py").read_text("utf-8")
    assert re.search(r"^__version__ *=", source, re.M) is None
    changes = (ROOT / "CHANGELOG.md").read_text("utf-8")
    newest, date = re.findall(r"^## \[(\d[^]]*)\] - (\S+)$", changes, re.M)[0]
    cited = (ROOT / "CITATION.cff").read_text("utf-8")
    assert newest == stated
    assert f"\nversion: {stated}\ndate-released: {date}\n" in cited


def test_links_of_the_readme_hold_outside_the_repository() -> None:
    """The page of a package index shows the README, without the folder that it stands in."""
    found = metadata("pretravel")
    text = found.get_payload() or found["Description"]
    targets = re.findall(r"\]\(([^)]+)\)", text)
    assert len(targets) > 20
    assert [each for each in targets if not each.startswith(("https://", "#"))] == []
    pictures = re.findall(r"!\[[^]]*\]\(([^)]+)\)", text)
    assert pictures
    assert all("/raw/" in each for each in pictures)
    addresses = dict(each.split(", ") for each in found.get_all("Project-URL"))
    assert set(addresses) == {"Documentation", "Source", "Issues", "Changelog"}
    # The file that each address names is in the repository, at the tag of this version.
    tag = f"v{version('pretravel')}"
    named = [each.partition(f"/{tag}/")[2].partition("#")[0] for each in targets if tag in each]
    assert len(named) > 20
    assert [each for each in named if not (ROOT / each).exists()] == []


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


def test_the_list_of_commands_loads_no_library_of_numbers() -> None:
    """It is what most people type first: 0.1 s without NumPy, 0.3 s with it."""
    listed = "import sys, typer.testing as t; from pretravel.cli.main import app; "
    shown = "print(t.CliRunner().invoke(app, ['--help']).exit_code, 'numpy' in sys.modules)"
    found = subprocess.run(
        [sys.executable, "-c", listed + shown], capture_output=True, text=True, check=True
    )
    assert found.stdout.split() == ["0", "False"]


@pytest.mark.long
def test_a_command_loads_nothing_that_it_does_not_use() -> None:
    """Each of these took a tenth of the time of a short command, threads several times all of it:
    pydantic (typer's reading of values), parts of NumPy that SciPy asks for."""
    program = (
        "import os, sys; from pretravel.cli import run; sys.argv[1:] = ['formats']\n"
        "try: run()\nexcept SystemExit: pass\n"
        "import scipy.special\n"
        "print(os.environ['OPENBLAS_NUM_THREADS'], 'pydantic' in sys.modules, "
        "'numpy.f2py.f2py2e' in sys.modules)"
    )
    environment = {name: os.environ[name] for name in os.environ if "NUM_THREADS" not in name}
    found = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, env=environment
    )
    assert found.stdout.split()[-3:] == ["1", "False", "False"]


def test_a_table_of_this_package_needs_no_other_format() -> None:
    """Logs, plug-ins and the libraries of tables that a short command would load for nothing."""
    program = (
        "import sys; from pretravel.files import read_readings, SourceFile\n"
        "read_readings(SourceFile('a.csv', b'x_mm,y_mm,z_mm,nx,ny,nz\\n0,0,3,0,0,1\\n'))\n"
        "names = ('pretravel.files.logs.dmis', 'importlib.metadata', 'pyarrow', 'scipy')\n"
        "print([name for name in names if name in sys.modules])"
    )
    found = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert found.stdout.split() == ["[]"]
