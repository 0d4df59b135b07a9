"""Maps as tables and macros of controls; what simpler corrections leave."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from pretravel.compensation.comparison import compare_corrections
from pretravel.controls.lookup import (
    LookupSeats,
    LookupTable,
    exact_lookup,
    lookup_series,
    lookup_table,
    recurrence,
    sectoral_factor,
    supported_band,
)
from pretravel.controls.tables import fanuc_macro, heidenhain_table, renishaw_variables
from pretravel.directions import fibonacci_cap, from_angles, grid, ring_pattern, sphere_pattern_25
from pretravel.errors import ExtrapolationError, PretravelError
from pretravel.formats.map_file import write_map
from pretravel.formats.touches_csv import read_touches
from pretravel.frames import probe_rotation
from pretravel.identification.kinds import qualify
from pretravel.maps.bases import SECTOR_NAMES, HarmonicBasis, WozniakBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.sector_tables import resampled_sectors, touched_sectors
from pretravel.maps.spherical_harmonics import degrees_and_orders, real_spherical_harmonics
from pretravel.maps.support import DirectionSupport
from pretravel.probe.catalogue import load_probe
from pretravel.trigger.predict import predict
from pretravel.trigger.response import probe_response, response_map
from pretravel.units import DEGREE, MICROMETRE
from tests.conftest import EXAMPLES
from tests.unit.test_command_line import rows, run


@cache
def example_map(kind: str = "harmonic") -> PretravelMap:
    touches = read_touches(EXAMPLES / "sphere_touches.csv")
    return qualify(touches, 24.9987, tip_diameter=6.0, kind=kind).pretravel_map


def lobes(order: int, phase: float = 0.0, rotation: np.ndarray | None = None) -> PretravelMap:
    """Pretravel sin^order(polar) cos(order azimuth - phase) of 1 mm at the most, on 10 mm."""
    terms = np.array([[0, 0], [order, order], [order, -order]])
    amplitude = 1.0 / sectoral_factor(order)
    coefficients = [10.0, amplitude * np.cos(phase), amplitude * np.sin(phase)]
    return PretravelMap(
        HarmonicBasis(terms), np.array(coefficients), np.zeros(3),
        DirectionSupport(ring_pattern(np.array([0, 30, 60, 90]) * DEGREE, 24)), tip_radius=30.0,
        rotation=np.eye(3) if rotation is None else rotation,
    )  # fmt: skip


def predicted() -> PretravelMap:
    probe = load_probe("omp40-2")
    trigger = predict(probe, ring_pattern(np.array([0, 30, 60, 90]) * DEGREE, 24))
    return response_map(probe, probe_response(probe), trigger)


class TestLookup:
    def test_recurrence_is_the_spherical_harmonics(self) -> None:
        """Ours, as a control does it, against SciPy's associated Legendre functions."""
        directions = fibonacci_cap(200, np.pi)
        across = np.hypot(directions[:, 0], directions[:, 1])
        for order in range(9):
            before, now = np.zeros(200), sectoral_factor(order) * across**order
            for degree in range(order, 25):
                if degree > order:
                    a, b = recurrence(degree, order)
                    before, now = now, a * directions[:, 2] * now - b * before
                phase = np.cos(order * np.arctan2(directions[:, 1], directions[:, 0]))
                expected = real_spherical_harmonics(directions, [(degree, order)])[:, 0]
                assert now * phase == pytest.approx(expected, abs=1e-11)

    def test_series_is_exact(self) -> None:
        pretravel_map = example_map()
        series = lookup_series(pretravel_map)
        assert series.largest_error < 1e-12
        directions = fibonacci_cap(500, 90 * DEGREE)
        assert series.value(directions) == pytest.approx(
            pretravel_map.pretravel(directions), abs=1e-12
        )

    def test_six_seats_are_exact(self) -> None:
        for pretravel_map in (example_map("physical"), predicted()):
            seats = exact_lookup(pretravel_map)
            assert isinstance(seats, LookupSeats)
            assert seats.largest_error < 1e-12
            directions = fibonacci_cap(300, 85 * DEGREE)
            machine = directions @ pretravel_map.rotation.T
            assert seats.value(directions) == pytest.approx(
                pretravel_map.pretravel(machine), abs=1e-12
            )
        assert exact_lookup(example_map("wozniak")) is None

    def test_series_of_every_degree_and_order(self) -> None:
        terms = degrees_and_orders(6)
        rng = np.random.default_rng(0)
        whole = PretravelMap(
            HarmonicBasis(terms), rng.standard_normal(len(terms)), np.zeros(len(terms)),
            DirectionSupport(sphere_pattern_25()), tip_radius=3.0,
        )  # fmt: skip
        assert lookup_series(whole).largest_error < 1e-12

    @pytest.mark.parametrize("kind", ["harmonic", "physical", "wozniak"])
    def test_table_errs_no_more_than_its_header_says(self, kind: str) -> None:
        pretravel_map = example_map(kind)
        table = lookup_table(pretravel_map, tolerance=5e-4, most_values=1900)
        polar = np.random.default_rng(1).uniform(table.band.lowest, table.band.highest, 4000)
        azimuth = np.random.default_rng(2).uniform(0, 2 * np.pi, 4000)
        directions = from_angles(polar, azimuth)
        error = np.abs(
            table.value(directions) - pretravel_map.pretravel(directions, extrapolate=True)
        )
        # Found on 200 000 directions; kinks may hide a little more between them.
        assert error.max() < 1.1 * table.largest_error + 1e-9
        assert error.max() > 0.2 * table.largest_error
        nodes = grid(
            np.linspace(table.band.lowest, table.band.highest, table.rows),
            np.arange(table.values.shape[1]) * table.azimuth_step,
        )
        assert table.value(nodes) == pytest.approx(
            pretravel_map.pretravel(nodes, extrapolate=True), abs=1e-9
        )

    def test_finer_tables_err_less(self) -> None:
        """Cubic: half the step, about an eighth of the error, or less (here: a smooth map)."""
        smooth = lobes(3)
        errors = [
            lookup_table(smooth, tolerance=1e-12, most_values=count).largest_error
            for count in (110, 400, 1700)
        ]
        assert errors[1] < errors[0] / 4.0
        assert errors[2] < errors[1] / 4.0

    def test_table_of_a_ring(self) -> None:
        around = ring_pattern(np.array([90.0]) * DEGREE, 72)
        ring = PretravelMap(
            HarmonicBasis(np.array([[0, 0], [3, 3]])), np.array([0.01, 0.002]), np.zeros(2),
            DirectionSupport(around), tip_radius=3.0,
        )  # fmt: skip
        band = supported_band(ring)
        assert band.lowest / DEGREE == pytest.approx(85.0, abs=0.3)
        assert band.highest / DEGREE == pytest.approx(95.0, abs=0.3)
        table = lookup_table(ring, tolerance=1e-5, most_values=1900)
        assert table.largest_error <= 1e-5

    def test_half_a_ring_is_no_table(self) -> None:
        half = from_angles(np.pi / 2, np.arange(0, 181, 10) * DEGREE)
        with pytest.raises(PretravelError, match="does not hold all around"):
            supported_band(
                PretravelMap(
                    HarmonicBasis(np.array([[0, 0]])), np.array([0.01]), np.zeros(1),
                    DirectionSupport(half), tip_radius=3.0,
                )
            )  # fmt: skip

    def test_azimuth_has_no_seam(self) -> None:
        table = lookup_table(example_map(), tolerance=1e-4, most_values=400)
        near = np.array([-1e-9, 0.0, 1e-9])
        values = table.value(from_angles(60 * DEGREE, near))
        assert np.ptp(values) < 1e-9
        assert isinstance(table, LookupTable)


class TestSectors:
    def test_touched_at_their_angles(self) -> None:
        table = touched_sectors(lobes(3))
        expected = {name: 10.0 + np.cos(3 * float(name) * DEGREE) for name in SECTOR_NAMES[2:]}
        assert table.pretravel[2:] == pytest.approx(list(expected.values()))
        # Opposite directions share a radius, and three lobes are opposite there: a mean of nothing.
        assert table.pretravel[:2] == pytest.approx([10.0, 10.0])
        assert table.largest == pytest.approx(1.0)

    def test_resampled_is_the_best_there_is(self) -> None:
        """No other radii leave less, by an optimiser that knows only the residual."""
        from scipy.optimize import linprog

        from pretravel.maps.bases import SectorBasis

        pretravel_map = example_map()
        found = resampled_sectors(pretravel_map)
        azimuth = np.arange(0.0, 360.0, 0.5) * DEGREE
        design = SectorBasis().design(from_angles(np.pi / 2, azimuth))
        truth = pretravel_map.pretravel(from_angles(np.pi / 2, azimuth))
        # At ties either sector may be taken: both must hold.
        i, j = np.nonzero(design)
        a = np.zeros((2 * len(i), 11))
        a[np.arange(len(i)), j], a[len(i) + np.arange(len(i)), j] = 1.0, -1.0
        a[:, 10] = -1.0
        b = np.concatenate([truth[i], -truth[i]])
        best = linprog([0.0] * 10 + [1.0], A_ub=a, b_ub=b, bounds=[(None, None)] * 11)
        assert found.largest == pytest.approx(best.fun, abs=1e-9)
        assert found.largest < touched_sectors(pretravel_map).largest
        assert resampled_sectors(pretravel_map, "rms").rms < found.rms

    def test_within_a_sector_071_of_a_lobe_is_left(self) -> None:
        """15° from a sector's middle three lobes have gone through 45°."""
        pretravel_map = lobes(3, phase=90 * DEGREE)
        table = touched_sectors(pretravel_map)
        azimuth = np.concatenate([float(n) + np.arange(-15, 16) for n in SECTOR_NAMES[2:]])
        around = from_angles(np.pi / 2, azimuth * DEGREE)
        value = np.repeat(table.pretravel[2:], 31)
        left = np.max(np.abs(pretravel_map.pretravel(around) - value))
        assert left == pytest.approx(np.sin(45 * DEGREE), abs=1e-9)
        # Where opposite directions share one radius a whole lobe can be left.
        assert table.largest == pytest.approx(1.0)

    def test_variables_in_the_order_of_the_control(self) -> None:
        text = renishaw_variables(lobes(3), base=500)
        values = {int(n): float(v) for n, v in re.findall(r"^#(\d+)=([\d.]+)", text, re.M)}
        assert sorted(values) == [500, 501, *range(510, 518)]
        # Largest effective radius where the pretravel is least.
        assert values[511] > values[510]  # 60°: cos 180°; 30°: cos 90°
        assert 502 not in values
        assert 503 not in values

    def test_tables_are_in_the_machine_s_axes(self) -> None:
        """A probe mounted 30° turned: the sector that it had at 30° is at 60° now."""
        turned = renishaw_variables(lobes(3, rotation=probe_rotation(rotation=30 * DEGREE)))
        straight = renishaw_variables(lobes(3))
        of = [dict(re.findall(r"^#(\d+)=([\d.]+)", t, re.M)) for t in (turned, straight)]
        assert of[0]["511"] == of[1]["510"]


class TestHeidenhain:
    def test_default_template_says_that_it_is_unverified(self) -> None:
        text = heidenhain_table(lobes(3))
        assert "UNVERIFIED" in text.splitlines()[0]
        last = text.splitlines()[-1].split()
        assert float(last[1]) == 90.0
        assert float(last[2]) == pytest.approx(-10.0, abs=1e-6)  # the mean around

    def test_a_tilted_probe_has_its_own_angles(self) -> None:
        """Angles are those from the probe's axis, however the probe is mounted."""
        tilted = lobes(3, rotation=probe_rotation((np.sin(0.5), 0.0, np.cos(0.5)), 0.3))
        assert heidenhain_table(tilted) == heidenhain_table(lobes(3))

    def test_own_template_and_azimuth(self) -> None:
        text = heidenhain_table(
            lobes(3), "A;B\n{angle_deg:.1f};{deviation_mm:.3f}\n", azimuth=0.0, step_deg=30.0
        )
        assert text.splitlines() == ["A;B", "0.0;-10.000", "30.0;-10.125", "60.0;-10.650",
                                     "90.0;-11.000"]  # fmt: skip

    @pytest.mark.parametrize(
        ("template", "words"),
        [("{angel_deg}\n", "line 1: 'angel_deg'"), ("hello\n", "no line with"), ("{\n", "line 1")],
    )
    def test_templates_refused(self, template: str, words: str) -> None:
        with pytest.raises(PretravelError, match=words):
            heidenhain_table(lobes(3), template)


class TestDelayTravel:
    def test_in_every_table_a_later_trigger(self) -> None:
        """10 µm of travel more: pretravel larger, radii and deviations smaller by that."""
        pretravel_map = lobes(3)
        slow, fast = (heidenhain_table(pretravel_map, travel=t).splitlines()[-1].split()[2]
                      for t in (0.0, 0.01))  # fmt: skip
        assert float(fast) - float(slow) == pytest.approx(-0.01, abs=2e-5)
        table = lookup_table(pretravel_map, tolerance=1e-3, most_values=400)
        first = [
            float(
                re.search(r"^#500=([\d.]+)", fanuc_macro(pretravel_map, table, travel=t), re.M)[1]
            )  # type: ignore[index]
            for t in (0.0, 0.01)
        ]
        assert first[1] - first[0] == pytest.approx(0.01, abs=2e-7)


class TestExportCommand:
    @pytest.fixture
    def map_file(self, tmp_path: Path) -> Path:
        path = tmp_path / "map.nc"
        write_map(path, example_map())
        return path

    def test_csv_of_effective_radii(self, tmp_path: Path, map_file: Path) -> None:
        run("export", map_file, "--to", "csv", "-o", tmp_path / "r.csv")
        for row in rows(tmp_path / "r.csv")[:5]:
            radius = 3.0 - float(row["pretravel_um"]) * 1e-3
            assert float(row["effective_radius_mm"]) == pytest.approx(radius, abs=1e-9)

    def test_linuxcnc_folder_without_stale_tables(self, tmp_path: Path, map_file: Path) -> None:
        out = tmp_path / "subs"
        run("export", map_file, "--to", "linuxcnc", "--form", "table", "-o", out)
        assert (out / "pretravel_table.ngc").exists()
        run("export", map_file, "--to", "linuxcnc", "-o", out)
        assert not (out / "pretravel_table.ngc").exists()
        lookup = (out / "pretravel_lookup.ngc").read_text()
        assert "largest error against the map 0.000 um" in lookup
        for text in (path.read_text() for path in out.iterdir()):
            assert max(map(len, text.splitlines())) <= 250

    def test_a_delay_wants_the_feed(self, tmp_path: Path) -> None:
        path = tmp_path / "rest.nc"
        write_map(path, replace(example_map(), delay=0.01, u_delay=1e-4, feed=None))
        out = tmp_path / "r.txt"
        assert "--feed" in run("export", path, "--to", "renishaw", "-o", out, code=2)
        run("export", path, "--to", "renishaw", "-o", out, "--feed", 60)
        slow = re.search(r"^#500=([\d.]+)", out.read_text(), re.M)
        run("export", path, "--to", "renishaw", "-o", out, "--feed", 120)
        fast = re.search(r"^#500=([\d.]+)", out.read_text(), re.M)
        # 1 mm/s more for 10 ms.
        assert slow is not None
        assert fast is not None
        assert float(slow[1]) - float(fast[1]) == pytest.approx(0.010, abs=1.1e-5)

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            (["--to", "siemens", "-o", "x"], "--to siemens: it is not known; there are linuxcnc"),
            (["--to", "renishaw"], "say where to write to"),
            (["--to", "linuxcnc", "-o", "x.ngc"], "a folder is needed"),
            (["--to", "renishaw", "-o", "/nowhere/x.txt"], "does not exist"),
            (["--to", "renishaw", "-o", "x.txt", "--base", "5"], "not all common ones"),
            (["--to", "fanuc", "-o", "x.txt", "--base", "900"], "not all common ones"),
            (["--to", "renishaw", "-o", "x.txt", "--criterion", "best"], "not one of 'max', 'rms'"),
            (["--to", "linuxcnc", "-o", "x", "--tolerance", "0"], "greater than or equal to"),
        ],
    )
    def test_refused(
        self, tmp_path: Path, map_file: Path, monkeypatch: pytest.MonkeyPatch,
        options: list[str], words: str,
    ) -> None:  # fmt: skip
        monkeypatch.chdir(tmp_path)
        assert words in run("export", map_file, *options, code=2)
        assert sorted(p.name for p in tmp_path.iterdir()) == ["map.nc"]


class TestComparison:
    def test_three_lobes_in_closed_form(self) -> None:
        result = compare_corrections(lobes(3, phase=90 * DEGREE))
        left = {(row.method, row.where): row for row in result.rows}
        # One radius leaves the whole lobes; their mean square over the azimuth is a half.
        assert left["mean radius", "equator"].largest == pytest.approx(1.0)
        assert left["mean radius", "equator"].rms == pytest.approx(np.sqrt(0.5), abs=1e-9)
        assert left["eight sectors", "equator"].largest == pytest.approx(1.0)
        assert left["four directions", "equator"].rms > left["eight sectors", "equator"].rms
        assert left["full map", "all"].largest == 0.0

    def test_wozniak_finds_itself(self) -> None:
        basis = WozniakBasis(17 * DEGREE)
        own = PretravelMap(
            basis, np.array([0.004, 0.0, 0.0]), np.zeros(3),
            DirectionSupport(ring_pattern(np.array([0, 30, 60, 90]) * DEGREE, 24)), tip_radius=3.0,
            rotation=probe_rotation(rotation=25 * DEGREE),
        )  # fmt: skip
        left = {(r.method, r.where): r for r in compare_corrections(own).rows}
        assert left["Woźniak", "all"].largest < 1e-12
        assert left["eight sectors", "equator"].largest > 1e-4

    def test_along_the_axis_controls_have_their_length(self) -> None:
        up = np.array([[0.0, 0.0, 1.0]])
        result = compare_corrections(example_map(), up)
        part = {row.method: row.largest for row in result.rows if row.where == "part"}
        assert part["mean radius"] == pytest.approx(0.0, abs=1e-12)

    def test_a_map_that_does_not_hold_on_the_equator(self) -> None:
        cap = PretravelMap(
            HarmonicBasis(np.array([[0, 0]])), np.array([0.01]), np.zeros(1),
            DirectionSupport(ring_pattern(np.array([0, 30, 60]) * DEGREE, 24)), tip_radius=3.0,
        )  # fmt: skip
        with pytest.raises(ExtrapolationError):
            compare_corrections(cap)

    def test_command_and_its_picture(self, tmp_path: Path) -> None:
        write_map(tmp_path / "map.nc", example_map())
        part = EXAMPLES / "part_touches.csv"
        for ending in ("csv", "json", "html"):
            told = run("compare", tmp_path / "map.nc", "--part", part, "-o",
                       tmp_path / f"c.{ending}", "--plot", tmp_path / "c.png")  # fmt: skip
        assert "on the part: max" in told
        table = rows(tmp_path / "c.csv")
        assert {row["where"] for row in table} == {"equator", "all", "part"}
        full = [float(row["largest_um"]) for row in table if row["method"] == "full map"]
        assert full == [0.0, 0.0, 0.0]
        assert (tmp_path / "c.png").stat().st_size > 20_000
        assert MICROMETRE == 1e-3
