"""TOML files: every error has the file, the line and the key."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from pretravel.base.errors import DescriptionError, InputError, PretravelError
from pretravel.base.toml_file import TomlStructure, parse_toml, read_toml

TEXT = '''\
name = "mill"

[probe]
tool = 7
tip_diameter_mm = 6            # an integer is a length too
angles_deg = [
    0.0,
    180.0,
]
note = """
[probe]
tool = 8
"""

[[stylus]]
length_mm = 12.0

[[stylus]]
length_mm = 38.0

[limits.x]
low = 1.0
'''


@dataclass(frozen=True)
class Segment:
    length: float

    def __post_init__(self) -> None:
        if self.length <= 0.0:
            raise DescriptionError(f"the length is {self.length:g} mm; it must be positive")


@dataclass(frozen=True)
class Gauge:
    tool: int
    tip_diameter: float
    angles: tuple[float, float]
    note: str = ""


@dataclass(frozen=True)
class Limit:
    low: float


@dataclass(frozen=True)
class Settings:
    probe: Gauge
    stylus: tuple[Segment, ...]
    name: str = ""
    limits: Mapping[str, Limit] = field(default_factory=dict)


def structure() -> TomlStructure:
    made = TomlStructure(hint="see the example")
    made.table(Gauge, tip_diameter="tip_diameter_mm", angles="angles_deg")
    made.table(Segment, length="length_mm")
    return made


def test_a_whole_file() -> None:
    settings = structure().make(parse_toml(TEXT), Settings)
    assert settings.probe.tool == 7
    assert isinstance(settings.probe.tip_diameter, float)
    assert settings.probe.angles == pytest.approx((0.0, 3.141592653589793))
    assert [segment.length for segment in settings.stylus] == [12.0, 38.0]
    assert settings.limits == {"x": Limit(1.0)}


def test_lines_of_tables_and_keys() -> None:
    document = parse_toml(TEXT)
    assert document.line("name") == 1
    assert document.line("probe") == 3
    assert document.line("probe", "tool") == 4
    assert document.line("probe", "angles_deg", 1) == 6
    assert document.line("stylus", 1, "length_mm") == 19
    assert document.line("limits", "x", "low") == 22
    assert document.line("none") is None


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("tool = 7", "tol = 7", r"line 4: \[probe\] has no tol; it has tool, .*mean tool\?"),
        ("tool = 7", "", r"line 3: \[probe\] needs tool; it has tool, .*; see the example"),
        ("tool = 7", "tool = 7.5", r"line 4: \[probe\] tool must be an integer, got 7.5"),
        ("tool = 7", "tool = true", r"line 4: \[probe\] tool must be an integer, got True"),
        ("= 6 ", '= "6" ', r"line 5: \[probe\] tip_diameter_mm must be a number, got '6'"),
        ("= 6 ", "= nan ", r"line 5: \[probe\] tip_diameter_mm must be a finite number, got nan"),
        ("180.0,", "", r"line 6: \[probe\] angles_deg must be two numbers, got \[0.0\]"),
        ("180.0,", "true,", r"line 6: .*number 2 must be a number, got True"),
        ('"mill"', "3", "line 1: name must be text in quotes, got 3"),
        ("length_mm = 38.0", "length = 38", r"line 19: \[\[stylus\]\] number 2 has no length;"),
        ("length_mm = 38.0", "length_mm = 0", r"line 18: \[\[stylus\]\] number 2: the length is 0"),
        ("low = 1.0", 'low = "x"', r"line 22: \[limits\] \[x\] low must be a number, got 'x'"),
        ("[probe]\ntool = 7", "[prob]\ntool = 7", r"no \[prob\] .* Did you mean \[probe\]\?"),
        ("tool = 7", "tool = ", "line 4: not valid TOML"),
    ],
)
def test_errors_name_line_and_key(old: str, new: str, words: str) -> None:
    assert old in TEXT
    with pytest.raises(PretravelError, match=words) as error:
        structure().make(parse_toml(TEXT.replace(old, new, 1), "mill.toml"), Settings)
    assert str(error.value).startswith("mill.toml")


def test_missing_tables() -> None:
    with pytest.raises(InputError, match=r"tables \[probe\], \[stylus\] are missing; see"):
        structure().make(parse_toml("name = 'x'"), Settings)


def test_a_value_that_is_no_table() -> None:
    for text, words in (
        ("probe = 3\nstylus = []", r"line 1: probe must be a table, got 3"),
        (TEXT.replace("[limits.x]", "[limits]"), r"\[limits\] low must be a table, got 1"),
        (TEXT[: TEXT.index("[[")] + "[stylus]\n", r"write \[\[stylus\]\] above each"),
    ):
        with pytest.raises(InputError, match=words):
            structure().make(parse_toml(text), Settings)


def test_what_a_value_refuses_keeps_its_type() -> None:
    with pytest.raises(DescriptionError, match="line 15"):
        structure().make(parse_toml(TEXT.replace("12.0", "-1.0")), Settings)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    binary = tmp_path / "a.toml"
    binary.write_bytes(bytes(range(128, 256)))
    with pytest.raises(InputError, match="not a text file, so not a machine file"):
        read_toml(binary, "machine file")
    with pytest.raises(InputError, match="there is no such machine file; write one"):
        read_toml(tmp_path / "none.toml", "machine file", "write one")
    with pytest.raises(InputError, match="cannot be read"):
        read_toml(tmp_path, "machine file")


@pytest.mark.parametrize("value", ["6,5", "+6,5 # mm", '"6,5"'])
def test_a_decimal_comma_is_answered_with_the_number_to_write(value: str) -> None:
    changed = TEXT.replace("tip_diameter_mm = 6 ", f"tip_diameter_mm = {value} ")
    with pytest.raises(InputError, match=r"mill.toml, line 5: .*a point: write \+?6\.5$"):
        structure().make(parse_toml(changed, "mill.toml"), Settings)
