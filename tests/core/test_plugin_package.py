"""The example package adds a format and a kind of map, once it is installed beside pretravel."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tomllib
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

from pretravel.files.touches_csv import read_touches
from tests.support.commands import rows
from tests.support.examples import EXAMPLES

SPHERE = EXAMPLES / "sphere_touches.csv"
PLUGIN = EXAMPLES.parent / "plugin"
LISTED = tomllib.loads((PLUGIN / "pyproject.toml").read_text(encoding="utf-8"))["project"]
IN_PYTHON = """
import json, sys
import pretravel
from pretravel.files.map_file import read_map
touches = pretravel.read_touches(sys.argv[1])
made = pretravel.qualify(touches, 24.9987, tip_diameter=6.0, kind="belt").pretravel_map
read = read_map(sys.argv[2])
print(json.dumps([
    [
        each.kind, each.basis.limits, each.coefficients.tolist(),
        each.standard_uncertainty(touches.normals).tolist(),
    ]
    for each in (made, read)
]))
"""


def _install(folder: Path, name: str, groups: Mapping[str, Mapping[str, str]]) -> None:
    """What an installer writes of a package beside its modules."""
    metadata = folder / f"{name.replace('-', '_')}-1.0.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    lines = []
    for group, points in groups.items():
        lines += [f"[{group}]", *(f"{point} = {place}" for point, place in points.items())]
    (metadata / "entry_points.txt").write_text("\n".join(lines) + "\n")


def _python(folder: Path, *arguments: object, code: int = 0) -> str:
    """Run Python with what is installed in a folder; return stdout, or stderr of a fault."""
    places = [str(folder), str(PLUGIN), os.environ.get("PYTHONPATH", "")]
    done = subprocess.run(
        [sys.executable, *map(str, arguments)],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, places))},
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == code, done.stdout + done.stderr
    assert "Traceback" not in done.stderr
    return done.stderr if code else done.stdout


def _pretravel(folder: Path, *arguments: object, code: int = 0) -> str:
    return " ".join(_python(folder, "-m", "pretravel", *arguments, code=code).split())


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("installed")
    _install(folder, LISTED["name"], LISTED["entry-points"])
    return folder


def test_its_format_is_listed_and_read(installed: Path, tmp_path: Path) -> None:
    log, plan = tmp_path / "day.log", tmp_path / "plan.csv"
    # A tip of 6 mm above and beside the targets, in inches.
    log.write_text("TOUCHLOG inch\n0 0 0.118\n0.511 0 0\n")
    plan.write_text("label,x_mm,y_mm,z_mm,nx,ny,nz\ntop,0,0,0,0,0,1\nside,10,0,0,1,0,0\n")
    assert "touchlog log of the example package" in _pretravel(installed, "formats")
    out = tmp_path / "touches.csv"
    _pretravel(installed, "convert", log, "--plan", plan, "--tip-diameter", 6, "-o", out)
    found = [
        (row["label"], *(float(row[name]) for name in ("x_mm", "y_mm", "z_mm", "nx", "nz")))
        for row in rows(out)
    ]
    assert found == [
        ("top", 0.0, 0.0, pytest.approx(2.9972), 0.0, 1.0),
        ("side", pytest.approx(12.9794), 0.0, 0.0, 1.0, 0.0),
    ]
    log.write_text("TOUCHLOG mm\n0 0 3\n1 2\n")
    told = _pretravel(installed, "convert", log, "--plan", plan, "-o", out, code=2)
    assert "day.log, line 3: 2 values where a touch log has x, y and z" in told


def test_its_kind_is_fitted_written_and_read(installed: Path, tmp_path: Path) -> None:
    path = tmp_path / "map.json"
    size = ("--diameter", 24.9987, "--tip-diameter", 6)
    _pretravel(installed, "qualify", SPHERE, *size, "--kind", "belt", "-o", path)
    assert json.loads(path.read_text(encoding="utf-8"))["kind"] == "belt"
    made, read = json.loads(_python(installed, "-c", IN_PYTHON, SPHERE, path))
    assert made == read
    kind, limits, coefficients, uncertainties = made
    assert kind == "belt"
    assert limits == pytest.approx(np.radians([35.0, 65.0]))

    # By hand: a least-squares sphere, then the mean of each belt about its centre.
    x = read_touches(SPHERE).positions
    centre = least_squares(
        lambda ball: np.linalg.norm(x - ball[:3], axis=1) - ball[3],
        [*x.mean(axis=0), 15.5],
        xtol=1e-15,
        ftol=1e-15,
        gtol=1e-15,
    ).x[:3]
    distance = np.linalg.norm(x - centre, axis=1)
    pretravel = 0.5 * 24.9987 + 3.0 - distance
    belt = np.digitize(np.degrees(np.arccos((x - centre)[:, 2] / distance)), [35.0, 65.0])
    means = np.array([pretravel[belt == each].mean() for each in range(3)])
    assert coefficients == pytest.approx(means, abs=1e-9)
    # The residual is the uncertainty of any one direction: six numbers were fitted to 25.
    residual = np.sqrt(np.mean((pretravel - means[belt]) ** 2) * 25 / (25 - 6))
    assert uncertainties == pytest.approx([residual] * len(x), rel=1e-6)


@pytest.mark.parametrize(
    ("group", "name", "command"),
    [
        ("pretravel.kinds", "belt", ("qualify", SPHERE, "--diameter", 25, "--kind", "belt")),
        ("pretravel.formats", "csv", ("formats",)),
    ],
)
def test_two_packages_with_one_name_are_refused(
    tmp_path: Path, group: str, name: str, command: tuple[object, ...]
) -> None:
    _install(tmp_path, LISTED["name"], LISTED["entry-points"])
    _install(tmp_path, "another-example", {group: {name: "another_example:Thing"}})
    told = _pretravel(tmp_path, *command, code=2)
    assert f"two packages have a plug-in '{name}' in {group}: " in told
    assert "another_example:Thing of another-example" in told
    assert "Remove one of them" in told


def test_a_plugin_that_cannot_be_used_is_named(tmp_path: Path) -> None:
    """The others of its group can be used as before."""
    _install(tmp_path, "broken-example", {"pretravel.controls": {"mill": "no_such_module:MILL"}})
    made, size = tmp_path / "map.json", ("--diameter", 24.9987, "--tip-diameter", 6)
    _pretravel(tmp_path, "qualify", SPHERE, *size, "--kind", "mean", "-o", made)
    told = _pretravel(tmp_path, "export", made, "--to", "mill", "-o", tmp_path / "out", code=2)
    assert "'mill' in pretravel.controls, no_such_module:MILL of broken-example" in told
    assert "cannot be used: No module named 'no_such_module'" in told
    _pretravel(tmp_path, "export", made, "--to", "radii", "-o", tmp_path / "radii.json")


def test_a_plugin_is_listed_under_its_own_name(tmp_path: Path) -> None:
    groups = {"pretravel.formats": {"day-log": "pretravel_example:TOUCHLOG"}}
    _install(tmp_path, "broken-example", groups)
    told = _pretravel(tmp_path, "formats", code=2)
    assert "'day-log' in pretravel.formats, pretravel_example:TOUCHLOG of broken-example" in told
    assert "calls itself 'touchlog'" in told
