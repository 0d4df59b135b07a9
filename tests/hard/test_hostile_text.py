"""Text that someone wrote to break a reader: it is refused with its line, and in linear time."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from pretravel.base import toml_file
from pretravel.base.errors import InputError, PretravelError
from pretravel.base.toml_file import parse_toml
from pretravel.controls.linuxcnc_files import read_tool, read_work_offset
from pretravel.controls.logs.grbl import read_grbl_log
from pretravel.controls.logs.print_file import read_print_file
from pretravel.design.fem import step_solids as model_solids
from pretravel.files import source_file
from pretravel.files.csv_table import read_csv_table
from pretravel.files.file_format import FilePositions, ReadingOptions
from pretravel.files.format_registry import format_of
from pretravel.files.laboratory_file import read_laboratory
from pretravel.files.logs.fusion import read_fusion
from pretravel.files.logs.joining import join
from pretravel.files.logs.qif import read_qif
from pretravel.files.machine_file import read_machine
from pretravel.files.points_reading import read_points
from pretravel.files.readings import read_readings
from pretravel.files.source_file import SourceFile
from pretravel.files.touches_csv import read_touches
from pretravel.laboratory.rig.rig_csv import read_budget
from pretravel.laboratory.separation.separation_csv import read_multi_step_readings
from pretravel.prediction.catalogue import description_text, load_probe, parse_probe
from pretravel.prediction.description import StepGeometry
from pretravel.surface.cad.iges_header import check_iges_header
from pretravel.surface.cad.part import Part
from pretravel.touches.targets import Targets
from tests.hard.text_readers import TEXT_READERS
from tests.support.control_logs import OWN_LOG_HEAD, OWN_LOG_TOUCH, QIF_FILE
from tests.support.mutated_files import fault_of, no_longer_than

READERS = {reader.name: reader for reader in TEXT_READERS}
DESCRIPTION = description_text("omp40-2")
TOO_LARGE = "9" * 400
"""Larger than any number of 64 bits."""
TOO_LONG = "9" * 5000
"""Python refuses to read an integer of so many digits."""
LONG_LINE = 100_000
"""Signs of a line; at this length a quadratic reader takes more than `HANG`."""
HANG = 5.0


def _described(key: str, value: str) -> str:
    """The description of a probe with another value; the line is that of the key."""
    lines = DESCRIPTION.splitlines()
    row = next(i for i, line in enumerate(lines) if line.startswith(f"{key} ="))
    lines[row] = f"{key} = {value}"
    return "\n".join(lines) + "\n"


def _line_of(key: str) -> int:
    lines = DESCRIPTION.splitlines()
    return next(i for i, line in enumerate(lines, 1) if line.startswith(f"{key} ="))


class TestToml:
    @pytest.mark.parametrize("number", [TOO_LARGE, TOO_LONG, "-" + TOO_LARGE, "0x" + "f" * 4000])
    def test_a_number_of_hundreds_of_digits(self, number: str) -> None:
        with pytest.raises(InputError, match=rf"line {_line_of('preload_N')}: ") as refused:
            parse_probe(_described("preload_N", number), "a.toml")
        assert len(str(refused.value)) < 300

    @pytest.mark.parametrize(
        "value", ["[[1], [2], [3]]", "[[[1]]]", "[{}, {}, {}]", "[true, 1, 2]", "[1e308, 1e308, 1]"]
    )
    def test_nested_arrays(self, value: str) -> None:
        with pytest.raises(PretravelError, match=r"^a\.toml, line \d+: "):
            parse_probe(_described("rod_azimuths_deg", value), "a.toml")

    @pytest.mark.parametrize("value", ["5", "[]", '["steel"]', "{}", "1979-05-27"])
    def test_a_material_of_a_wrong_type(self, value: str) -> None:
        with pytest.raises(InputError, match=r"^a\.toml, line \d+: .*must be"):
            parse_probe(_described("material", value), "a.toml")
        for table in (f"[materials]\nbrass = {value}\n", f"[geometry]\nmaterials = {value}\n"):
            with pytest.raises(InputError, match=r"^a\.toml(, line \d+)?: "):
                parse_probe(DESCRIPTION + table, "a.toml")

    @pytest.mark.parametrize("text", ["a = " + "[" * 50_000, "a = " + "{b=" * 50_000])
    def test_deeply_nested(self, text: str) -> None:
        with pytest.raises(InputError, match=r"^a\.toml"):
            parse_toml(text, "a.toml")

    def test_a_long_value_is_not_repeated_in_the_message(self) -> None:
        with pytest.raises(InputError) as refused:
            parse_probe(_described("preload_N", '"' + "x" * 1500 + '"'), "a.toml")
        assert len(str(refused.value)) < 300

    @pytest.mark.parametrize(
        "text",
        [
            "a" + ".a" * 50_000 + " = 1\n",
            "\n".join(f"{'.'.join('a' * 900)} = {i}" for i in range(200)),
            "preload_N = [\n" + "1,\n" * 20_000 + "]\n",
            "a = 1\n" * 100_000,
        ],
    )
    def test_in_linear_time(self, text: str, tmp_path: Path) -> None:
        file = tmp_path / "a.toml"
        file.write_text(text, encoding="utf-8")
        with no_longer_than(HANG), pytest.raises(InputError):
            read_machine(file)

    def test_a_number_in_a_laboratory_file(self, tmp_path: Path) -> None:
        file = tmp_path / "a.toml"
        file.write_text(f"[laboratory]\nname = 0x{'f' * 4000}\n", encoding="ascii")
        with pytest.raises(InputError, match="line 2: "):
            read_laboratory(file)


class TestLinuxCnc:
    @pytest.mark.parametrize("number", ["²", "٣", TOO_LONG, "-1", "1_0"])
    def test_the_number_of_a_parameter(self, number: str) -> None:
        with pytest.raises(InputError, match=r"linuxcnc.var, line 2: .*parameter"):
            read_work_offset(SourceFile("linuxcnc.var", f"5220 1\n{number} 1\n".encode()))

    @pytest.mark.parametrize("number", [TOO_LARGE, TOO_LONG, "1.5", "-3"])
    def test_the_number_of_a_tool(self, number: str) -> None:
        with pytest.raises(InputError, match=r"tool.tbl, line 2: .*(of a tool|finite)"):
            read_tool(SourceFile("tool.tbl", f"T1 P1\nT{number} P2\n".encode()), 3)

    def test_the_length_of_a_tool(self) -> None:
        with pytest.raises(InputError, match=r"tool.tbl, line 1: "):
            read_tool(SourceFile("tool.tbl", f"T3 Z{TOO_LARGE}\n".encode()), 3)


class TestLogs:
    @pytest.mark.parametrize("line", [f"G330 A{TOO_LARGE}", f"G800 N1 X0 Y0 Z{TOO_LARGE} I0 J0 K1"])
    def test_a_number_that_overflows_in_fusion(self, line: str) -> None:
        text = f"START\n{line}\nG800 N1 X0 Y0 Z0 I0 J0 K1\nG801 N1 X0 Y0 Z3 R3\nEND\n"
        with pytest.raises(InputError, match=r"a.msr, line 2: "):
            read_fusion(SourceFile("a.msr", text.encode()), "mm")

    @pytest.mark.parametrize("length", ["1,2", "", "1,2,3,4"])
    def test_a_tool_length_of_grbl_has_one_value_or_three(self, length: str) -> None:
        text = f"$13=0\n[GC:G0 G54 G17]\n[G54:1,2,3]\n[TLO:{length}]\nok\n[PRB:1,2,3:1]\n"
        if length.count(",") == 3:  # axes beyond x, y and z are not of the tool's length
            read_grbl_log(SourceFile("a.log", text.encode()))
            return
        with pytest.raises(InputError, match=r"a.log, line 4: TLO"):
            read_grbl_log(SourceFile("a.log", text.encode()))

    def test_a_number_that_overflows_in_a_print_file(self) -> None:
        text = f"SIZE D{TOO_LARGE} ACTUAL {TOO_LARGE} DEV 0\n"
        with pytest.raises(InputError, match=r"a.txt, line 1: "):
            read_print_file(SourceFile("a.txt", text.encode()), "mm")
        text = f"COMPONENT NO {TOO_LONG} FEATURE NO 1\nSIZE D1 ACTUAL 1 DEV 0\n"
        with pytest.raises(InputError, match=r"a.txt, line 1: .*component"):
            read_print_file(SourceFile("a.txt", text.encode()), "mm")

    @pytest.mark.parametrize(
        ("old", "new"),
        [
            ('count="2"', 'count="-2"'),
            ('count="2"', f'count="{10**15}"'),
            ('count="2"', 'count="0"'),
        ],
    )
    def test_the_count_of_a_qif_set(self, old: str, new: str) -> None:
        text = QIF_FILE.replace("UNITS", "").replace(old, new)
        with pytest.raises(InputError, match=r"a.qif: .*count"):
            read_qif(SourceFile("a.qif", text.encode()))

    @pytest.mark.parametrize("factor", ["0", "-1", "nan", "1e400", "x"])
    def test_the_unit_of_a_qif_document(self, factor: str) -> None:
        for element in (f"<Factor>{factor}</Factor>", f"<Offset>{factor}1</Offset>"):
            unit = f"<LinearUnit><UnitConversion>{element}</UnitConversion></LinearUnit>"
            units = f"<FileUnits><PrimaryUnits>{unit}</PrimaryUnits></FileUnits>"
            with pytest.raises(InputError, match=r"a.qif: .*unit"):
                read_qif(SourceFile("a.qif", QIF_FILE.replace("UNITS", units).encode()))


class TestTables:
    def test_a_cell_that_is_larger_than_a_reader_takes(self) -> None:
        text = "x_mm,y_mm,z_mm,nx,ny,nz\n1,2,3,0,0,1\n" + "1" * 140_000 + ",2,3,0,0,1\n"
        for read in (read_csv_table, read_touches):
            with pytest.raises(InputError, match=r"a.csv, line 3: "):
                read(SourceFile("a.csv", text.encode()))

    @pytest.mark.parametrize("number", ["1e300", "-1e300", "9" * 30])
    def test_a_number_that_is_no_measured_value(self, number: str) -> None:
        text = f"x_mm,y_mm,z_mm,nx,ny,nz\n1,2,3,0,0,1\n{number},2,3,0,0,1\n"
        for options in (ReadingOptions(), ReadingOptions(reference_diameter=25.0)):
            with pytest.raises(InputError, match=r"a.csv, line 3: x_mm is .*larger than"):
                read_readings(SourceFile("a.csv", text.encode()), options)
        log = OWN_LOG_HEAD + OWN_LOG_TOUCH.format(label="a", touched="1").replace("2990.0", number)
        with pytest.raises(InputError, match=r"a.log, line 4: .*larger than"):
            read_readings(SourceFile("a.log", log.encode()))

    def test_labels_that_are_long_numbers(self) -> None:
        text = f"{TOO_LONG} 1.5 2.5 3.5\n{TOO_LONG}1 1.5 2.5 3.5\n"
        assert format_of(SourceFile("a.txt", text.encode())).name == "csv"
        with pytest.raises(InputError):
            read_readings(SourceFile("a.txt", text.encode()), ReadingOptions(units="mm"))

    @pytest.mark.parametrize("value", ["nan", "inf", "1e400"])
    def test_a_budget_of_a_rig(self, value: str, tmp_path: Path) -> None:
        file = tmp_path / "budget.csv"
        file.write_text(
            f"source,type,uncertainty_um,per_metre_um\na,B,{value},\n", encoding="ascii"
        )
        with pytest.raises(InputError, match="line 2: uncertainty_um"):
            read_budget(file)

    @pytest.mark.parametrize("index", ["1e300", "-1e18"])
    def test_an_index_of_a_multi_step_test(self, index: str, tmp_path: Path) -> None:
        file = tmp_path / "readings.csv"
        rows = f"1,1,0\n1,2,0\n2,1,0\n{index},2,0\n"
        file.write_text(f"machine_index,probe_index,error_um\n{rows}", encoding="ascii")
        with pytest.raises(InputError, match="line 5: machine_index"):
            read_multi_step_readings(file)

    @pytest.mark.parametrize(
        "text",
        ["[" * 100_000, "[" + TOO_LONG + "]", '[{"x_mm": ' + TOO_LONG + "}]", '[{"a":' * 50_000],
    )
    def test_points_in_json(self, text: str) -> None:
        with pytest.raises(InputError, match=r"a.json"):
            read_points(SourceFile("a.json", text.encode()))

    def test_points_in_json_with_a_huge_number(self) -> None:
        row = dict.fromkeys(("x_mm", "y_mm", "z_mm", "nx", "ny", "u_um"), 0.0) | {"nz": 1e300}
        with pytest.raises(InputError, match=r"a.json, line 1: nz"):
            read_points(SourceFile("a.json", json.dumps([row]).encode()))


class TestCad:
    @pytest.mark.parametrize("start", [f"{TOO_LONG}H", f"1H,,1H;,{'1,' * 11}{TOO_LONG}"])
    def test_a_number_in_the_head_of_an_iges_file(self, start: str) -> None:
        text = f"{start};"
        rows = [text[i : i + 72] for i in range(0, len(text), 72)]
        with pytest.raises(PretravelError):
            check_iges_header([f"{row:<72}G{i:>7}".encode() for i, row in enumerate(rows, 1)])

    @pytest.mark.parametrize("selector", ["#²", f"#{TOO_LONG}", "#"])
    def test_the_number_of_a_solid(
        self, selector: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        solids = [SimpleNamespace(name=name, mass=1.0) for name in "ab"]
        monkeypatch.setattr(model_solids, "read_step_solids", lambda _: solids)
        (tmp_path / "a.step").touch()
        step = StepGeometry(tmp_path / "a.step", ("a",), ("b",), (selector,))
        with pytest.raises(InputError, match="there is no solid '#"):
            model_solids.step_solids(load_probe("omp40-2"), step)

    def test_the_number_of_a_face(self) -> None:
        with pytest.raises(PretravelError, match="has no face"):
            Part("a.step", (), ()).select(TOO_LONG)


LONG_LINES = [
    ("dmis", "FA(", " ", "x"),
    ("dmis", "FA(", " a", "x"),
    ("dmis", "FA(P1)", " ", "x"),
    ("dmis", "", "FA(P1) = ", ""),
    ("grbl", "", "[PRB:", ""),
    ("grbl", "[PRB:", "1", ""),
    ("grbl", "[GC:", "[ G54 ", ""),
    ("grbl", "[GC:", " G54", ""),
    ("grbl", "", "[G54:", ""),
    ("grbl", "", "<a,MPos:1,WPos:1,1,1", ""),
    ("grbl", "<a,MPos:1,WPos:1,1,", "1", ""),
    ("grbl", "", "<Idle|", ""),
    ("g2core", "", '"prb":{"e":', ""),
    ("g2core", '"prb"', " ", ":"),
    ("positions", "G1 X1 Y1 Z1\n", "(", ""),
    ("positions", "G1 X1 Y1 Z1\nX", "1", "e"),
    ("positions", "X1", "Y1", ""),
    ("print", "SIZE D1 ACTUAL 1 DEV 0\nSIZE", " ", "x"),
    ("print", "SIZE D", "1", "x"),
    ("print", "", "ACTUAL ", ""),
    ("print", "COMPONENT", " ", "x"),
    ("pcdmis", "a", " ", "x"),
    ("pcdmis", "a", "= ", "x"),
    ("pcdmis", "THEO/", "<", ""),
    ("refused", "", "X1", ","),
    ("refused", "G1", " X 1", ","),
    ("refused", "", "(", ""),
    ("refused", "", " )(", ""),
    ("refused", ">", " 1", "x"),
    ("refused", "00014", " ", "x"),
    ("refused", "#", "1=", ""),
    ("csv", "", ",", ""),
    ("csv", "x_mm,y_mm,z_mm", ",", "\n1,2,3\n"),
    ("csv", "x_mm,y_mm,z_mm", ",a", "\n1,2,3\n"),
    ("csv", "", ",1", ""),
    ("csv", '"', "\t", ""),
    ("csv", "", "(", ""),
    ("csv", "", "x-", ""),
    ("csv", "X", " (mm)", ""),
    ("csv", "", "-", "x"),
    ("csv", "0", "0", "x"),
    ("csv", "x y z\n1 2 ", "0", "x\n"),
    ("csv", "# ", "unit ", "\n1 2 3\n"),
    ("csv", "", '"', "a"),
    ("csv", "", '" ', "a"),
    ("shop-tables", "1 2 3 0 0 ", "0", "x"),
    ("linuxcnc-tools", "T", "1", "x"),
    ("linuxcnc-parameters", "5", "1", " 1"),
    ("points", "x_mm", ",a", "\n1"),
    ("step-text", "", "=/*", ""),
    ("step-text", "=", " ", ""),
    ("step-text", "=", "/**/", ""),
    ("step-text", "", "REPRESENTATION_ITEM/*", ""),
    ("qif", "", "<a>", ""),
    ("fusion", "G800 ", "X1", ""),
    ("fusion", "G800 N", "1", "x"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "start", "repeated", "end"), LONG_LINES)
def test_a_long_line_in_linear_time(name: str, start: str, repeated: str, end: str) -> None:
    """By itself, and after a good file."""
    reader = READERS[name]
    line = (start + repeated * (LONG_LINE // len(repeated)) + end).encode()
    for content in (line, reader.samples[0] + b"\n" + line):
        assert fault_of(reader, content, longest=HANG) is None


def _long_log(touched: str, count: int) -> bytes:
    rows = [OWN_LOG_TOUCH.format(label=f"p{i}", touched=touched) for i in range(count)]
    return (OWN_LOG_HEAD + "".join(rows) + f"done,{count},end\n").encode()


def test_a_log_of_forty_thousand_touches() -> None:
    with no_longer_than(HANG):
        assert len(read_readings(SourceFile("a.log", _long_log("1.0", 40_000))).touches) == 40_000


def test_a_log_of_forty_thousand_misses() -> None:
    with no_longer_than(HANG), pytest.raises(InputError, match="40000 were missed"):
        read_readings(SourceFile("a.log", _long_log("0.0", 40_000)))


class TestFilesWithoutEnd:
    """A link to a device, or a file of another kind: no more is read than such a file can have."""

    def test_readings(self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(source_file, "LARGEST_FILE", 1000)
        link = tmp_path / "a.csv"
        link.symlink_to("/dev/zero")
        with pytest.raises(InputError, match=r"a.csv: the file is larger than 0.001 MB"):
            read_touches(link)

    @pytest.mark.parametrize("read", [read_machine, read_laboratory, load_probe])
    def test_settings(
        self, read: Callable[[Path], object], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(toml_file, "_MOST_SIGNS", 1000)
        link = tmp_path / "a.toml"
        link.symlink_to("/dev/zero")
        with no_longer_than(HANG), pytest.raises(InputError, match=r"a.toml: .*at most 1000"):
            read(link)


MANY = 25_000
"""Points of a file; a reader that compares each with all others takes more than `HANG`."""


def _many_of_pc_dmis(number: int) -> str:
    return f"P{number} =FEAT/POINT,RECT\nTHEO/0,0,{number},0,0,1\nACTL/0,0,{number}.01,0,0,1\n"


def _many_of_dmis(number: int) -> str:
    return f"FA(P{number})=FEAT/POINT,CART,0,0,{number},0,0,1\n"


def _many_of_fusion(number: int) -> str:
    return f"G800 N{number} X0 Y0 Z0 I0 J0 K1\nG801 N{number} X0 Y0 Z3 R3\n"


class TestManyPoints:
    @pytest.mark.parametrize(
        ("name", "line"),
        [("pcdmis", _many_of_pc_dmis), ("dmis", _many_of_dmis), ("fusion", _many_of_fusion)],
    )
    def test_a_label_at_the_end_occurs_twice(self, name: str, line: Callable[[int], str]) -> None:
        text = "".join(line(number) for number in [*range(MANY), MANY - 1])
        # Results of Fusion are tip centres, from which no radius was subtracted.
        taken_off = None if name == "fusion" else 0.0
        options = ReadingOptions(units="mm", radius_taken_off=taken_off)
        with no_longer_than(HANG), pytest.raises(InputError, match="occurs twice"):
            read_readings(SourceFile("a.txt", text.encode()), options, file_format=name)

    def test_two_targets_at_the_end_of_a_plan_have_one_label(self) -> None:
        labels = (*(f"p{i}" for i in range(MANY)), f"p{MANY - 1}")
        points = np.zeros((MANY + 1, 3))
        plan = Targets(points, np.tile([0.0, 0.0, 1.0], (MANY + 1, 1)), labels=labels)
        found = FilePositions("a.log", points[:1], (1,))
        with no_longer_than(HANG), pytest.raises(InputError, match=f"two targets .*p{MANY - 1}"):
            join(found, plan, 3.0)

    def test_misses_far_from_every_target(self) -> None:
        plan = Targets(np.eye(3)[:1], np.eye(3)[:1])
        positions = np.vstack([[[4.0, 0.0, 0.0]], np.full((MANY, 3), 1e6)])
        contact = (True, *(False,) * MANY)
        found = FilePositions("a.log", positions, tuple(range(1, MANY + 2)), contact)
        with no_longer_than(HANG):
            assert len(join(found, plan, 3.0).touches) == 1


class TestMessages:
    """What a message quotes of a file goes to a terminal."""

    def test_control_characters_are_written_as_text(self) -> None:
        text = "x_mm,y_mm,z_mm,nx,ny,nz\n1,2,\x1b[2J\x9b\x07,0,0,1\n"
        with pytest.raises(InputError, match=r"z_mm is '\\x1b\[2J\\x9b\\x07'"):
            read_csv_table(SourceFile("a.csv", text.encode())).numbers("z_mm")
        with pytest.raises(PretravelError, match=r"material '\\x1b' is not known"):
            parse_probe(_described("material", '"\\u001b"'), "a.toml")

    def test_their_length_is_limited(self) -> None:
        text = "x_mm,y_mm,z_mm,nx,ny,nz\n1,2,'" + "1'" * 50_000 + ",0,0,1\n"
        with pytest.raises(InputError, match=r"a.csv, line 2: .* save the table") as refused:
            read_touches(SourceFile("a.csv", text.encode()))
        assert len(str(refused.value)) < 3000
