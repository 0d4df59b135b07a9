"""pretravel qualify on a block, a pin and several references; plan-touches --block."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from benchmarks.block_qualification import LENGTHS, Shop
from pretravel.base.directions import sphere_pattern_25
from pretravel.files.map_file import read_map
from pretravel.files.touches_csv import read_plan, read_touches, write_touches
from pretravel.qualification.block_plan import plan_block
from pretravel.touches import Touches
from tests.support.commands import both_outputs, rows, run
from tests.support.examples import EXAMPLES

BLOCK = ("qualify", EXAMPLES / "block_touches.csv", "--block", "25.4,50.8,76.2")
TRUTH = {
    "scale of x": 50.0, "scale of y": 158.9, "scale of z": 110.3,
    "squareness of x and y": -109.9, "squareness of x and z": -79.9,
    "squareness of y and z": 149.4, "backlash of x": 0.1, "backlash of y": 16.42,
}  # fmt: skip
"""Of the example, which a program apart from the fit made; µm/m and µm."""


def _pin(path: Path) -> Path:
    phi = np.radians(np.arange(0.0, 360.0, 15.0))
    n = np.stack([np.cos(phi), np.sin(phi), np.zeros(24)], axis=1)
    travel = 0.012 + 0.004 * np.cos(3.0 * phi) + np.random.default_rng(1).normal(0.0, 2e-4, 24)
    write_touches(path, Touches(n * (12.5 + 3.0 - travel)[:, None] + [40.0, 5.0, 0.0], n))
    return path


@pytest.mark.long
def test_block_of_the_example(tmp_path: Path) -> None:
    out = run(
        *BLOCK, "--tip-diameter", 6, "-o", tmp_path / "terms.csv", "--plot", tmp_path / "t.png"
    )
    assert out.startswith("8 of 9 terms of the machine are determined")
    assert "backlash of z" in out
    assert "cannot be distinguished from pretravel of +z" in " ".join(out.split())
    found = {row["term"]: row for row in rows(tmp_path / "terms.csv")}
    for name, truth in TRUTH.items():
        assert abs(float(found[name]["value"]) - truth) < float(found[name]["expanded_uncertainty"])
    assert found["backlash of z"]["determined"] == "0"
    run(*BLOCK, "-o", tmp_path / "a.html")
    assert "squareness of x and z" in (tmp_path / "a.html").read_text(encoding="utf-8")


@pytest.mark.long
def test_references_by_their_labels(tmp_path: Path) -> None:
    """A log that is joined with the plan has labels, and no column of references."""
    table = read_touches(EXAMPLES / "block_touches.csv")
    labels = tuple(f"{name}/{i}" for i, name in enumerate(table.references or ()))
    path = tmp_path / "labels.csv"
    write_touches(path, Touches(table.positions, table.normals, table.approaches, labels=labels))
    again = ("qualify", path, *BLOCK[2:])
    assert run(*again) == run(*BLOCK)


def test_several_references_and_a_prior(tmp_path: Path) -> None:
    out = run("qualify", BLOCK[1], "--reference", "block=block:25.4,50.8,76.2:0.3",
              "--u-backlash", 0, "--u-scale-ppm", 0, "--u-squareness-ppm", 0)  # fmt: skip
    assert "scale of x" not in out
    assert "pretravel of +x and -x together" in out


def test_plan_of_a_block(tmp_path: Path) -> None:
    plan = tmp_path / "plan.csv"
    out = run("plan-touches", "--block", 50.8, "--center", "10,20,30", "-o", plan)
    assert out.startswith("96 touches at 4 turns of the block: 0°, 90°, 30°, 180°")
    targets = read_plan(plan)
    assert targets.labels is not None
    assert targets.labels[0] == "block@0/1"
    assert np.allclose(np.mean(targets.points[:, :2], axis=0), [10.0, 20.0])
    assert rows(plan)[0]["reference"] == "block@0"


@pytest.mark.long
def test_pin_with_and_without_its_size(tmp_path: Path) -> None:
    pin = _pin(tmp_path / "pin.csv")
    run("qualify", pin, "--pin", "--diameter", 25, "--tip-diameter", 6, "-o", tmp_path / "a.json")
    _, err = both_outputs("qualify", pin, "--pin", "--unknown-size", "--tip-diameter", 6,
                          "-o", tmp_path / "b.json")  # fmt: skip
    assert "the size of the reference is not known" in " ".join(err.split())
    known, shape = read_map(tmp_path / "a.json"), read_map(tmp_path / "b.json")
    phi = np.radians(np.arange(5.0, 365.0, 30.0))
    n = np.stack([np.cos(phi), np.sin(phi), 0.0 * phi], axis=1)
    travel = known.pretravel(n)
    assert np.abs(travel - 0.012 - 0.004 * np.cos(3.0 * phi)).max() < 0.4e-3
    # The kinds weigh differently about another level: by less than the noise of two touches.
    assert np.ptp(shape.pretravel(n) - travel) < 0.4e-3
    assert shape.u_tip_radius == pytest.approx(0.025, rel=0.01)


@pytest.mark.long
def test_a_map_beside_a_block(tmp_path: Path) -> None:
    """A ball on a machine that is 150 µm/m too long in x, and a bore of 60 mm measured with it."""
    shop = Shop(np.random.default_rng(12))
    shop.scale[:] = [150e-6, 0.0, 0.0]
    block, n = shop.touches(plan_block(LENGTHS)), sphere_pattern_25()
    ball = shop.touched(12.5 * n + [80.0, 0.0, 20.0], n)
    both = Touches(
        np.vstack([block.positions, ball.positions]),
        np.vstack([block.normals, ball.normals]),
        np.vstack([block.approach_directions, ball.approach_directions]),
        references=(*(block.references or ()), *["ball"] * 25),
    )
    write_touches(tmp_path / "both.csv", both)
    out, err = both_outputs("qualify", tmp_path / "both.csv", "--block", "25.4,50.8,76.2",
                            "--reference", "ball=sphere:25:0.2", "--tip-diameter", 6,
                            "-o", tmp_path / "map.json", "--verbose")  # fmt: skip
    assert "Map of the touches on ball, without the terms of the machine" in out
    assert "contain the backlash of z of the machine" in " ".join(err.split())
    err = run("qualify", tmp_path / "both.csv", "--pin", "--diameter", 25, "--prior",
              tmp_path / "map.json", code=2)  # fmt: skip
    assert "not on a pin" in " ".join(err.split())
    around = np.arange(0.0, 360.0, 15.0) * np.pi / 180.0
    wall = np.stack([np.cos(around), np.sin(around), 0.0 * around], axis=1)
    write_touches(tmp_path / "bore.csv", shop.touched(30.0 * wall, -wall))
    run("compensate", tmp_path / "bore.csv", "--map", tmp_path / "map.json",
        "-o", tmp_path / "points.csv")  # fmt: skip
    out = run("measure", tmp_path / "points.csv", "--feature", "bore")
    found = re.search(r"diameter +(60\.\d+|59\.\d+) mm.*U = ([\d.]+) µm", out)
    assert found is not None, out
    assert abs(float(found[1]) - 60.0) < 1e-3 * float(found[2])
    assert float(found[2]) < 8.0  # 150 µm/m are 9 µm


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        ((), "the diameter of the reference is not given"),
        (("--diameter", 25, "--unknown-size"), "diameter is not used with unknown size"),
        (("--diameter", 25, "--ring", "--pin"), "pin is not used with ring"),
        (("--diameter", 25, "--ring", "--axial-pretravel", 5), "pretravel is not used with ring"),
        (("--diameter", 25, "--axial-pretravel", 5), "an assumed pretravel along the axis is not"),
        (("--block", "1,2"), "one length, 50.8, or three"),
        (("--block", 50.8, "--diameter", 25), "diameter is not used with block"),
        (("--block", 50.8, "--kind", "mean"), "kind is not used with block"),
        (("--block", 50.8, "--axial-pretravel", 5), "assumed on a sphere, and there is none"),
        (("--block", 50.8, "--tip", "a=6"), "tip is not used with block"),
        (("--diameter", 25, "--u-backlash", 5), "u backlash is only for block or reference"),
        (("--diameter", 25, "--u-scale-ppm", 5), "--u-scale-ppm"),
        (
            ("--block", "25.4,50.8,76.2", "-o", "map.json"),
            "not a map. For a map, touch also a sphere, a ring or a pin",
        ),
        (("--reference", "ring"), "NAME=SHAPE:SIZE:u"),
        (("--reference", "a=cone:5"), "not a 'cone'"),
        (("--block", 50.8, "--reference", "block=ring:5"), "two references are called block"),
        (("--reference", "r=ring:40"), "is on 'block@0', which is none of the references (r)"),
    ],
)
def test_refused(words: tuple[object, ...], reason: str) -> None:
    err = " ".join(run("qualify", BLOCK[1], *words, code=2).split())
    assert reason in err


def test_plan_needs_a_map_or_a_block() -> None:
    assert "for an old map, or for a block" in run("plan-touches", code=2)
