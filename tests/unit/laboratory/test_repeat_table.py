"""Series of repeats in tables that people type: trials, operators, places, misses, results."""

from __future__ import annotations

from unittest.mock import ANY

import numpy as np
import pytest

from pretravel.base import InputError
from pretravel.files import ReadingOptions, SourceFile
from pretravel.laboratory.repeat_log import RepeatLog, read_repeats

_Z = (27.3036, 27.3056, 27.3042, 27.3042, 27.3036, 27.3056)


def _read(text: str, units: str | None = None) -> RepeatLog:
    return read_repeats(SourceFile("a.csv", text.encode()), ReadingOptions(units=units))


def _rows(form: str) -> str:
    return "".join(form.format(i=i, z=z, d=z - _Z[0]) + "\n" for i, z in enumerate(_Z, 1))


@pytest.mark.parametrize(
    "text",
    [
        "Nr.\tMessung [mm]\tDelta\n" + _rows("{i}\t{z}\t{d:.4f}"),
        "Time,Z mm\n" + _rows("12:00:0{i},{z}"),
        "Trial,Z-axis,Delta\n" + _rows("{i},{z} mm,{d:.4f} mm"),
        "Trial,Z mm\n" + _rows("{i},{z}") + "Mean,27.3045\nRange,0.0020\n",
        _rows("Z = {z} mm"),
        "Z mm\n" + _rows("{z}").replace(".", ","),
        "Trial,Z mm\n" + _rows("{i},{z}") + "7,miss\n",
        "Trial,Z mm\n" + _rows("{i},{z}") + "7,999.999\n",
        "Z mm\n" + _rows("{z}") + "0\n",
        _rows("Probe {i}: {z} mm"),
        "Test of today\n" + _rows("test # {i} : {z} mm") + "Max deviation = 0.002\n",
        _rows("{i}) {z} mm"),
        "Trial,Z mm,Status\n" + _rows("{i},{z},ok") + "7,9.0,miss\n",
        "Trial,Z mm,Hit\n" + _rows("{i},{z},1") + "7,9.0,0\n",
        "Trial,Z,Unit\n" + _rows("{i},{z},mm"),
        "Trial  Z-axis mm  Delta mm\n" + _rows("{i}  {z}  {d:.4f}"),
        "Run,M1 mm,M2 mm,M3 mm,M4 mm,M5 mm,M6 mm\n1," + ",".join(map(str, _Z)) + "\n",
        _rows("Z:{z:.4f} C:123"),
        _rows("// Result: at 1.000,2.000 estimate contact at z={z:.6f}"),
    ],
)
def test_one_series_of_heights(text: str) -> None:
    found = _read(text)
    assert len(found.series) == 1
    assert np.allclose(found.series[0].values, _Z, rtol=0.0, atol=1e-12)


def test_counted_lines_with_feeds_are_series() -> None:
    lines = _rows("Touch #{i} Z={z} F300").replace("#2", "#2 ").splitlines()
    lines[1::2] = [line.replace("F300", "F30") for line in lines[1::2]]
    with_more = lines + [line.replace(f"#{i}", f"#{i + 6}") for i, line in enumerate(lines, 1)]
    found = _read("\n".join(with_more), "mm")
    assert [one.name for one in found.series] == ["F300", "F30"]
    assert found.series[0].values.tolist() == [*_Z[::2], *_Z[::2]]


@pytest.mark.parametrize("header", ["#,Z1 mm,Z2 mm", "Run,Z1 mm,Z2 mm", "#;Z1 mm;Z2 mm"])
def test_numbered_columns_are_series(header: str) -> None:
    separator = header[3] if header[3] in ",;" else header[1]
    found = _read(header + "\n" + _rows(separator.join(["{i}", "{z}", "{z}"])))
    assert [one.name for one in found.series] == ["Z1 mm", "Z2 mm"]


def test_a_coordinate_of_two_places_distinguishes_series() -> None:
    rows = _rows("10,{z}") + _rows("50,{z}")
    found = _read("X,Z\n" + rows, "mm")
    assert [one.name for one in found.series] == ["X 10", "X 50"]
    assert found.series[1].values.tolist() == [*_Z]
    found = _read("X,Y,Z fast,Z slow\n" + _rows("1,2,{z},{z}"), "mm")
    assert [one.name for one in found.series] == ["Z fast", "Z slow"]


@pytest.mark.parametrize("title", ["D mm", "Ø [mm]", "Bore diameter mm"])
def test_sizes_are_named_as_results(title: str) -> None:
    assert "not that of one touch" in " ".join(_read(f"{title}\n" + _rows("{z}")).warnings)
    assert "not that of one touch" in " ".join(
        _read(f"Nr,{title},Operator\n" + _rows("{i},{z},A")).warnings
    )


def test_a_comma_with_two_meanings_is_asked_for() -> None:
    with pytest.raises(InputError, match="line 1: '27,304' can be a number with three decimals"):
        _read("".join(f"{z:.3f}\n".replace(".", ",") for z in _Z), "mm")


def test_columns_that_are_not_read_are_named_for_coordinates_too() -> None:
    told = _read("Angle,X,Y,Z\n" + _rows("{i},1,2,{z}"), "mm").warnings
    assert "columns that are not read: Angle" in told
    found = _read("n;z;T [C];RH\n" + _rows("{i};{z};2{i}.1;45"), "mm")
    assert len(found.series) == 1
    assert any("T [C]" in said and "RH" in said for said in found.warnings)


def test_what_is_not_read_is_named() -> None:
    told = " ".join(_read("Trial,Z mm,Delta mm\n" + _rows("{i},{z},{d}") + "7,---,\n").warnings)
    assert "not read: Delta mm" in told
    assert "left out: line 8" in told


@pytest.mark.parametrize(
    ("title", "words"),
    [
        ("Operator", ("A", "B")),
        ("Direction", ("+Z", "-Z")),
        ("place", ("10", "50")),
        ("Axis", ("X", "Y")),
    ],
)
def test_rows_that_a_column_tells_apart_are_two_series(title: str, words: tuple[str, str]) -> None:
    text = f"{title},Reading mm\n" + "".join(
        f"{word},{z + step:.4f}\n" for word, step in zip(words, (0.0, 4.0), strict=True) for z in _Z
    )
    found = _read(text)
    assert [one.name.split()[-1] for one in found.series] == list(words)
    assert [one.values[0] for one in found.series] == [27.3036, 31.3036]


@pytest.mark.parametrize(("title", "words"), [("pass", "12"), ("tip", "01"), ("feed", "48")])
def test_rows_that_a_number_tells_apart_in_turn_are_two_series(title: str, words: str) -> None:
    rows = "".join(f"{z},{words[0]}\n{z + 0.04:.4f},{words[1]}\n" for z in _Z)
    found = _read(f"Z mm,{title}\n" + rows)
    assert [one.name for one in found.series] == [f"{title} {word}" for word in words]
    assert found.series[0].values.tolist() == [*_Z]


@pytest.mark.parametrize(
    "text",
    [
        "Z [in]\n" + _rows("{z}"),
        "Trial,Z,Unit\n" + _rows("{i},{z},inch"),
        "# units: inch\n" + _rows("{z}"),
        "Z\n" + _rows("{z}") + "# units: inch\n",
    ],
)
def test_another_unit_than_the_given_one_is_refused(text: str) -> None:
    assert _read(text).series[0].values[0] == pytest.approx(25.4 * _Z[0], rel=1e-12)
    with pytest.raises(InputError, match="the file is in inch, but mm was given"):
        _read(text, "mm")


def test_the_unit_of_a_title_in_words() -> None:
    assert _read("Messwert in mm\n" + _rows("{z}")).series[0].values.tolist() == [*_Z]
    with pytest.raises(InputError, match=r"more than one unit \(inch, mm\)"):
        _read("# units: inch\nZ mm\n" + _rows("{z}"))


@pytest.mark.parametrize("form", ["{z}", "{i},{z},ok"])
def test_what_notes_above_and_below_the_readings_state_is_named(form: str) -> None:
    title = "Z mm\n" if form == "{z}" else "Trial,Z mm,Note\n"
    told = _read("# feed 300\n" + title + _rows(form) + "# temperature rose to 25 °C\n").warnings
    assert any("feed 300" in said and "rose to 25" in said for said in told)


def test_a_note_that_changes_the_readings_after_it_is_refused() -> None:
    with pytest.raises(InputError, match="line 8: Comment is 'new stylus'"):
        _read("Trial,Z mm,Comment\n" + _rows("{i},{z},") + "7,27.3,new stylus\n")


@pytest.mark.parametrize("form", ["{name}/{i},{z}", "{name}/{i},0,0,{z}"])
def test_labels_name_their_series(form: str) -> None:
    """In a column of heights as in positions; a name alone is not a column that is not read."""
    header = "label,z_mm\n" if form.count(",") == 1 else "label,x_mm,y_mm,z_mm\n"
    for names in (("A", "B"), ("A",)):
        found = _read(header + "".join(_rows(form.replace("{name}", name)) for name in names))
        assert [one.name for one in found.series] == [n if len(names) > 1 else ANY for n in names]
        assert not [warning for warning in found.warnings if "label" in warning]


def test_two_columns_of_readings_are_two_series() -> None:
    found = _read(
        "Trial,X mm,Z mm\n" + "".join(f"{i},{z - 20:.4f},{z}\n" for i, z in enumerate(_Z))
    )
    assert [one.name for one in found.series] == ["X mm", "Z mm"]


def test_fast_and_slow_touches_in_turn_are_all_kept_and_named() -> None:
    fast_and_slow = "".join(f"{z:.4f}\n{z + 0.04:.4f}\n" for z in _Z)
    found = _read("z_mm\n" + fast_and_slow)
    assert len(found.series[0].values) == 12
    assert any("of every 2 touches number 1 lies 40.0 µm" in said for said in found.warnings)


def test_two_levels_out_of_rhythm_are_named_and_two_steps_of_a_scale_are_not() -> None:
    """A miss among fast and slow touches breaks their rhythm."""
    both = [z + step for z in (*_Z, *_Z) for step in (0.0, 0.04)]
    del both[3], both[6], both[12]
    told = _read("z_mm\n" + "".join(f"{z:.4f}\n" for z in both)).warnings
    assert any("touches lie at two levels, 38.0 µm apart, in turn" in said for said in told)
    steps = "".join(f"{1.0 + 0.001 * (k in (2, 3, 7, 8)):.3f}\n" for k in range(11))
    assert not any("two levels" in said for said in _read("z_mm\n" + steps).warnings)
