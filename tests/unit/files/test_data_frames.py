"""Data frames go by the names and units of their columns, as files do."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pyarrow as pa
import pytest

from pretravel.base.errors import PretravelError
from pretravel.measurement.compensation import apply
from pretravel.touches import Touches, as_touches
from pretravel.uncertainty import fit_sphere
from tests.support.example_maps import mean_map

FRAME = pd.DataFrame(
    {"nz": [1, 1], "y_mm": [1.0, 2.0], "x_mm": [5.1, 6.0], "z_mm": [3.0, 3.25], "nx": 0, "ny": 0}
)
RIGHT = [[5.1, 1.0, 3.0], [6.0, 2.0, 3.25]]


@pytest.mark.parametrize("made", [lambda frame: frame, pa.Table.from_pandas])
def test_columns_go_by_name(made: object) -> None:
    assert as_touches(made(FRAME)).positions.tolist() == RIGHT  # type: ignore[operator]


def test_units_of_names_are_used() -> None:
    inches = FRAME.rename(columns={f"{axis}_mm": f"{axis.upper()} [in]" for axis in "xyz"})
    # A product of two doubles has an error of some units in the last place.
    assert as_touches(inches).positions == pytest.approx(25.4 * np.array(RIGHT), rel=1e-15)


def test_own_frames_are_taken_again() -> None:
    touches = Touches(
        RIGHT, [[0, 0, 1]] * 2, labels=("a", "b"), feeds=[50.0, 100.0], tips=("r", "s")
    )
    again = as_touches(touches.to_dataframe())
    assert again.positions.tolist() == RIGHT
    assert (again.labels, again.tips) == (("a", "b"), ("r", "s"))
    points = apply(as_touches(FRAME), mean_map(0.005))
    assert apply(FRAME, mean_map(0.005)).positions.tolist() == points.positions.tolist()


def test_features_in_a_frame_are_refused_as_in_a_file() -> None:
    with pytest.raises(PretravelError, match="list of features"):
        as_touches(FRAME.assign(diameter=[10.0, 10.1]))
    with pytest.raises(PretravelError, match="list of features"):
        as_touches(FRAME.assign(type=["CIRCLE", "POINT"]))


def test_frames_that_state_too_little_are_refused() -> None:
    with pytest.raises(PretravelError, match="columns of the data frame have no names"):
        as_touches(pd.DataFrame(np.eye(6)))
    with pytest.raises(PretravelError, match="does not give its unit"):
        as_touches(FRAME.rename(columns={f"{axis}_mm": axis for axis in "xyz"}))
    with pytest.raises(PretravelError, match="no rows"):
        as_touches(FRAME.iloc[:0])


def test_a_row_that_a_masked_array_hides_is_no_touch() -> None:
    hidden = np.ma.masked_array(np.ones((2, 6)), mask=[[False] * 6, [True] * 6])
    hidden[0, 3:] = [0, 0, 1]
    with pytest.raises(PretravelError, match="row 2 has length nan"):
        as_touches(hidden)
    ring = np.ma.masked_less([[1, 0], [0, 1], [-1, 0], [-9, -9]], -5)
    with pytest.raises(PretravelError, match="points of a circle must be finite"):
        fit_sphere(ring)
    with pytest.raises(PretravelError, match="expected touches"):
        as_touches(np.ones((2, 6)) * 1j)
