"""Series of touches of one point from the files of controls, firmware and people."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.errors import InputError
from pretravel.files.file_format import ReadingOptions
from pretravel.files.source_file import SourceFile
from pretravel.laboratory.repeat_log import read_repeats

HEIGHTS = (1.3200, 1.3175, 1.3250, 1.3200, 1.3025)


def _log(text: str, name: str = "a.log") -> SourceFile:
    return SourceFile(name, text.encode())


def _klipper(heights: tuple[float, ...], place: str = "97.000,2.000") -> str:
    touches = "".join(f"Recv: // probe at {place} is z={z:.6f}\n" for z in heights)
    return f"Recv: // PROBE_ACCURACY at X:97 Y:2 Z:3\n{touches}Recv: // probe accuracy results: m\n"


@pytest.mark.parametrize(
    ("text", "units"),
    [
        (_klipper(HEIGHTS), None),
        ("".join(f"Recv: {i + 1} of 5: z: {z:.4f} Mean: 1\n" for i, z in enumerate(HEIGHTS)), None),
        ("".join(f"Bed X: 5.0 Y: 6.0 Z: {z:.4f}\n" for z in HEIGHTS), None),
        ("".join(f"Stopped at height {z:.4f} mm\n" for z in HEIGHTS), None),
        ("G32 bed probe heights: " + " ".join(f"{z:.4f}" for z in HEIGHTS) + ", mean 1.3\n", None),
        ("$13=0\n" + "".join(f"[PRB:10.000,-5.000,{z:.4f}:1]\nok\n" for z in HEIGHTS), None),
        ("".join(f"[PRB:10.000,-5.000,{z:.4f}:1]\nok\n" for z in HEIGHTS), "mm"),
        ("G21\n" + "".join(f"G1 X1.0 Y2.0 Z{z:.4f}\n" for z in HEIGHTS), None),
        ("x_mm,y_mm,z_mm\n" + "".join(f"1,2,{z:.4f}\n" for z in HEIGHTS), None),
        ("X;Y;Z\n" + "".join(f"1;2;{z:.4f}\n" for z in HEIGHTS), "mm"),
        ("# heights\nz_mm\n" + "".join(f"{z:.4f}\n" for z in HEIGHTS), None),
        ("height [µm]\n" + "".join(f"{1000 * z:.1f}\n" for z in HEIGHTS), None),
        ("".join(f"{z / 25.4:.9f}\n" for z in HEIGHTS), "inch"),
    ],
)
def test_one_series_in_many_forms(text: str, units: str | None) -> None:
    found = read_repeats(_log(text), ReadingOptions(units=units))
    assert len(found.series) == 1
    # The inches have nine digits.
    assert found.series[0].values == pytest.approx(HEIGHTS, abs=1e-7)


def test_columns_of_one_column_of_heights() -> None:
    log = _log("".join(f"{z}\n" for z in HEIGHTS))
    assert read_repeats(log, ReadingOptions(units="mm"), axis="x").along == "x"
    with pytest.raises(InputError, match="names of columns are not used"):
        read_repeats(log, ReadingOptions(units="mm", columns={"z": "Z"}))


def test_a_series_is_chosen_by_the_name_that_labels_give_it() -> None:
    rows = [f"1,2,{z:.4f},A/{n}\n" for n, z in enumerate(HEIGHTS)]
    rows += [f"1,2,{z + 1.0:.4f},B/{n}\n" for n, z in enumerate(HEIGHTS)]
    log = _log("x_mm,y_mm,z_mm,label\n" + "".join(rows), "a.csv")
    one = read_repeats(log, ReadingOptions(series=("B",)))
    assert [series.name for series in one.series] == ["B"]
    assert one.series[0].values == pytest.approx(np.add(HEIGHTS, 1.0))
    with pytest.raises(InputError, match=r"a\.csv: no series is 'C'; there are: A, B"):
        read_repeats(log, ReadingOptions(series=("C",)))
    heights = _log("z_mm\n" + "".join(f"{z:.4f}\n" for z in HEIGHTS))
    with pytest.raises(InputError, match="no series is 'A'; there are: one, without a name"):
        read_repeats(heights, ReadingOptions(series=("A",)))


def test_each_order_is_a_series_of_its_own() -> None:
    """The first touch of each can be apart; a place touched less often is counted."""
    text = _klipper(HEIGHTS) + _klipper(HEIGHTS[::-1]) + _klipper(HEIGHTS[:2], "5.000,5.000")
    found = read_repeats(_log(text))
    assert [one.name for one in found.series] == ["accuracy 1", "accuracy 2"]
    assert found.series[1].values == pytest.approx(HEIGHTS[::-1])
    assert found.series[1].lines[0] == 9
    assert found.single == 2
    one = "".join(f"// probe at 97.000,2.000 is z={z}\n" for z in HEIGHTS)
    homed = read_repeats(_log("G28\n" + one + "G28\n" + one + "Z_TILT_ADJUST\n" + one))
    assert [each.name for each in homed.series] == [
        f"probe {name}" for name in ("G28", "G28 (2)", "Z_TILT_ADJUST")
    ]


def test_points_that_are_touched_in_turn() -> None:
    rows = "".join(f"{x},0,{z + x}\n" for z in HEIGHTS for x in (0, 30))
    found = read_repeats(_log("x_mm,y_mm,z_mm\n" + rows, "a.csv"))
    assert [one.name for one in found.series] == ["place 1 (0, 0, 1.32)", "place 2 (30, 0, 31.32)"]
    assert found.series[1].values == pytest.approx(np.add(HEIGHTS, 30.0))


def test_the_touch_before_m48_counts_is_the_first() -> None:
    text = "M48 Z-Probe Repeatability Test\nBed X: 5 Y: 6 Z: 1.4\n" + "".join(
        f"{i + 1} of 5: z: {z}\n" for i, z in enumerate(HEIGHTS)
    )
    assert read_repeats(_log(text)).series[0].values == pytest.approx([1.4, *HEIGHTS])
    twice = "M48 Z-Probe Repeatability Test\n" + "".join(
        f"Bed X: 5 Y: 6 Z: {z}\n{i + 1} of 5: z: {z}\n" for i, z in enumerate(HEIGHTS)
    )
    assert read_repeats(_log(twice)).series[0].values == pytest.approx(HEIGHTS)


@pytest.mark.parametrize(
    ("touch", "failed"),
    [
        ("probe at 1.0,2.0 is z={}\n", "!! No trigger on probe after full movement\n"),
        ("Bed X: 1.0 Y: 2.0 Z: {}\n", "Error:Probing failed\n"),
        (
            "Stopped at height {} mm\n",
            "Error: G30: Z probe was not triggered during probing move\n",
        ),
    ],
)
def test_a_touch_that_the_firmware_says_failed_is_named(touch: str, failed: str) -> None:
    text = "".join(touch.format(z) for z in HEIGHTS) + failed
    found = read_repeats(_log(text))
    assert found.warnings == (
        "1 touch failed, as the firmware says (line 6): no height is read of them",
    )


def test_a_side_that_is_touched_along_x() -> None:
    text = "$13=0\n" + "".join(f"[PRB:{z:.4f},-5.000,2.000:1]\n" for z in HEIGHTS)
    found = read_repeats(_log(text))
    assert found.along == "the axis x"
    assert found.series[0].values == pytest.approx(HEIGHTS)


def test_a_touch_without_contact_is_left_out_and_said() -> None:
    text = "$13=0\n" + "".join(f"[PRB:1.000,-5.000,{z:.4f}:1]\n" for z in HEIGHTS)
    found = read_repeats(_log(text + "[PRB:1.000,-5.000,-9.000:0]\n"))
    assert found.series[0].values == pytest.approx(HEIGHTS)
    assert found.warnings == ("1 touch missed: 6",)


def test_probeopen_leaves_equal_touches_out() -> None:
    rows = "".join(f"0.0 0.0 {z:.6f} " + "0.000000 " * 5 + "0.000000\n" for z in HEIGHTS)
    found = read_repeats(_log(rows), ReadingOptions(units="mm"))
    assert "PROBEOPEN does not write" in found.warnings[0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("".join(f"probe at {x}.0,1.0 is z=0.1\n" for x in range(9)), "mesh of heights"),
        (_klipper(HEIGHTS[:4]), "5 times or more"),
        ("M48 Z-Probe Repeatability Test\nMean: 1 Min: 1\nStandard Deviation: 0.1\n", "M48 P20 V4"),
        ("probe at 1.0,2.0 is z=\n", "line 1: the line is cut off"),
        ("1.32\n1.31\n", "have no unit"),
        ("x,y,z\n" + "1,2,3\n" * 6, "has no unit"),
        ("G32 bed probe heights: 0.1 not set, mean 1\n", "'not' is not a finite number"),
        ("Mesh Leveling Probed Z positions:\n0.01 0.02\n", "mesh of heights"),
        (
            "$13=0\n" + "".join(f"[PRB:{z:.4f},1.000,{z:.4f}:1]\n" for z in HEIGHTS),
            "differ along [xz] and [xz]",
        ),
    ],
)
def test_what_is_no_series_is_refused(text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read_repeats(_log(text))


@pytest.mark.parametrize(
    ("title", "first", "second", "names"),
    [
        ("feed_mm_min", "50", "500", ["50 mm/min", "500 mm/min"]),
        ("feed_mm_min", "50", "50.1", [""]),
        ("spindle_deg", "0", "180", ["spindle 0°", "spindle 180°"]),
        ("tip", "T1", "T2", ["T1", "T2"]),
    ],
)
@pytest.mark.parametrize("places", ["x_mm,y_mm,z_mm", "trial,Z [mm]"])
def test_touches_at_two_feeds_or_orientations_are_two_series(
    places: str, title: str, first: str, second: str, names: list[str]
) -> None:
    """Their difference is no jump of one series: it is feed × delay, or the run-out."""
    both = [(z, word) for word in (first, second) for z in HEIGHTS]
    rows = [
        f"{n},{z:.4f},{word}\n" if "trial" in places else f"1,2,{z:.4f},{word}\n"
        for n, (z, word) in enumerate(both)
    ]
    found = read_repeats(_log(f"{places},{title}\n" + "".join(rows), "a.csv"))
    shown = [one.name.partition("place")[0].strip() for one in found.series]
    assert shown == names


def test_a_comment_that_changes_heights_is_refused() -> None:
    lines = "z_mm\n" + "".join(f"{z:.4f}\n" for z in HEIGHTS) + "# {}\n1.32\n"
    with pytest.raises(InputError, match=r"line 7: .*may change the meaning"):
        read_repeats(_log(lines.format("units: inch")))
    (told,) = read_repeats(_log(lines.format("after lunch"))).warnings
    assert "line 7 '# after lunch'" in told


def test_an_axis_that_the_file_contradicts_is_refused() -> None:
    """It was ignored, and the heights were evaluated along z."""
    heights = "".join(f"Recv: // probe at 100.000,100.000 is z={z:.6f}\n" for z in HEIGHTS)
    log = _log(f"Recv: // PROBE_ACCURACY at X:100.000 Y:100.000 Z:5.000 (samples=5)\n{heights}")
    assert read_repeats(log, axis="z").series[0].values == pytest.approx(HEIGHTS)
    with pytest.raises(InputError, match="not along x: leave the axis out"):
        read_repeats(log, axis="x")
    table = "x_mm,y_mm,z_mm\n" + "".join(f"{x:.6f},5,0\n" for x in HEIGHTS)
    with pytest.raises(InputError, match="differ along x, and not along z: leave the axis out"):
        read_repeats(_log(table), axis="z")  # it said that the noise is zero


def test_a_table_of_repeat_is_no_log() -> None:
    """Its levels and residuals were further series of heights."""
    rows = "".join(f"1,{k},{k},{z:.4f},1,1.32,0.1\n" for k, z in enumerate(HEIGHTS))
    with pytest.raises(InputError, match="not their log"):
        read_repeats(_log(f"series,touch,line,position_mm,usual,level_mm,left_um\n{rows}"))
