"""The CAD kernel's process: no code from the current folder, limits of memory and time."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from pretravel.base.errors import InputError
from pretravel.files.map_file import read_map, write_map
from pretravel.surface.cad import kernel_process
from pretravel.surface.cad.kernel_process import KernelLimit, understood
from pretravel.surface.cad.part_file import read_part
from tests.hard.binary_readers import BREP
from tests.support.example_maps import lobes
from tests.support.examples import EXAMPLES

PART = EXAMPLES / "part.step"
pytestmark = pytest.mark.usefixtures("real_processes")


@pytest.fixture
def poisoned(tmp_path: Path) -> Path:
    """A folder with modules of the names of all that a process could import."""
    names = {"shutil", "json", "typing", "logging", "tempfile", "numpy", "netgen", "typer"}
    names |= {"sitecustomize", "usercustomize", "runpy", "re", "random", "scipy", "shapely"}
    names |= {"h5py", "h5netcdf", "xarray", "matplotlib", "subprocess", "csv", "sqlite3"}
    for name in names:
        code = f"open({str(tmp_path / name)!r} + ' RAN', 'w').close()\nraise ImportError({name!r})"
        (tmp_path / f"{name}.py").write_text(code)
    (tmp_path / "netgen").mkdir()
    (tmp_path / "netgen" / "__init__.py").write_text((tmp_path / "netgen.py").read_text())
    return tmp_path


def _ran(folder: Path) -> list[str]:
    return sorted(file.name for file in folder.iterdir() if file.name.endswith(" RAN"))


def _environment() -> dict[str, str]:
    package = Path(kernel_process.__file__).parents[3]
    return os.environ | {"PYTHONPATH": str(package)}


class TestCodeBesideAPart:
    def test_kernel_and_reader_of_maps_import_nothing_from_there(
        self, poisoned: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        write_map(poisoned / "map.json", lobes(3))
        read_map(poisoned / "map.json")  # this process imports what it needs
        read_part(PART)
        monkeypatch.chdir(poisoned)
        monkeypatch.setattr(sys, "path", [str(poisoned), "", *sys.path])
        monkeypatch.setenv("PYTHONPATH", f"{poisoned}:")
        assert len(read_part(PART).faces) == 1
        assert read_map("map.json").tip_radius == lobes(3).tip_radius
        assert _ran(poisoned) == []

    def test_a_program_of_the_current_folder_finds_its_own_modules(self, tmp_path: Path) -> None:
        """A package that imports pretravel at its beginning, run as ``python -m shop.daily``."""
        (tmp_path / "shop").mkdir()
        (tmp_path / "shop" / "__init__.py").write_text("import pretravel\n")
        (tmp_path / "shop" / "daily.py").write_text("import rooms\nprint(rooms.NAME)\n")
        (tmp_path / "rooms.py").write_text("NAME = 'measuring room'\n")
        done = subprocess.run(
            [sys.executable, "-m", "shop.daily", "pretravel"],
            cwd=tmp_path,
            env=_environment(),
            capture_output=True,
            text=True,
        )
        assert done.stdout == "measuring room\n", done.stderr

    @pytest.mark.long
    @pytest.mark.parametrize(
        "module", [["-mpretravel"], pytest.param(["-m", "pretravel"], marks=pytest.mark.slow)]
    )
    def test_the_folder_of_the_libraries_can_be_the_current_one(self, module: list[str]) -> None:
        """What this process has imported from there is there for the other process too."""
        import numpy as np

        done = subprocess.run(
            [sys.executable, *module, "faces", str(PART)],
            cwd=Path(np.__file__).parents[1],
            env=_environment(),
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr

    @pytest.mark.long
    @pytest.mark.parametrize(
        "program",
        [
            ["-m", "pretravel"],
            ["-Bmpretravel"],
            ["script.py"],  # beside the folder, as the console script is
        ],
    )
    def test_programs_import_nothing_from_there(self, poisoned: Path, program: list[str]) -> None:
        script = poisoned.parent / "script.py"
        script.write_text("from pretravel.cli.main import run\nrun()\n")
        words = [str(script) if word == script.name else word for word in program]
        command = [sys.executable, *words, "faces", str(PART)]
        done = subprocess.run(
            command, cwd=poisoned, env=_environment(), capture_output=True, text=True
        )
        assert _ran(poisoned) == []
        assert done.returncode == 0, done.stderr


class TestSettingsBesideAPart:
    @pytest.mark.long
    def test_a_matplotlibrc_starts_no_latex(self, tmp_path: Path) -> None:
        (tmp_path / "matplotlibrc").write_text("text.usetex: True\n")
        (tmp_path / "bin").mkdir()
        latex = tmp_path / "bin" / "latex"
        latex.write_text(f"#!/bin/sh\ntouch {tmp_path}/RAN\nexit 1\n")
        latex.chmod(0o755)
        code = "from pretravel.cli.main import run; run()"
        words = ["predict", "omp40-2", "--azimuth", "0:300:60", "--plot", "p.png"]
        path = {"PATH": f"{tmp_path / 'bin'}:{os.environ['PATH']}"}
        done = subprocess.run(
            [sys.executable, "-c", code, *words], cwd=tmp_path, env=_environment() | path,
            capture_output=True, text=True,
        )  # fmt: skip
        assert not (tmp_path / "RAN").exists()
        assert done.returncode == 0, done.stderr


class TestLimits:
    @pytest.fixture(autouse=True)
    def _nothing_was_read_before(self, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
        monkeypatch.setenv("PRETRAVEL_CACHE", str(tmp_path))

    def test_memory(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(kernel_process, "MEMORY", KernelLimit(100e6, 0.0))
        with pytest.raises(InputError, match=r"needs more than 0\.1 GB of memory"):
            read_part(PART)

    def test_written_files(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(kernel_process, "WRITTEN", KernelLimit(1000.0, 0.0))
        with pytest.raises(InputError, match="takes more than 0 MB"):
            read_part(PART)

    def test_time(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(kernel_process, "TIME", KernelLimit(0.01, 0.0))
        with pytest.raises(InputError, match="took longer than 0 s"):
            read_part(PART)


@pytest.mark.parametrize(("old", "new"), [("Curves ", "Curves 9"), ("Surfaces ", "Surfaces 9")])
def test_a_description_that_does_not_fit_together(old: str, new: str) -> None:
    """Of a damaged file the kernel may write lists that are shorter than they state."""
    text = BREP.read_text("ascii")
    path = Path("part.step")
    assert understood(text, path).roots
    with pytest.raises(InputError, match=r"part\.step: is damaged"):
        understood(text.replace(old, new, 1), path)
