"""Limits, messages and blocks of maps; averages, tables of sectors and origins by hand."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass, replace
from functools import cache
from typing import Any, ClassVar, Self, cast

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import fibonacci_cap, from_angles, ring_pattern
from pretravel.base.errors import ExtrapolationError, PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.base.units import DEGREE
from pretravel.maps import basis as basis_module
from pretravel.maps import plausibility, pretravel_map
from pretravel.maps.basis import (
    CondensedProbe,
    MapBasis,
    SeriesForm,
    SixSeatForm,
    StoredArray,
    StoredBasis,
    values_in_blocks,
)
from pretravel.maps.grid import effective_radius_table, map_grid
from pretravel.maps.kinds.averaged import AveragedBasis, averaged_map, stored_parts
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.kinds.mean import MeanBasis
from pretravel.maps.kinds.sectors import SECTOR_NAMES, SectorBasis
from pretravel.maps.kinds.wozniak import WozniakBasis
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import (
    AXIAL_PRETRAVEL,
    STEEL_EXPANSION,
    USUAL_SPHERE_FORM,
    USUAL_U_DIAMETER,
    USUAL_U_TEMPERATURE,
    Origin,
    Provenance,
    QualificationSetup,
)
from pretravel.maps.sector_tables import resampled_sectors, taken_opposite, touched_sectors
from pretravel.maps.support import DirectionSupport
from pretravel.uncertainty.covariance import Covariance

HALF = DirectionSupport(ring_pattern(np.radians([0.0, 30.0, 60.0, 90.0]), 24))
TURN = probe_rotation((0.6, 0.0, 0.8), 0.3)


def _map(basis: MapBasis, **others: Any) -> PretravelMap:
    given: dict[str, Any] = {
        "coefficients": 0.01 * (1.0 + 0.3 * np.sin(np.arange(basis.size))),
        "covariance": Covariance.none(basis.size),
        "support": HALF,
        "tip_radius": 3.0,
    }
    return PretravelMap(basis, **given | others)


class TestNumbersOfAMap:
    @pytest.mark.parametrize(
        "numbers",
        [
            {"tip_radius": 0.0}, {"tip_radius": 501.0}, {"u_tip_radius": -1e-9},
            {"repeatability": 1001.0}, {"fixed_scatter": -1e-9}, {"feed": 1.1e6},
            {"delay": 10.1}, {"delay": -10.1}, {"u_delay": -1e-9}, {"u_delay": 10.1},
            {"u_delay": math.nan}, {"repeatability_dof": math.nan}, {"repeatability_dof": -1e-9},
        ],
    )  # fmt: skip
    def test_beyond_their_limits(self, numbers: dict[str, float]) -> None:
        with pytest.raises(PretravelError):
            _map(MeanBasis(), **numbers)

    def test_within_their_limits(self) -> None:
        made = _map(
            MeanBasis(), tip_radius=5e-4, u_tip_radius=0.0, repeatability=0.0, fixed_scatter=0.0,
            feed=0.0, delay=-10.0, u_delay=10.0, repeatability_dof=0.0,
        )  # fmt: skip
        assert made.repeatability_dof == 0.0
        plain = _map(MeanBasis())
        assert (plain.u_tip_radius, plain.repeatability, plain.fixed_scatter) == (0.0, 0.0, 0.0)
        assert (plain.feed, plain.delay, plain.repeatability_dof) == (None, None, math.inf)
        assert np.array_equal(plain.rotation, np.eye(3))

    def test_the_source_is_told_where_there_is_one(self) -> None:
        made = _map(MeanBasis(), repeatability=3e-4)
        assert repr(made) == (
            "PretravelMap(mean; 58 directions; tip radius 3.0000 mm; repeatability 0.30 µm)"
        )
        sourced = replace(made, provenance=Provenance(source="made by hand"))
        assert repr(sourced).endswith("repeatability 0.30 µm; made by hand)")


class TestOutside:
    """Polar angles up to 90° hold, and 5° more."""

    MADE = _map(MeanBasis(), rotation=TURN)

    def _refused(self, n: FloatArray) -> str:
        with pytest.raises(ExtrapolationError) as told:
            self.MADE.pretravel(n @ TURN.T)
        return str(told.value)

    def test_each_function_refuses_and_can_be_told_not_to(self) -> None:
        n = from_angles(np.radians([50.0, 99.0]), np.zeros(2)) @ TURN.T
        made = self.MADE
        calls = (made.pretravel, made.pretravel_and_uncertainty, made.tip_displacement)
        for call in calls:
            with pytest.raises(ExtrapolationError):
                call(n)
            assert np.isfinite(call(n, extrapolate=True)).all()
            assert np.isfinite(call(n[:1])).all()
        assert made.supports(n).tolist() == [True, False]
        assert made.supports(n, 9.1 * DEGREE).tolist() == [True, True]
        assert made.supports(n, 8.9 * DEGREE).tolist() == [True, False]

    def test_the_first_one_outside_is_told_with_its_distance(self) -> None:
        """In the frame of the probe: 97° is 7° from the nearest touch."""
        n = from_angles(np.radians([50.0, 97.0, 99.0]), np.radians([0.0, 45.0, 60.0]))
        said = self._refused(n)
        assert "2 of 3 directions lie outside the map, the first at polar 97.0°, azimuth 45.0°" in (
            said
        )
        assert "(7.0° away from the nearest supported one)" in said

    @pytest.mark.parametrize(
        ("down", "up", "opposite"), [(9, 1, True), (5, 1, True), (8, 3, True), (18, 5, True)]
    )
    def test_normals_that_point_inwards(self, down: int, up: int, opposite: bool) -> None:
        """More than nine of ten, and more than four, of all directions lie outside."""
        inside = fibonacci_cap(max(down, up), 1.0)
        said = self._refused(np.vstack([inside[:up], -inside[:down]]))
        expected = down > max(0.9 * (down + up), 4)
        assert ("turn the signs" in said) == expected
        del opposite

    @pytest.mark.parametrize(("beside", "expected"), [(0, True), (1, False), (2, False)])
    def test_directions_whose_opposites_lie_outside_too(self, beside: int, expected: bool) -> None:
        """Of ten directions outside, more than nine must have an opposite inside."""
        cap = DirectionSupport(ring_pattern(np.radians([0.0, 20.0, 40.0]), 12))
        made = _map(MeanBasis(), support=cap)
        n = np.vstack(
            [
                -fibonacci_cap(10 - beside, 0.6),
                from_angles(np.full(beside, 0.5 * np.pi), np.arange(float(beside))),
            ]
        )
        with pytest.raises(ExtrapolationError) as told:
            made.pretravel(n)
        assert ("turn the signs" in str(told.value)) == expected


@dataclass(frozen=True)
class _Sliding(MapBasis):
    """1, n_x and n_x n_y, of which the first `own` exist; displaced along n and along z, more on a
    curved part."""

    own: int = 3
    kind: ClassVar[str] = "sliding"

    @property
    def size(self) -> int:
        return self.own

    @property
    def constant(self) -> FloatArray:
        return np.eye(self.own)[0]

    def design(self, directions: FloatArray) -> FloatArray:
        x, y = directions[:, 0], directions[:, 1]
        return np.stack([np.ones(len(x)), x, x * y], axis=1)[:, : self.own]

    def displacement(
        self, directions: FloatArray, curvatures: FloatArray | None
    ) -> FloatArray | None:
        size = 0.004 if curvatures is None else 0.004 + 0.1 * curvatures.sum(axis=1)[:, None]
        return np.asarray(size * directions + [0.0, 0.0, 0.002])

    @classmethod
    def restored(cls, stored: StoredBasis) -> Self:
        del stored
        return cls()


class TestDisplacement:
    N = from_angles(np.radians([20.0, 50.0, 80.0]), np.array([0.4, 2.0, 4.0]))
    CURVED = np.array([[0.01, 0.02], [0.0, 0.05], [0.03, 0.01]])

    def test_on_a_flat_part_its_component_along_the_normal_is_the_pretravel(self) -> None:
        made = _map(_Sliding(), rotation=TURN)
        moved = made.tip_displacement(self.N @ TURN.T) @ TURN
        value = made.pretravel(self.N @ TURN.T)
        assert np.sum(moved * self.N, axis=1) == pytest.approx(value, rel=1e-12)
        beside = moved - value[:, None] * self.N
        along_z = np.array([0.0, 0.0, 0.002]) - 0.002 * self.N[:, 2:] * self.N
        assert beside == pytest.approx(along_z, abs=1e-15)
        # A curved part changes it as it does the probe's own displacement.
        curved = made.tip_displacement(self.N @ TURN.T, self.CURVED) @ TURN
        more = 0.1 * np.array([0.03, 0.05, 0.04])[:, None] * self.N
        assert curved - moved == pytest.approx(more, abs=1e-15)

    def test_a_prediction_is_the_probe_itself(self) -> None:
        """One coefficient alone: the scale of the predicted probe; nothing is missing."""
        made = _map(_Sliding(1), rotation=TURN)
        moved = made.tip_displacement(self.N @ TURN.T) @ TURN
        assert moved == pytest.approx(0.004 * self.N + [0.0, 0.0, 0.002], abs=1e-15)


class TestBlocks:
    def test_values_and_uncertainties(self, monkeypatch: pytest.MonkeyPatch) -> None:
        half = 1e-4 * np.random.default_rng(3).normal(size=(3, 3))
        made = _map(
            _Sliding(), covariance=Covariance.full(half @ half.T),
            delay=1e-3, u_delay=1e-5, delay_effect=np.array([1e-4, -2e-4, 3e-4]),
        )  # fmt: skip
        n = fibonacci_cap(23, 1.5)
        x, y = n[:, 0], n[:, 1]
        rows = np.stack([np.ones(23), x, x * y], axis=1)
        value = rows @ made.coefficients
        variance = np.sum((rows @ half) ** 2, axis=1) + (rows @ [1e-4, -2e-4, 3e-4]) ** 2
        for numbers, block in ((9, 8192), (1, 8192), (4_000_000, 5)):
            monkeypatch.setattr(pretravel_map, "_CHUNK_VALUES", numbers)
            monkeypatch.setattr(pretravel_map, "BLOCK", block)
            monkeypatch.setattr(basis_module, "BLOCK", block)
            found, u = made.pretravel_and_uncertainty(n)
            assert found == pytest.approx(value, rel=1e-12)
            assert u == pytest.approx(np.sqrt(variance), rel=1e-9)
            assert made.standard_uncertainty(n) == pytest.approx(u, rel=1e-12)
            assert made.pretravel(n) == pytest.approx(value, rel=1e-12)
            by_basis = values_in_blocks(made.basis, n, made.coefficients)
            assert by_basis == pytest.approx(value, rel=1e-12)

    def test_a_map_without_an_uncertainty_has_none(self) -> None:
        made = _map(_Sliding(), delay_effect=np.ones(3))
        value, u = made.pretravel_and_uncertainty(fibonacci_cap(4, 1.5))
        assert not made.states_uncertainty
        assert u.tolist() == [0.0] * 4
        assert value == pytest.approx(made.pretravel(fibonacci_cap(4, 1.5)))


class TestGrid:
    def test_steps_that_are_not_stated(self) -> None:
        found = map_grid(_map(MeanBasis()))
        assert found["polar_deg"] == pytest.approx(np.arange(0.0, 91.0, 5.0))
        assert found["azimuth_deg"] == pytest.approx(np.arange(0.0, 360.0, 10.0))
        assert found["pretravel_um"].shape == found["u_um"].shape == (19, 36)

    @pytest.mark.parametrize(
        ("largest", "last"), [(60.005, 60.0), (60.015, 60.015), (164.0, 164.0), (168.0, 165.0)]
    )
    def test_the_last_row(self, largest: float, last: float) -> None:
        """A hundredth of a degree more is no row of its own; below 165° no table goes."""
        polar = np.radians([*np.arange(0.0, largest, 30.0), largest])
        made = _map(MeanBasis(), support=DirectionSupport(from_angles(polar, np.zeros(len(polar)))))
        rows = map_grid(made, 30.0, 90.0)["polar_deg"]
        assert rows[-1] == pytest.approx(last)
        assert np.diff(rows).min() > 1e-3

    def test_values_belong_to_their_angles(self) -> None:
        """n_x of the harmonic (1, 1) over sqrt(3), in the frame of the probe."""
        made = _map(
            HarmonicBasis(np.array([[0, 0], [1, 1]])),
            coefficients=np.array([0.010, 0.002 / math.sqrt(3.0)]),
            covariance=Covariance.full(np.diag([0.0, 1e-8 / 3.0])), rotation=TURN,
        )  # fmt: skip
        found = map_grid(made, 45.0, 120.0)
        polar = np.radians([0.0, 45.0, 90.0])[:, None]
        x = np.sin(polar) * np.cos(np.radians([0.0, 120.0, 240.0]))
        assert found["pretravel_um"] == pytest.approx(10.0 + 2.0 * x, abs=1e-9)
        assert found["u_um"] == pytest.approx(0.1 * np.abs(x), abs=1e-9)
        table = {name: np.asarray(v) for name, v in effective_radius_table(made).items()}
        row = np.flatnonzero((table["polar_deg"] == 90.0) & (table["azimuth_deg"] == 120.0))
        assert table["pretravel_um"][row] == pytest.approx([9.0])
        assert table["effective_radius_mm"][row] == pytest.approx([2.991])
        assert table["u_um"][row] == pytest.approx([0.05])


def test_the_largest_pretravel_grows_with_the_feed() -> None:
    """0.15 mm, and 0.03 s of travel: 600 mm/min are 10 mm/s."""
    assert plausibility.largest_plausible(None) == 0.15
    assert plausibility.largest_plausible(0.0) == 0.15
    assert plausibility.largest_plausible(600.0) == pytest.approx(0.45)


@dataclass(frozen=True, eq=False)
class _Part(MapBasis):
    """A part of an average, with a stated form on a control."""

    form: SeriesForm | SixSeatForm | None
    kind: ClassVar[str] = "part"

    @property
    def size(self) -> int:
        return 2

    @property
    def constant(self) -> FloatArray:
        return np.array([1.0, 0.0])

    def design(self, directions: FloatArray) -> FloatArray:
        return np.stack([np.ones(len(directions)), directions[:, 1] ** 2], axis=1)

    def displacement(
        self, directions: FloatArray, curvatures: FloatArray | None
    ) -> FloatArray | None:
        del curvatures
        return (0.5 if isinstance(self.form, SeriesForm) else 0.25) * directions

    def form_on_control(self, coefficients: FloatArray) -> SeriesForm | SixSeatForm | None:
        if isinstance(self.form, SixSeatForm):
            return replace(self.form, scale=float(coefficients[0]))
        return self.form and SeriesForm(self.form.terms, coefficients)

    def arrays(self) -> dict[str, StoredArray]:
        return {"own": StoredArray(("row",), np.array([1.0, 2.0]), "mm")}

    def attributes(self) -> dict[str, str | float]:
        return {"word": "w"}

    @classmethod
    def restored(cls, stored: StoredBasis) -> Self:
        del stored
        return cls(None)


PROBE = cast("CondensedProbe", object())
TERMS = np.array([[2, 0], [3, 3]])


class TestAverages:
    def test_mean_and_mixture_by_hand(self) -> None:
        """Three maps about centres and with tips of their own, in a turned frame: about the first
        centre each is n·s more, and the difference of the radii."""
        centers = [np.array([1.0, 2.0, 3.0]) + 1e-3 * np.array(s) for s in
                   ([0.0, 0.0, 0.0], [2.0, -1.0, 0.5], [-1.0, 3.0, 2.0])]  # fmt: skip
        half = 1e-3 * np.array([[1.0, 0.5], [-0.3, 2.0]])
        maps = [
            _map(MeanBasis(), rotation=TURN, covariance=Covariance.independent([4e-6])),
            _map(HarmonicBasis(TERMS), rotation=TURN, tip_radius=3.02,
                 covariance=Covariance.full(half @ half.T)),
            _map(WozniakBasis(0.2), rotation=TURN, tip_radius=2.95),
        ]  # fmt: skip
        weights = [0.5, 0.3, 0.2]
        basis, coefficients, covariance = averaged_map(maps, centers, weights)
        n = fibonacci_cap(30, 1.5)
        own = np.stack(
            [
                each.basis.design(n) @ each.coefficients
                + n @ (TURN.T @ (centers[0] - center)) + 3.0 - each.tip_radius
                for each, center in zip(maps, centers, strict=True)
            ]
        )  # fmt: skip
        mean = np.array(weights) @ own
        assert basis.design(n) @ coefficients == pytest.approx(mean, abs=1e-12)
        assert basis.value(n, coefficients) == pytest.approx(mean, abs=1e-12)
        within = 0.5 * 4e-6 + 0.3 * np.sum((maps[1].basis.design(n) @ half) ** 2, axis=1)
        between = np.array(weights) @ (own - mean) ** 2
        assert covariance.variance_of(basis.design(n)) == pytest.approx(within + between, rel=1e-9)
        constant = basis.constant
        assert basis.design(n) @ constant == pytest.approx(np.ones(30))
        assert basis.size == 4 + 1 + 2 + 3

    @pytest.mark.parametrize("which", [0, 1, 2])
    def test_frames_must_be_the_same(self, which: int) -> None:
        maps = [_map(MeanBasis(), rotation=TURN if k == which else np.eye(3)) for k in range(3)]
        with pytest.raises(PretravelError, match="maps of different frames"):
            averaged_map(maps, [np.zeros(3)] * 3, [0.5, 0.25, 0.25])

    def test_the_form_on_a_control_contains_all_series(self) -> None:
        """Of a probe that has a series of its own already; a constant and a shift are added."""
        own = SeriesForm(np.array([[4, 1]]), np.array([0.7]))
        seats = SixSeatForm(PROBE, 1.0, 0.5, np.array([1.0, 2.0, 3.0]), own)
        basis = AveragedBasis((_Part(SeriesForm(TERMS, np.zeros(2))), _Part(seats)))
        form = basis.form_on_control(np.arange(1.0, 9.0))
        assert form is not None
        assert form.probe is PROBE
        assert (form.scale, form.constant) == (7.0, 1.5)
        assert form.shift.tolist() == [3.0, 5.0, 7.0]
        assert form.correction is not None
        assert form.correction.terms.tolist() == [[2, 0], [3, 3], [4, 1]]
        assert form.correction.coefficients.tolist() == [5.0, 6.0, 0.7]
        n = fibonacci_cap(5, 1.0)
        moved = basis.displacement(n, None)
        assert moved == pytest.approx(0.5 * n)

    def test_no_form_where_a_part_has_none_or_two_are_probes(self) -> None:
        seats = SixSeatForm(PROBE, 1.0, 0.5, np.zeros(3))
        series = SeriesForm(TERMS, np.zeros(2))
        for forms in ((seats, None), (None, seats), (seats, seats), (series, series)):
            basis = AveragedBasis(tuple(_Part(form) for form in forms))
            assert basis.form_on_control(np.zeros(8)) is None

    def test_what_a_file_keeps_of_the_parts(self) -> None:
        basis = AveragedBasis((MeanBasis(), _Part(None), WozniakBasis(0.2)))
        arrays, attributes = basis.arrays(), basis.attributes()
        assert set(arrays) == {"part_1_own"}
        assert arrays["part_1_own"].axes == ("part_1_row",)
        assert arrays["part_1_own"].unit == "mm"
        assert attributes == {
            "parts": "mean,part,wozniak", "part_1_word": "w",
            "part_2_lobe_azimuth_rad": 0.2, "part_2_transducer": "contact",
        }  # fmt: skip
        parts = stored_parts(StoredBasis(HALF, 3.0, arrays, attributes))
        assert [kind for kind, _ in parts] == ["mean", "part", "wozniak"]
        assert [dict(part.attributes) for _, part in parts] == [
            {}, {"word": "w"}, {"lobe_azimuth_rad": 0.2, "transducer": "contact"}
        ]  # fmt: skip
        assert [list(part.arrays) for _, part in parts] == [[], ["own"], []]
        assert all(part.support is HALF and part.tip_radius == 3.0 for _, part in parts)
        assert AveragedBasis.restored(parts[0][1]) is None


class TestSectorTables:
    """One, two, three and five waves around the equator, none symmetric; tilted in the machine."""

    COEFFICIENTS = np.array([10.0, 1.0, -0.4, 0.7, 0.3, -0.9, 0.5])
    TERMS = np.array([[0, 0], [1, 1], [1, -1], [2, 2], [2, -2], [3, 3], [5, -5]])
    MADE = _map(HarmonicBasis(TERMS), coefficients=COEFFICIENTS, tip_radius=30.0)

    ALL = MADE.pretravel(from_angles(np.full(720, 0.5 * np.pi), np.radians(np.arange(720) / 2.0)))

    def _at(self, degrees: float) -> float:
        return float(self.ALL[round(2.0 * degrees)])

    @staticmethod
    @cache
    def _names(degrees: float) -> list[str]:
        """The names nearest to an azimuth: one, or two halfway between them."""
        angles = {name: [float(name)] for name in SECTOR_NAMES[2:]}
        angles |= {"X": [0.0, 180.0], "Y": [90.0, 270.0]}
        off = {
            name: min(abs((degrees - a + 180.0) % 360.0 - 180.0) for a in own)
            for name, own in angles.items()
        }
        return [name for name in SECTOR_NAMES if off[name] == min(off.values())]

    def _residuals(self, pretravel: FloatArray) -> tuple[float, float]:
        largest, squares = 0.0, 0.0
        for degrees in np.arange(0.0, 360.0, 0.5):
            names = self._names(degrees)
            off = [pretravel[SECTOR_NAMES.index(name)] - self._at(degrees) for name in names]
            largest = max(largest, *(abs(each) for each in off))
            squares += sum(each**2 for each in off) / len(off)
        return largest, math.sqrt(squares / 720.0)

    def test_touched_at_their_angles(self) -> None:
        table = touched_sectors(self.MADE)
        expected = [0.5 * (self._at(0.0) + self._at(180.0)), 0.5 * (self._at(90) + self._at(270))]
        expected += [self._at(float(name)) for name in SECTOR_NAMES[2:]]
        assert table.pretravel == pytest.approx(expected, rel=1e-12)
        largest, rms = self._residuals(table.pretravel)
        assert (table.largest, table.rms) == (pytest.approx(largest), pytest.approx(rms))
        assert not table.pretravel.flags.writeable

    def test_taken_for_the_opposite_direction(self) -> None:
        table = touched_sectors(self.MADE)
        opposite = {name: f"{(int(name) + 180) % 360}" for name in SECTOR_NAMES[2:]}
        expected = [
            table.pretravel[SECTOR_NAMES.index(opposite.get(name, name))] for name in SECTOR_NAMES
        ]
        assert taken_opposite(table.pretravel) == pytest.approx(expected)
        misread = table.misread(self.MADE)
        assert misread.pretravel == pytest.approx(expected)
        largest, rms = self._residuals(np.array(expected))
        assert (misread.largest, misread.rms) == (pytest.approx(largest), pytest.approx(rms))

    @pytest.mark.parametrize("criterion", ["max", "rms"])
    def test_resampled(self, criterion: str) -> None:
        """The middle of the range, or the mean; halfway between two sectors a half counts."""
        own: dict[str, list[tuple[float, float]]] = {name: [] for name in SECTOR_NAMES}
        for degrees in np.arange(0.0, 360.0, 0.5):
            names = self._names(degrees)
            for name in names:
                own[name].append((1.0 / len(names), self._at(degrees)))
        expected = []
        for name in SECTOR_NAMES:
            share, value = np.array(own[name]).T
            middle = 0.5 * (value.min() + value.max())
            expected.append(middle if criterion == "max" else np.average(value, weights=share))
        table = resampled_sectors(self.MADE, criterion)
        assert table.pretravel == pytest.approx(expected, rel=1e-9)
        if criterion == "max":
            assert resampled_sectors(self.MADE).largest == table.largest

    def test_another_criterion_is_refused(self) -> None:
        with pytest.raises(PretravelError, match="'mean' is not known; there are max, rms"):
            resampled_sectors(self.MADE, "mean")

    def test_the_basis_keeps_no_numbers(self) -> None:
        assert SectorBasis.restored(StoredBasis(HALF, 3.0)) == SectorBasis()


class TestProvenance:
    def test_what_is_stated_comes_back(self) -> None:
        setup = QualificationSetup(
            25.0, 6.0, ring=True, u_diameter=3e-4, u_temperature=0.5, sphere_form=1e-4,
            axial_pretravel=None, axis=(0.0, 0.6, 0.8), search_outliers=False,
        )  # fmt: skip
        stated = Provenance(
            Origin.QUALIFIED, "a", "b", "c", "d", level_known=False, probe="e", setup=setup,
            kind_settings={"x": 1.0}, reading="f", touch_digests="g",
        )  # fmt: skip
        kept = stated.as_dict()
        assert kept == {
            "origin": "qualified", "source": "a", "touches": "b", "touches_file": "c",
            "reading": "f", "gauge": "d", "probe": "e", "touch_digests": "g",
            "level_known": False, "setup": asdict(setup), "kind_settings": {"x": 1.0},
        }  # fmt: skip
        assert Provenance.from_dict(kept) == stated
        assert Provenance.from_dict(kept | {"of a later version": 1}) == stated
        assert Provenance().as_dict() == {"origin": "made"}
        assert Provenance.from_dict({"origin": "made"}) == Provenance()
        with pytest.raises(KeyError):
            Provenance.from_dict({"source": "predicted"})

    def test_the_uncertainty_of_the_diameter_by_hand(self) -> None:
        """0.3 µm calibrated; 11.5e-6 of 50 mm for each of 2 K are 1.15 µm."""
        setup = QualificationSetup(50.0, u_diameter=3e-4, u_temperature=2.0)
        assert setup.u_reference_diameter == pytest.approx(math.hypot(3e-4, 1.15e-3))
        usual = QualificationSetup(50.0)
        by_hand = math.hypot(2e-4, 11.5e-6 * 50.0 * 0.2)
        assert usual.u_reference_diameter == pytest.approx(by_hand)
        assert QualificationSetup(50.0, u_diameter=0.0, u_temperature=0.0).u_reference_diameter == 0

    def test_what_is_usual(self) -> None:
        """U of 0.4 µm with k = 2; ISO 3290-1 grade 5; steel; a workshop near 20 °C."""
        setup = QualificationSetup(25.0)
        assert pytest.approx(0.4e-3 / 2.0) == USUAL_U_DIAMETER
        assert setup.sphere_form == USUAL_SPHERE_FORM == pytest.approx(0.13e-3)
        assert setup.u_temperature == USUAL_U_TEMPERATURE
        assert pytest.approx(11.5e-6) == STEEL_EXPANSION
        # The seats, the stylus and the tip of an OMP40-2 deflect by 1.2 µm along the axis.
        assert setup.axial_pretravel == AXIAL_PRETRAVEL
        assert pytest.approx(1.2e-3, rel=0.3) == AXIAL_PRETRAVEL
        assert (setup.tip_diameter, setup.u_diameter) == (None, None)
        assert (setup.ring, setup.search_outliers, setup.axis) == (False, True, (0.0, 0.0, 1.0))
        assert (setup.reference, replace(setup, ring=True).reference) == ("sphere", "ring")
        assert QualificationSetup(25.0, axis=np.array([0, 1, 0])).axis == (0.0, 1.0, 0.0)

    @pytest.mark.parametrize(
        "numbers",
        [
            {"diameter": 9e-4}, {"diameter": 1.1e4}, {"diameter": math.nan}, {"tip_diameter": 9e-4},
            {"tip_diameter": 1001.0}, {"u_diameter": -1e-9}, {"u_diameter": 1001.0},
            {"u_temperature": -1e-9}, {"u_temperature": 1001.0}, {"sphere_form": -1e-9},
            {"sphere_form": 1001.0}, {"axial_pretravel": 1001.0}, {"axial_pretravel": -1001.0},
        ],
    )  # fmt: skip
    def test_references_that_there_are_not(self, numbers: dict[str, float]) -> None:
        with pytest.raises(PretravelError):
            QualificationSetup(**{"diameter": 25.0, **numbers})
