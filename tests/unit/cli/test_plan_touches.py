"""From an old map to targets, and from few touches back to a map, by commands."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import fibonacci_cap
from pretravel.files.map_file import read_map, write_map
from pretravel.files.touches_csv import read_targets, write_touches
from pretravel.qualification.prior_update import update_map
from tests.support.commands import run
from tests.support.example_maps import example_map
from tests.support.examples import PART
from tests.support.pictures import coloured_share
from tests.support.reference_touches import sphere_touches


@pytest.mark.long
def test_plan_touch_and_update(tmp_path: Path) -> None:
    old = example_map("harmonic")
    write_map(tmp_path / "old.json", old)
    targets = tmp_path / "targets.csv"
    text = run("plan-touches", "--map", tmp_path / "old.json", "--count", 7, "--normals", PART,
               "-o", targets, "--plot", tmp_path / "plan.png")  # fmt: skip
    assert "7 touches reduce u of the map from" in text
    assert coloured_share(tmp_path / "plan.png") > 0.001
    normals = read_targets(targets).normals
    assert len(normals) == 7
    rng = np.random.default_rng(1)
    noisy = old.pretravel(normals) + rng.normal(0.0, 0.3e-3, 7)
    write_touches(tmp_path / "few.csv", sphere_touches(noisy, normals, radius=0.5 * 24.9987))
    text = run("qualify", tmp_path / "few.csv", "--diameter", 24.9987, "--prior",
               tmp_path / "old.json", "-o", tmp_path / "new.json", "--verbose",
               "--plot", tmp_path / "new.png")  # fmt: skip
    assert "old.json is brought up to date by 7 touches in 7 directions" in text
    new = read_map(tmp_path / "new.json")
    assert new.kind == "harmonic"
    assert "few.csv" in new.provenance.touches
    assert np.abs(new.pretravel(normals) - old.pretravel(normals)).max() < 1e-3


@pytest.mark.long
def test_an_updated_physical_map_goes_to_a_control_as_a_table(tmp_path: Path) -> None:
    """Its coefficients of the derivatives are not zero: there is no closed form for the control."""
    old = example_map("physical")
    normals = fibonacci_cap(9)
    noisy = 1.01 * old.pretravel(normals) + np.random.default_rng(2).normal(0.0, 0.3e-3, 9)
    new = update_map(sphere_touches(noisy, normals), old, 25.0).pretravel_map
    assert new.basis.form_on_control(new.coefficients) is None
    write_map(tmp_path / "new.json", new)
    (tmp_path / "macros").mkdir()
    run("export", tmp_path / "new.json", "--to", "linuxcnc", "-o", tmp_path / "macros")
    assert list((tmp_path / "macros").glob("*.ngc"))


def test_reports_agree_on_what_u_contains_of_the_centre(tmp_path: Path) -> None:
    old = example_map("physical")
    write_map(tmp_path / "old.json", old)
    normals = fibonacci_cap(9)
    noisy = old.pretravel(normals) + np.random.default_rng(3).normal(0.0, 0.3e-3, 9)
    write_touches(tmp_path / "few.csv", sphere_touches(noisy, normals))
    given = ("--map", tmp_path / "old.json", "--count", 7, "-o", tmp_path / "targets.csv")
    reports = [
        run("plan-touches", *given, "--verbose"),
        run("qualify", tmp_path / "few.csv", "--diameter", 25, "--prior", tmp_path / "old.json",
            "-o", tmp_path / "new.json"),
        old.provenance.gauge,
    ]  # fmt: skip
    for report in reports:
        assert "scatter of the touches" in " ".join(report.split())


def test_another_tip_and_too_few_touches_are_refused(tmp_path: Path) -> None:
    old = example_map("harmonic")
    write_map(tmp_path / "old.json", old)
    assert "--count" in run("plan-touches", "--map", tmp_path / "old.json", "--count", 3, code=2)
    normals = old.support.nodes[:9]
    write_touches(tmp_path / "few.csv", sphere_touches(old.pretravel(normals), normals))
    text = run("qualify", tmp_path / "few.csv", "--diameter", 25, "--tip-diameter", 5, "--prior",
               tmp_path / "old.json", code=2)  # fmt: skip
    assert "a tip of 6 mm" in text
    head, *rows = (tmp_path / "few.csv").read_text().splitlines()
    (tmp_path / "few.csv").write_text("\n".join([f"{head},tip", *(f"{r},TIP_4mm" for r in rows)]))
    text = run("qualify", tmp_path / "few.csv", "--diameter", 25, "--prior", tmp_path / "old.json",
               code=2)  # fmt: skip
    assert "gives the tip a diameter of 4 mm, and 6 mm is used" in text
