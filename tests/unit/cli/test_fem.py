"""pretravel fem, hysteresis and predict --model fem, as users call them."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
from typer.testing import CliRunner

from pretravel.cli.main import app
from pretravel.files.csv_table import read_csv_table
from pretravel.prediction.catalogue import description_text
from tests.support.coarse_models import models_by_name_are_coarse
from tests.support.pictures import coloured_share

COARSE = ["--refinement", "0.4"]


def invoke(*arguments: str) -> str:
    result = CliRunner().invoke(app, list(arguments))
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result.output


@pytest.mark.long
def test_fem_says_what_it_built_and_writes_what_paraview_reads(tmp_path: Path) -> None:
    vtu, png = tmp_path / "out.vtu", tmp_path / "out.png"
    said = invoke(
        "fem", "omp40-2", *COARSE, "--polar", "50", "--azimuth", "20",
        "--vtu", str(vtu), "--plot", str(png), "--verbose",
    )  # fmt: skip
    for word in ("unknowns", "quality", "edges where parts meet", "sensing distance", "A-right",
                 "Highest stress of each part", "at azimuth", "stylus 2"):  # fmt: skip
        assert word in said
    assert coloured_share(png) > 0.001
    mesh = meshio.read(vtu)
    assert set(mesh.point_data) == {"displacement_um", "force_N"}
    assert {"von_mises_MPa", "von_mises_rest_MPa", "region", "quality"} == set(mesh.cell_data)
    # Seats, spring and tip are in equilibrium: forces and moments add up to zero.
    force = mesh.point_data["force_N"]
    assert np.abs(force.sum(axis=0)).max() < 1e-9
    # In the direction of the push the tip has moved by the printed amount.
    tip = mesh.points[:, 2] < -61.0
    moved = mesh.point_data["displacement_um"][tip & (np.abs(force).sum(axis=1) == 0.0)]
    stated = float(said.split("sensing distance")[1].split()[0])
    assert np.linalg.norm(moved[:, :2].mean(axis=0)) == pytest.approx(stated, rel=0.05)
    assert moved[:, 0].mean() > 0.0
    assert moved[:, 1].mean() > 0.0


@pytest.mark.long
def test_fem_stress_is_where_the_force_goes(tmp_path: Path) -> None:
    vtu = tmp_path / "out.vtu"
    invoke("fem", "omp40-2", *COARSE, "--vtu", str(vtu))
    mesh = meshio.read(vtu)
    centres = mesh.points[mesh.cells_dict["tetra10"]].mean(axis=1)
    stress = mesh.cell_data_dict["von_mises_MPa"]["tetra10"]
    outside = np.hypot(centres[:, 0], centres[:, 1]) > 1.6
    near_root = outside & (centres[:, 2] < -28.0) & (centres[:, 2] > -32.0)
    near_tip = outside & (centres[:, 2] < -55.0) & (centres[:, 2] > -59.0)
    assert stress[near_root].mean() > 3.0 * stress[near_tip].mean()
    # F L / W at 30 mm below the rods, 0.75 N x 34.4 mm / (pi 4.5³ / 32): 2.9 MPa at the skin.
    assert 2.0 < stress[near_root].max() < 3.1


@pytest.mark.long
def test_fem_writes_its_solids(tmp_path: Path) -> None:
    from netgen.occ import OCCGeometry

    step = tmp_path / "out.step"
    invoke("fem", "omp40-2", *COARSE, "--step", str(step))
    names = {solid.name for solid in OCCGeometry(str(step)).shape.solids}
    assert {"hub", "holder", "rods", "stylus 1", "stylus 2", "tip"} <= names


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["fem", "omp40-2", "--refinement", "50"], "less than or equal to 5"),
        (["fem", "omp40-2", "--polar", "200"], "less than or equal to 180"),
        (["fem", "omp40-2", *COARSE, "--polar", "180"], "never triggers"),
        (["fem", "omp40-2", *COARSE, "--solver", "gauss"], "--solver gauss: it is not known"),
        (["fem", "omp40-2", "--vtu", "mesh.stl"], "ending must be .vtu"),
        (["hysteresis", "omp40-2", "--friction", "0.9"], "between 0 and 0.49"),
        (["hysteresis", "omp40-2", "--model", "shen"], "not one of 'fem', 'analytic', 'rigid'"),
        (["hysteresis", "omp40-2-thesis", "--model", "rigid"], "'hertz'"),
    ],
)
def test_errors_teach(
    arguments: list[str], words: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("PRETRAVEL_CACHE", str(tmp_path))  # a kept model would bypass the solver
    result = CliRunner().invoke(app, arguments)
    assert result.exception is not None
    assert words in str(result.exception)


def test_lever_and_hub_that_do_not_go_together(tmp_path: Path) -> None:
    result = CliRunner().invoke(app, ["predict", "omp40-2", "--model", "fem", "--lever", "52"])
    assert "stylus's root" in str(result.exception)


def test_old_descriptions_are_told_what_is_missing(tmp_path: Path) -> None:
    lines = description_text("omp40-2").splitlines()
    hub = lines.index("[hub]")
    keep = [
        line for number, line in enumerate(lines)
        if not (hub + 1 < number < hub + 6 and "=" in line)
    ]  # fmt: skip
    path = tmp_path / "old.toml"
    path.write_text("\n".join(keep), encoding="utf-8")
    result = CliRunner().invoke(app, ["predict", str(path), "--model", "fem"])
    assert "needs the hub's shape" in str(result.exception)
    invoke("predict", str(path), "--azimuth", "0", "--polar", "90")  # analytic needs no hub


def test_hysteresis_writes_every_step(tmp_path: Path) -> None:
    table, png = tmp_path / "cycles.csv", tmp_path / "cycles.png"
    said = invoke(
        "hysteresis", "omp40-2", "--model", "rigid", "--azimuth", "0,60", "--steps", "12",
        "--cycles", "2", "-o", str(table), "--plot", str(png), "--verbose",
    )  # fmt: skip
    assert "hysteresis 2/µm" in said
    assert "friction 0.2 (assumed: the description has none)" in said
    rows = read_csv_table(table)
    azimuth, force = (rows.numbers(name)[:, 0] for name in ("azimuth_deg", "force_N"))
    deflection, loading = (rows.numbers(name)[:, 0] for name in ("deflection_um", "loading"))
    # Loading comes first; at its end the deflection is largest: that at the trigger and 10 µm.
    first = azimuth == 0.0
    turn = int(np.argmax(deflection[first]))
    assert loading[first][turn] == 1.0
    assert loading[first][-1] == 0.0
    assert 11.0 < deflection[first].max() < 14.0
    assert set(azimuth) == {0.0, 60.0}
    assert force[azimuth == 60.0].max() > force[azimuth == 0.0].max()
    # The rest is located to 2⁻²⁴ of a step, in which the force changes by up to 0.3 N.
    assert force[-1] == pytest.approx(0.0, abs=1e-7)
    assert coloured_share(png) > 0.001


def test_predict_fem_shares_add_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    models_by_name_are_coarse(monkeypatch)
    path = tmp_path / "map.csv"
    invoke(
        "predict", "omp40-2", "--model", "fem", "--azimuth", "0:330:30", "--polar", "20:90:35",
        "-o", str(path),
    )  # fmt: skip
    header = path.read_text().splitlines()[0].split(",")
    shares = [name for name in header if name.startswith("share_")]
    assert shares == [
        f"share_{name}_um"
        for name in ("hub", "holder", "rods", "stylus", "tip", "seats", "tip_on_part")
    ]
    table = read_csv_table(path)
    total = sum(table.numbers(name)[:, 0] for name in shares)
    assert total == pytest.approx(table.numbers("pretravel_um")[:, 0], rel=1e-8)
