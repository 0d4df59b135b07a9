"""Trip maps: trip and un-trip around a ring, from our own simulation."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.controls.logs.trip_map import TRIP_MAP, read_trip_map
from pretravel.files.file_format import ReadingOptions
from pretravel.files.source_file import SourceFile
from pretravel.qualification.qualifying import qualify
from tests.support.control_logs import TRIP_MAP_FILE, TRIP_MAP_OPTIONS

ANGLE = np.arange(0.0, 360.0, 15.0)
TRAVEL = 0.040 + 0.008 * np.cos(np.radians(3.0 * ANGLE - 45.0))
BACK = 0.020 - 0.003 * np.cos(np.radians(3.0 * ANGLE - 45.0))
FREE = 25.0 - 3.0
OPTIONS = ReadingOptions(ring=True, reference_diameter=50.0, tip_radius=3.0)


def _table(head: str, *columns: np.ndarray, separator: str = ",") -> SourceFile:
    rows = [separator.join(f"{cell:.6f}" for cell in row) for row in zip(*columns, strict=True)]
    text = "\n".join(["Touch probe KP", "a note, with a comma", head, *rows]) + "\n"
    if separator == ";":
        text = text.replace(".", ",")
    return SourceFile("trip.csv", text.encode())


def _around(length: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return length * np.cos(np.radians(ANGLE)), length * np.sin(np.radians(ANGLE))


@pytest.mark.parametrize(
    "file",
    [
        _table("Angle,Trip [mm],Un-Trip [mm]", ANGLE, TRAVEL, BACK),
        _table("azimuth_deg;trip_um;untrip_um", ANGLE, 1e3 * TRAVEL, 1e3 * BACK, separator=";"),
        _table("Degree,Trip (in),Untrip (in)", ANGLE, (FREE + TRAVEL) / 25.4, (FREE + BACK) / 25.4),
        _table(
            "Angle,Trip X mm,Trip Y mm,UnTrip X mm,UnTrip Y mm",
            ANGLE, *_around(FREE + TRAVEL), *_around(FREE + BACK),
        ),
    ],
)  # fmt: skip
def test_forms(file: SourceFile) -> None:
    """Lengths beyond the wall, distances from the middle, positions: one map."""
    found = read_trip_map(file)
    assert np.allclose(found.hysteresis, TRAVEL - BACK, atol=4e-5)
    assert TRIP_MAP.recognises is not None
    assert TRIP_MAP.recognises(file.lines("a table"))
    assert TRIP_MAP.parse is not None
    touches = TRIP_MAP.parse(file, OPTIONS).touches
    assert np.allclose(np.linalg.norm(touches.positions, axis=1), FREE + TRAVEL, atol=4e-5)
    made = qualify(touches, 50.0, tip_diameter=6.0, ring=True, kind="harmonic")
    lowest, highest = made.pretravel_map.pretravel(touches.normals)[[16, 8]] * 1e3
    assert np.ptp(made.observed) * 1e3 == pytest.approx(16.0, abs=0.2)
    assert 31.0 < min(lowest, highest) <= max(lowest, highest) < 49.0


def test_what_the_way_back_says() -> None:
    """Lobes of 8 + 3 µm in phase with those of the trip, 8 µm; the mean is 20 µm."""
    text = read_trip_map(_table("angle,trip mm,untrip mm", ANGLE, TRAVEL, BACK)).sentence
    assert "9.0 to 31.0 µm, mean 20.0 µm" in text
    assert "three lobes of 11.0 µm are 0° from those of the trip (8.0 µm)" in text
    assert not read_trip_map(_table("angle,trip mm", ANGLE, TRAVEL)).sentence


@pytest.mark.parametrize(
    ("file", "options", "reason"),
    [
        (_table("angle,trip,untrip", ANGLE, TRAVEL, BACK), OPTIONS, "line 3: the column trip does"),
        (_table("angle,trip mm", ANGLE, TRAVEL), ReadingOptions(), "diameters of ring and tip"),
        (_table("angle,trip mm", ANGLE, FREE + 9.0 + TRAVEL), OPTIONS, "line 5: the trip is 31.0"),
        (SourceFile("a.csv", b"angle,trip_mm\n0,x\n"), OPTIONS, "line 2"),
        (SourceFile("a.csv", b"angle,trip_mm\n0\n"), OPTIONS, "line 2: 1 cells"),
        (SourceFile("a.csv", b"angle,trip_mm\n"), OPTIONS, "has no rows"),
    ],
)
def test_refused(file: SourceFile, options: ReadingOptions, reason: str) -> None:
    assert TRIP_MAP.parse is not None
    with pytest.raises(PretravelError) as caught:
        TRIP_MAP.parse(file, options)
    assert reason in str(caught.value)


def test_other_tables_are_none() -> None:
    for text in ("label,x_mm,y_mm,z_mm\n", "azimuth_deg,pretravel_um\n0,46\n", "trip,x,y,z\n"):
        assert TRIP_MAP.recognises is not None
        assert not TRIP_MAP.recognises(text.splitlines())


def test_the_sample() -> None:
    file = SourceFile("a.csv", TRIP_MAP_FILE.encode())
    assert TRIP_MAP.parse is not None
    assert len(TRIP_MAP.parse(file, TRIP_MAP_OPTIONS).touches) == 6


def test_positions_count_from_any_origin() -> None:
    """Of the machine; it was refused, and unit and diameters were called wrong."""
    x, y = _around(FREE + TRAVEL)
    file = _table("Angle,Trip X mm,Trip Y mm", ANGLE, x + 100.0, y + 200.0)
    assert TRIP_MAP.parse is not None
    touches = TRIP_MAP.parse(file, OPTIONS).touches
    assert touches.positions[:, :2] == pytest.approx(np.stack([x + 100.0, y + 200.0], axis=1))


def test_what_the_table_states_in_addition_is_named() -> None:
    table = _table("Angle,Trip [mm],Feed", ANGLE, TRAVEL, ANGLE)
    text = table.content.replace(b"a note, with a comma", b"tip diameter 4 mm, temperature 27")
    assert TRIP_MAP.parse is not None
    told = " ".join(TRIP_MAP.parse(SourceFile("trip.csv", text), OPTIONS).warnings)
    assert "not read: line 2 'tip diameter 4 mm, temperature 27'" in told
    assert "columns that are not read: Feed" in told
    plain = _table("Angle,Trip [mm]", ANGLE, TRAVEL)
    assert TRIP_MAP.parse(plain, OPTIONS).warnings == ()
