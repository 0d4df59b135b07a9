"""Variances of a separation as the scatter of compensated touches."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import from_angles
from pretravel.base.errors import PretravelError
from pretravel.base.frames import Placement, probe_rotation
from pretravel.drawing.features.measured_feature import measure_feature
from pretravel.files.csv_table import write_csv_table
from pretravel.files.map_file import write_map
from pretravel.files.touches_csv import touches_table
from pretravel.maps.kinds.mean import MeanBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.support import DirectionSupport
from pretravel.measurement.compensation import apply
from pretravel.measurement.point_errors import errors_of_points, point_sources, total_covariance
from pretravel.measurement.touch_scatter import TouchScatter
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance
from tests.support.commands import rows, run
from tests.support.examples import EXAMPLES

UM2 = 1e-6
AROUND = 2.0 * np.pi * np.arange(24) / 24.0
MACHINE = (0.30 + 0.20 * np.cos(AROUND)) * UM2
PROBE = (0.40 + 0.30 * np.cos(3.0 * AROUND)) * UM2
SCATTER = TouchScatter(AROUND, MACHINE, AROUND, PROBE)


def _map(rotation: np.ndarray | None = None, repeatability: float = 5e-4) -> PretravelMap:
    rotation = np.eye(3) if rotation is None else rotation
    nodes = from_angles(np.full(9, 1.2), np.linspace(0.0, 5.6, 9))
    return PretravelMap(
        MeanBasis(), np.array([0.010]), Covariance.independent([4e-8]), DirectionSupport(nodes),
        tip_radius=3.0, repeatability=repeatability, rotation=rotation, u_tip_radius=1e-4,
    )  # fmt: skip


def _touches(normals: np.ndarray) -> Touches:
    return Touches(20.0 * normals, normals)


def test_a_touch_scatters_as_its_pair_of_directions() -> None:
    """Machine direction 40° of a probe that is turned by 30°: its own direction is 10°, between
    those of 0 and 15°. Along the axis the repeatability of the map counts, in squares."""
    made = _map(probe_rotation(rotation=math.radians(30.0)))
    for polar in (90.0, 60.0, 0.0):
        normal = from_angles(math.radians(polar), math.radians(40.0)).reshape(1, 3)
        machine, probe = SCATTER.variances(normal, made)
        of_machine = np.interp(40.0, [30.0, 45.0], MACHINE[[2, 3]])
        of_probe = np.interp(10.0, [0.0, 15.0], PROBE[[0, 1]])
        across = math.sin(math.radians(polar)) ** 2
        total = across * (of_machine + of_probe) + (1.0 - across) * 2.5e-7
        assert machine[0] + probe[0] == pytest.approx(total, rel=1e-9)
        if polar > 0.0:  # along the axis there is no azimuth
            assert machine[0] / probe[0] == pytest.approx(of_machine / of_probe, rel=1e-9)


def test_the_seam_of_the_circle() -> None:
    """355° lies between 345° and 0°, and a table may begin anywhere."""
    normal = from_angles(0.5 * np.pi, math.radians(355.0)).reshape(1, 3)
    expected = np.interp(10.0, [0.0, 15.0], MACHINE[[23, 0]])
    assert SCATTER.variances(normal, _map())[0][0] == pytest.approx(expected, rel=1e-9)
    moved = TouchScatter(np.roll(AROUND, 5) - 2.0 * np.pi, np.roll(MACHINE, 5), AROUND, PROBE)
    assert moved.variances(normal, _map())[0][0] == pytest.approx(expected, rel=1e-9)


def test_the_machine_does_not_turn_with_a_part() -> None:
    """A part that lies turned by 90°: its normal along x is the machine's along y."""
    placement = Placement(probe_rotation(rotation=0.5 * np.pi), np.zeros(3))
    made = _map()
    x, y = np.eye(3)[[0]], np.eye(3)[[1]]
    in_part = SCATTER.seen_from(placement).variances(x, made.seen_from(placement))
    in_machine = SCATTER.variances(y, made)
    assert [part[0] for part in in_part] == pytest.approx([part[0] for part in in_machine])


def test_points_and_their_budget_have_both_parts() -> None:
    """u² along the normal is map² + tip² + pair; without a separation that of the repeatability."""
    made, normals = _map(), from_angles(np.full(4, 0.5 * np.pi), AROUND[[0, 3, 8, 15]])
    touches = _touches(normals)
    points = apply(touches, made, extrapolate=True, scatter=SCATTER)
    pair = MACHINE[[0, 3, 8, 15]] + PROBE[[0, 3, 8, 15]]
    expected = np.sqrt(4e-8 + 1e-8 + pair)
    assert points.standard_uncertainty == pytest.approx(expected, rel=1e-9)
    plain = apply(touches, made, extrapolate=True)
    assert plain.standard_uncertainty == pytest.approx(np.sqrt(4e-8 + 1e-8 + 25e-8), rel=1e-9)
    errors = errors_of_points(touches, normals, made, SCATTER)
    budget = errors.budget(1)
    parts = {c.name: c.standard_uncertainty**2 for c in budget.components}
    assert parts["machine, separated"] == pytest.approx(MACHINE[3])
    assert parts["probe, separated"] == pytest.approx(PROBE[3])
    assert "repeatability" not in parts
    assert budget.combined == pytest.approx(points.standard_uncertainty[1], rel=1e-9)
    total = total_covariance(errors.along_normals()).matrix
    assert np.diag(total) == pytest.approx(points.standard_uncertainty**2, rel=1e-9)
    both = total_covariance(point_sources(touches, plain, made)).matrix
    assert total - both == pytest.approx(np.diag(pair - 25e-8), abs=1e-15)


@pytest.mark.published("Nafi and Mayer 2011", "Section VI")
def test_a_feature_has_the_scatter_of_its_directions() -> None:
    """A circle of 12 touches: u of x and of y by the law of propagation from the variances of the
    touches, against Monte Carlo of 4000 circles in numpy; 3 % is what these trials tell."""
    made = PretravelMap(
        MeanBasis(), np.array([0.010]), Covariance.independent([1e-14]),
        DirectionSupport(from_angles(np.full(9, 1.5), np.linspace(0.0, 5.6, 9))),
        tip_radius=3.0, repeatability=5e-4,
    )  # fmt: skip
    steep = TouchScatter(AROUND, (0.1 + 0.9 * np.cos(AROUND) ** 2) * UM2, AROUND, 0.0 * PROBE)
    azimuth = AROUND[::2]
    normals = np.stack([np.cos(azimuth), np.sin(azimuth), 0.0 * azimuth], axis=1)
    points = apply(Touches(20.0 * normals, normals), made, extrapolate=True, scatter=steep)
    found = measure_feature(points, "circle")
    u = {q.name: q.u for q in found.quantities}
    rng = np.random.default_rng(8)
    design = np.stack([np.cos(azimuth), np.sin(azimuth), np.ones(12)], axis=1)
    noise = rng.standard_normal((4000, 12)) * np.sqrt(1e-7 + 9e-7 * np.cos(azimuth) ** 2)
    x, y, _ = np.linalg.lstsq(design, noise.T, rcond=None)[0]
    assert np.std(x) > 1.2 * np.std(y)
    assert u["x"] == pytest.approx(np.std(x), rel=0.04)
    assert u["y"] == pytest.approx(np.std(y), rel=0.04)


@pytest.mark.parametrize(
    ("machine", "probe", "words"),
    [
        ((np.full(24, np.nan), MACHINE), (AROUND, PROBE), "azimuths of its machine directions"),
        ((AROUND, MACHINE), (AROUND, MACHINE - 1e-6), "a negative variance"),
        ((AROUND, np.full(24, np.nan)), (AROUND, PROBE), "variance of the machine is not finite"),
    ],
)
def test_separations_that_tell_nothing(machine: object, probe: object, words: str) -> None:
    with pytest.raises(PretravelError, match=words):
        TouchScatter(*machine, *probe)  # type: ignore[misc]


@pytest.mark.published(
    "Nafi and Mayer 2011", "Section VI",
    what="variance of an actual touch, Monte Carlo",
    ours="u of each point by its direction; errors of both drawn in simulations, budgets and"
    " features",
    theirs="suggested",
    verdict="agrees",
    command="pretravel compensate … --machine separation.json ; pretravel measure … --trials "
    "2000",
)  # fmt: skip
def test_compensate_with_a_separation(tmp_path: Path) -> None:
    """From the shipped readings to u of each point: the pair of its azimuth, by the separation's
    own table, whichever of its files is given."""
    for ending in ("csv", "json"):
        run("separate", EXAMPLES / "redundancy_24x24.csv", "-o", tmp_path / f"separation.{ending}")
    table = rows(tmp_path / "separation.csv")
    pairs = {
        kind: [float(row["variance_um2"]) for row in table if row["kind"] == kind]
        for kind in ("machine", "probe")
    }
    write_map(tmp_path / "map.json", _map())
    normals = from_angles(np.full(24, 0.5 * np.pi), AROUND)
    write_csv_table(tmp_path / "touches.csv", touches_table(_touches(normals)))
    u = {}
    for ending in ("", "csv", "json"):
        out = tmp_path / "points.csv"
        options = ["--machine", tmp_path / f"separation.{ending}"] if ending else []
        run("compensate", tmp_path / "touches.csv", "--map", tmp_path / "map.json", "-o", out,
            "--extrapolate", *options)  # fmt: skip
        u[ending] = np.array([float(row["u_um"]) for row in rows(out)])
    pair = np.add(pairs["machine"], pairs["probe"])
    assert np.ptp(pair) > 0.2
    # In the place of the repeatability of 0.5 µm.
    for ending in ("csv", "json"):
        assert u[ending] ** 2 - u[""] ** 2 == pytest.approx(pair - 0.25, abs=1e-5)


def test_compensate_refuses_what_is_no_separation(tmp_path: Path) -> None:
    normals = from_angles(np.full(4, 0.5 * np.pi), AROUND[::6])
    write_csv_table(tmp_path / "touches.csv", touches_table(_touches(normals)))
    wrong = tmp_path / "wrong.json"
    uneven = [
        {"name": "kind", "values": ["machine"]},
        {"name": "variance_um2", "values": [1.0, 2.0]},
        {"name": "azimuth_deg", "values": [1.0]},
    ]
    table = json.dumps({"document": {"data": [{"title": "Directions", "columns": uneven}]}})
    for content in ("{}", '{"document": {"data": []}}', "nothing", "[1]", table):
        wrong.write_text(content)
        told = run("compensate", tmp_path / "touches.csv", "--map", "omp40-2", "--machine", wrong,
                   "-o", tmp_path / "p.csv", code=2)  # fmt: skip
        assert "not a result of separate" in told
