"""Averages of maps: mean and mixture by hand, their form on a control, what a file keeps."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar, Self, cast

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import fibonacci_cap, sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.base.frames import probe_rotation
from pretravel.maps.basis import (
    CondensedProbe,
    MapBasis,
    SeriesForm,
    SixSeatForm,
    StoredArray,
    StoredBasis,
)
from pretravel.maps.kinds.averaged import AveragedBasis, averaged_map, stored_parts
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.maps.kinds.mean import MeanBasis
from pretravel.maps.kinds.wozniak import WozniakBasis
from pretravel.maps.support import DirectionSupport
from pretravel.uncertainty.covariance import Covariance
from tests.support.example_maps import made_up_map

HALF = DirectionSupport(sphere_pattern_25())
TURN = probe_rotation((0.6, 0.0, 0.8), 0.3)
_map = partial(made_up_map, support=HALF)


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


def test_mean_and_mixture_by_hand() -> None:
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
def test_frames_must_be_the_same(which: int) -> None:
    maps = [_map(MeanBasis(), rotation=TURN if k == which else np.eye(3)) for k in range(3)]
    with pytest.raises(PretravelError, match="maps of different frames"):
        averaged_map(maps, [np.zeros(3)] * 3, [0.5, 0.25, 0.25])


def test_the_form_on_a_control_contains_all_series() -> None:
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


def test_no_form_where_a_part_has_none_or_two_are_probes() -> None:
    seats = SixSeatForm(PROBE, 1.0, 0.5, np.zeros(3))
    series = SeriesForm(TERMS, np.zeros(2))
    for forms in ((seats, None), (None, seats), (seats, seats), (series, series)):
        basis = AveragedBasis(tuple(_Part(form) for form in forms))
        assert basis.form_on_control(np.zeros(8)) is None


def test_what_a_file_keeps_of_the_parts() -> None:
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
