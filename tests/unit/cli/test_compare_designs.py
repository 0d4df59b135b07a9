"""`compare A B` for two described probes: what is predicted of each, side by side."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import grid
from pretravel.base.units import MICROMETRE
from pretravel.design.tasks.compare.designs import DesignComparison, compare_designs
from pretravel.design.tasks.compare.designs_report import (
    description_of,
    design_comparison_view,
    results_of,
)
from pretravel.prediction.catalogue import description_text, load_probe
from pretravel.prediction.trigger import predict
from pretravel.show.chart import PlaneChart, PolarChart, TopView
from pretravel.show.chart_marks import Area, Bars, LineMark
from tests.support.commands import rows, run
from tests.support.pictures import coloured_share

NAMES = "omp40-2", "omp40-2-100mm"


@pytest.fixture(scope="module")
def both() -> DesignComparison:
    return compare_designs(*NAMES)


def test_the_figures_are_those_of_predict(both: DesignComparison) -> None:
    around = grid([0.5 * np.pi], np.radians(np.arange(0.0, 360.0, 5.0)))
    for name, trigger in zip(NAMES, both.triggers, strict=True):
        alone = predict(load_probe(name), around)
        found = results_of(trigger)
        assert found["pretravel on walls, mean / µm"] == pytest.approx(
            alone.pretravel.mean() / MICROMETRE
        )
        assert found["trigger force on walls, largest / N"] == pytest.approx(alone.force.max())
        shares = [value for key, value in found.items() if key.endswith(", mean on walls / µm")]
        assert sum(shares) == pytest.approx(found["pretravel on walls, mean / µm"])


def test_the_force_falls_as_the_lever_grows(both: DesignComparison) -> None:
    """On walls a moment opens the seat: force times lever is nearly the same for both."""
    moments = [
        results_of(trigger)["trigger force on walls, smallest / N"] * probe.lever
        for probe, trigger in zip(both.probes, both.triggers, strict=True)
    ]
    assert moments[0] == pytest.approx(moments[1], rel=0.01)


def test_only_what_differs_is_listed(both: DesignComparison) -> None:
    document = both.document(NAMES)
    assert "larger than that of A" in document.verdict
    described = document.tables[1].columns[0].values
    assert described == ("lever / mm", "stylus 2")
    same = compare_designs(both.probes[0], both.probes[0]).document(("a", "b"))
    assert len(same.tables) == 1
    assert "the same as that of A" in same.verdict


def test_every_number_of_a_description_counts() -> None:
    """A description that differs in anything that is predicted from has a row for it."""
    from dataclasses import replace

    probe = load_probe("omp40-2")
    for other in (
        replace(probe, preload=5.0), replace(probe, threshold=0.1),
        replace(probe, criterion="arm_lift"), replace(probe, hub=None),
        replace(probe, seats=replace(probe.seats, contact="rigid")),
        replace(probe, tripod=replace(probe.tripod, rod_radius=2.0)),
        replace(probe, tip=replace(probe.tip, radius=2.5)),
    ):  # fmt: skip
        assert description_of(other) != description_of(probe)


def test_both_are_drawn_in_their_own_colours(both: DesignComparison) -> None:
    force, pretravel, parts, force_up, _, difference = design_comparison_view(
        both.triggers, NAMES
    ).charts
    assert isinstance(force, PolarChart)
    assert isinstance(pretravel, PolarChart)
    assert (force.radius.unit, pretravel.radius.unit) == ("N", "µm")
    for chart in (force, pretravel, parts, force_up):
        colours = {
            mark.name: mark.colour
            for mark in chart.marks
            if isinstance(mark, (LineMark, Bars)) and mark.name
        }
        assert colours == {"A: omp40-2": "series8", "B: omp40-2-100mm": "series5"}
    assert isinstance(force_up, PlaneChart)
    area = force_up.marks[0]
    assert isinstance(area, Area)
    assert area.high.max() == pytest.approx(both.triggers[0].force.max())
    assert isinstance(difference, TopView)
    change = both.triggers[1].pretravel - both.triggers[0].pretravel
    assert np.max(difference.values) == pytest.approx(change.max() / MICROMETRE)


def test_command_with_a_file_and_a_name(tmp_path: Path) -> None:
    mine = tmp_path / "mine.toml"
    mine.write_text(description_text("omp40-2").replace("preload_N = 5.91", "preload_N = 4.5"))
    told = run("compare", "omp40-2", mine, "-o", tmp_path / "c.csv", "--plot", tmp_path / "c.png")
    assert told.startswith("A: omp40-2, B: mine.toml: on vertical walls")
    assert "preload / N" in told
    table = {row["quantity"]: row for row in rows(tmp_path / "c.csv")}
    force = table["trigger force, largest in all directions / N"]
    assert (float(force["a"]), float(force["b"])) == pytest.approx((5.91, 4.5))  # from above
    assert coloured_share(tmp_path / "c.png") > 0.001


def test_two_probes_by_another_model(tmp_path: Path) -> None:
    """compare knew no --model. The largest pretravel is that of the model's prediction."""
    for model in ("analytic", "shen"):
        path = tmp_path / f"{model}.csv"
        told = run("compare", *NAMES, "--model", model, "-o", path)
        assert f"Predicted by model {model}" in " ".join(told.split())
        table = {row["quantity"]: row for row in rows(path)}
        found = next(
            float(r["a"])
            for name, r in table.items()
            if name.startswith("pretravel in all directions, largest /")
        )
        own = compare_designs(*NAMES, model).triggers[0].pretravel
        assert found == pytest.approx(own.max() / MICROMETRE, rel=1e-6)


def test_what_cannot_be_compared(tmp_path: Path) -> None:
    assert "one map, or two probes" in run("compare", "omp40-2", "map.json", code=2)
    (tmp_path / "t.csv").write_text("nx,ny,nz\n0,0,1\n")
    told = run("compare", *NAMES, "--part", tmp_path / "t.csv", code=2)
    assert "leave it out" in told


def test_a_part_without_named_normals_says_how_to_go_on(tmp_path: Path) -> None:
    """compensate reads such a table with --columns; compare knows no columns. The points do."""
    part, points, options = tmp_path / "part.csv", tmp_path / "points.csv", ("--map", "omp40-2")
    part.write_text("a;b;c;d;e;f\n1;2;3;0;0;1\n1;2;4;0;1;0\n")
    columns = ("--columns", "x=1,y=2,z=3,nx=4,ny=5,nz=6", "--units", "mm")
    run("compensate", part, *options, *columns, "-o", points)
    told = " ".join(run("compare", "omp40-2", "--part", part, code=2).split())
    assert "pretravel compensate part.csv" in told
    run("compare", "omp40-2", "--part", points)
    told = run("compare", "omp40-2", "--part", tmp_path / "none.csv", code=2)
    assert "there is no such file" in told
    assert "Compensate" not in told
