"""pretravel without extras, in an environment of its own: its size, its commands, its sentences."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.touches_of_days import day_of

ROOT = Path(__file__).parents[2]
DATA = ROOT / "examples" / "data"
LARGEST = 400e6
"""Of the installed packages, compiled, without pip. [bytes]"""
SIZES = """
import importlib.metadata as m, json
sizes = {
    each.metadata["Name"]: sum(
        file.locate().stat().st_size for file in each.files or () if file.locate().is_file()
    )
    for each in m.distributions()
}
print(json.dumps(sizes))
"""
MAP = "map.json"
QUALIFY = ("qualify", "sphere_touches.csv", "--diameter", "25", "--tip-diameter", "6")
HEAVY = (
    "dask", "distributed", "h5netcdf", "h5py", "matplotlib", "netgen", "nicegui", "pandas",
    "plotly", "scipy.stats", "shapely", "skfem", "xarray",
)  # fmt: skip
"""What reading touches, qualifying and printing a result must not load."""


class Core:
    """The environment, and a folder with the example data."""

    def __init__(self, environment: Path, folder: Path) -> None:
        self.environment, self.folder = environment, folder

    def python(self, *words: object) -> subprocess.CompletedProcess[str]:
        kept = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")}
        return subprocess.run(
            [self.environment / "bin" / "python", *map(str, words)],
            cwd=self.folder,
            capture_output=True,
            text=True,
            check=False,
            env=kept | {"COLUMNS": "200", "NO_COLOR": "1"},
        )

    def run(self, *words: object, codes: tuple[int, ...] = (0,)) -> str:
        done = self.python("-m", "pretravel", *words)
        assert done.returncode in codes, f"{words}\n{done.stdout}{done.stderr}"
        return done.stdout + done.stderr


@pytest.fixture(scope="module")
def core(tmp_path_factory: pytest.TempPathFactory) -> Core:
    place = tmp_path_factory.mktemp("core")
    environment, folder = place / "environment", place / "work"
    shutil.copytree(DATA, folder)
    subprocess.run([sys.executable, "-m", "venv", environment], check=True)
    lock = ROOT / "requirements-dev.lock"
    pip = [environment / "bin" / "pip", "install", "--quiet", "--constraint", lock, ROOT]
    subprocess.run(pip, check=True)
    return Core(environment, folder)


@pytest.fixture(scope="module")
def qualified(core: Core) -> Core:
    core.run(*QUALIFY, "-o", MAP)
    core.run("compensate", "bore_touches.csv", "--map", MAP, "-o", "bore_points.csv")
    day_of(core.folder, 1)
    return core


def test_it_is_small(core: Core) -> None:
    sizes = json.loads(core.python("-c", SIZES).stdout)
    sizes = {name: size for name, size in sizes.items() if name not in ("pip", "setuptools")}
    assert {"pretravel", "numpy", "scipy", "matplotlib"} <= set(sizes)
    assert sum(sizes.values()) < LARGEST, sizes


def test_qualification_loads_nothing_heavy(core: Core) -> None:
    program = (
        "import sys; sys.argv = ['pretravel', *sys.argv[1:]]\n"
        "from pretravel.cli.main import run\n"
        "try:\n    run()\nexcept SystemExit as stop:\n    assert not stop.code\n"
        f"print('loaded:', [name for name in {HEAVY} if name in sys.modules])"
    )
    done = core.python("-c", program, *QUALIFY)
    assert done.stdout.splitlines()[-1:] == ["loaded: []"], done.stdout + done.stderr


@pytest.mark.parametrize(
    "words",
    [
        ("--help",),
        ("formats",),
        ("probes",),
        ("convert", "part_touches.csv", "-o", "converted.csv"),
        ("predict", "omp40-2", "-o", "prediction.csv", "--plot", "prediction.png"),
        ("predict", "omp40-2", "--model", "shen"),
        ("slide", "omp40-2", "--surface", "convex", "--at", "0.5,0.5", "--steps", "5"),
        ("rig", "rig"),
        ("separate", "redundancy_24x24.csv"),
    ],
    ids=lambda words: " ".join(words[:3]),
)
def test_commands_without_a_map(core: Core, words: tuple[str, ...]) -> None:
    assert core.run(*words)


@pytest.mark.parametrize(
    "words",
    [
        ("compensate", "part_touches.csv", "--map", MAP, "-o", "points.csv", "--plot", "p.svg"),
        (
            "measure",
            "bore_points.csv",
            "--feature",
            "bore",
            "--select",
            "bore1*",
            "-o",
            "bore.html",
        ),
        ("verify", "day1.csv", "--map", MAP, "--diameter", "25"),
        ("plan-touches", "--map", MAP, "--count", "9", "-o", "targets_of_map.csv"),
        ("export", MAP, "--to", "linuxcnc", "-o", "subroutines"),
        ("demo", "-o", "demo"),
    ],
    ids=lambda words: words[0],
)
def test_commands_with_a_map(qualified: Core, words: tuple[str, ...]) -> None:
    assert qualified.run(*words)


@pytest.mark.parametrize(
    ("words", "extra"),
    [
        (("app", "--no-browser"), "app"),
        (("faces", "part.step"), "cad"),
        (("fem", "omp40-2"), "fem"),
        (("convert", "sphere_touches.csv", "-o", "touches.parquet"), "tables"),
        (("study", "preload-and-seats", "-o", "study.nc"), "scale"),
    ],
)
def test_what_is_missing_is_said_with_the_line_to_type(
    core: Core, words: tuple[str, ...], extra: str
) -> None:
    said = core.run(*words, codes=(2,))
    assert f'pip install "pretravel[{extra}]"' in said
    assert "Traceback" not in said
