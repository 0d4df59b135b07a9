"""The readers of text files, with samples of their files."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from pretravel.base.errors import InputError, PretravelError
from pretravel.controls.linuxcnc_files import read_tool, read_work_offset
from pretravel.controls.machine_text import machine_text
from pretravel.drawing.pmi.model import read_drawing
from pretravel.drawing.tolerances.plan_features import read_plan_features
from pretravel.files.file_format import ReadingOptions
from pretravel.files.format_registry import format_named, format_of
from pretravel.files.history_drift import drift_of_history
from pretravel.files.laboratory_file import laboratory_template, read_laboratory
from pretravel.files.machine import Machine
from pretravel.files.machine_file import read_machine
from pretravel.files.map_file import read_map
from pretravel.files.map_json import json_of_map
from pretravel.files.points_reading import read_points
from pretravel.files.preview import look_at
from pretravel.files.probe_history import read_history
from pretravel.files.readings import read_directions, read_readings
from pretravel.files.source_file import SourceFile
from pretravel.files.touch_scatter_file import read_touch_scatter
from pretravel.files.touches_csv import read_plan, read_targets
from pretravel.laboratory.rig.rig_csv import read_budget, read_rig_trace, read_scale_check
from pretravel.laboratory.separation.separation_csv import (
    read_multi_step_readings,
)
from pretravel.prediction.catalogue import description_text, load_probe, rewritten
from pretravel.show.page_content import picture_figures
from pretravel.show.result_file import read_result, result_values
from pretravel.surface.cad.iges_reader import _entity_types
from pretravel.surface.cad.step_text import faces_in_text, with_names, without_pmi
from pretravel.surface.shapes import Sphere
from pretravel.tasks.history.report import history_columns, history_document
from tests.support.control_logs import GRBL_OPTIONS, REFUSED_FILES, SAMPLES
from tests.support.example_maps import mean_map
from tests.support.mutated_files import Reader, at_a_path
from tests.support.pages import plain_content
from tests.support.plans import DMIS_PLAN, DRAWING, QIF_PLAN
from tests.support.stored_maps import sealed, small_harmonic_map

EXAMPLES = Path(__file__).parent.parent.parent / "examples" / "data"
HISTORY = Path(__file__).parents[1] / "unit" / "files" / "data" / "version_1" / "history.jsonl"
_NAME = "damaged.txt"
_SHOP = ReadingOptions(reference_diameter=25.0)
_GERMAN_TABLE = (
    "Probe 7;;;\n\nNr;X-Ist;Y-Ist;Z-Ist;I;J;K;Vorschub\n;mm;mm;mm;;;;mm/min\n"
    "1;0,5;1,5;2,25;0;0;1;50\n2;0,5;1,5;2,5;1;0;0;50\n"
)
_SHOP_TABLES = (
    _GERMAN_TABLE,
    "# x y z i j k\n0.5 1.5 2.0 0 0 1\n0.5 1.0 2.0 0 1 0\n",
    'P1, X=1.0, Y=2.0, Z=3.0\nP2, X=1.5, Y=2.5, Z=3.5\n',
    '"Point name"\t"X [in]"\t"Y [in]"\t"Z [in]"\na\t0.5\t1.5\t2\nb\t0.5\t1.5\t2\n',
    "sep=;\nx_mm;y_mm;z_mm;nx;ny;nz\n0;0;3;0;0;1\n",
    "1.0  2.0  3.0\n4.0  5.0  6.0\n",
)  # fmt: skip
_JOINED_TABLE = (
    b"label;X;Y;Z;F\na;0;0;2,95;500\na;0;0;2,99;100\nb.1;10;0;2,95;500\nb.1;10;0;2,99;100\n"
    b"wall;22,99;0;-5;100\n"
)
_DESCRIPTION = (
    '[geometry]\nstep = "probe.step"\ntripod = "a"\nstylus = ["b"]\ntip = "#3"\n'
    '[geometry.materials]\na = "brass"\n[materials.brass]\nyoungs_modulus_GPa = 100\n'
    "poissons_ratio = 0.35\ndensity_g_cm3 = 8.5\n"
)
_QIF_2 = (
    '<?xml version="1.0"?><QIFDocument xmlns="http://qifstandards.org/xsd/qif2" versionQIF="2.1.0">'
    "<FileUnits><PrimaryUnits><LinearUnit><SIUnitName>meter</SIUnitName><UnitName>inch</UnitName>"
    "<UnitConversion><Factor>0.0254</Factor></UnitConversion></LinearUnit></PrimaryUnits>"
    '</FileUnits><MeasurementResources/><PointList><MeasurePoint id="4"><Point>0 0 3</Point>'
    "<Normal>0 0 1</Normal><Compensated>false</Compensated><ProbeRadius>0.1</ProbeRadius>"
    "</MeasurePoint></PointList></QIFDocument>"
)
_STEP = (
    b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n#1=PLANE($,#2);/* a */\n#3 = CARTESIAN_POINT ( $ ,"
    b"(0.,1.,2.));\n#4=(BOUNDED_CURVE() REPRESENTATION_ITEM($));\n#5=DIRECTION('it''s',(0.,0.,1.));"
    b"\nENDSEC;\nEND-ISO-10303-21;\n"
)
_IGES_ROWS = (
    ("written by hand", "S", 1),
    ("1H,,1H;,4Hpart,8Hpart.igs,4Hhand,1H1,32,38,6,308,15,4Hpart,1.,2,2HMM,1,", "G", 1),
    ("0.1,15H20260101.000000,1E-6,1000.,4Hhand,4Hhand,11,0;", "G", 2),
    ("     128       1       0       0       0       0       0       000000000", "D", 1),
    ("     128       0       0       2       0                                ", "D", 2),
    ("S      1G      2D      2P      2", "T", 1),
)  # fmt: skip
_IGES = "".join(f"{text:<72}{letter}{row:>7}\n" for text, letter, row in _IGES_ROWS).encode()


def _readings(name: str, options: ReadingOptions | None) -> Callable[[bytes], object]:
    """Detection of the format, and the reader of the stated one."""

    def read(content: bytes) -> object:
        file = SourceFile(_NAME, content)
        refusal: PretravelError | None = None
        for stated in (None, name):
            try:
                known = format_of(file) if stated is None else format_named(stated)
                if known.parse_features is not None:
                    # A document can have points and no characteristics.
                    with suppress(InputError):
                        known.parse_features(file, options or ReadingOptions())
                if known.parse is not None or known.parse_features is None:
                    read_readings(file, options or ReadingOptions(), file_format=known.name)
            except PretravelError as error:
                refusal = error
            if refusal is not None and not str(refusal).startswith(_NAME):
                raise AssertionError(f"the message names no file: {refusal}")
        if refusal is not None:
            raise refusal
        return None

    return read


def _shop_table(content: bytes) -> object:
    """A table of any form: looked at, and as touches of a sphere."""
    file = SourceFile(_NAME, content)
    known = format_of(file)
    if known.name == "csv":
        for options in (_SHOP, replace(_SHOP, columns={"label": "1", "z": "-4"})):
            look_at(file, options, known)
            read_readings(file, options, file_format="csv")
    return None


def _step_text(content: bytes) -> object:
    """What is done with the text of a STEP file before the kernel reads it."""
    return faces_in_text(without_pmi(with_names(content)[0]))


def _joined_table(content: bytes) -> object:
    """A table with labels and feeds, joined in each way, and with one normal."""
    file = SourceFile(_NAME, content)
    refusals = []
    joined = replace(GRBL_OPTIONS, units="mm")
    for options in (
        replace(joined, double_touches="all"),
        replace(joined, join="label"),
        replace(joined, join="feature", double_touches="last"),
        replace(joined, plan=None, normal=(0.0, 0.0, 1.0)),
    ):
        try:
            read_readings(file, options, file_format="csv")
        except PretravelError as error:
            refusals.append(error)
    if len(refusals) == 4:
        raise refusals[0]
    return None


def _targets(content: bytes) -> object:
    """As directions, as targets and as a plan; a file may lack the columns of one of them."""
    file = SourceFile("targets.csv", content)
    sphere = Sphere([0.0, 0.0, 0.0], 12.5)
    refusals = []
    for read in (read_directions, read_plan, lambda f: read_targets(f, sphere)):
        try:
            read(file)
        except PretravelError as error:
            refusals.append(error)
    if len(refusals) == 3:
        raise refusals[0]
    return None


def _used_map(path: Path) -> object:
    """The map is used too: whatever was read has values and an uncertainty."""
    found = read_map(path)
    return found.pretravel_and_uncertainty(found.support.nodes @ found.rotation.T)


def _map_content(content: bytes) -> object:
    """With a digest that fits, where the content is JSON still."""
    try:
        changed = json.loads(content)
        content = sealed(changed) if isinstance(changed, dict) else content
    except (ValueError, RecursionError):
        pass
    return at_a_path(_used_map, "map.json")(content)


def _parameters(content: bytes) -> object:
    file = SourceFile("linuxcnc.var", content)
    return read_work_offset(file, "G59.3"), read_work_offset(file, None, "inch")


def _description(path: Path) -> object:
    probe = load_probe(path)
    text = path.read_text(encoding="utf-8-sig")
    return probe, rewritten(
        text, {"spring.preload_N": (6.5, "fit"), "stylus.diameter_mm": (3.0, "")}
    )


def _machine_samples() -> tuple[bytes, ...]:
    whole = machine_text(Machine()).encode()
    return whole, whole + b"\n[limits]\nx_mm = [0, 500]\ny_mm = [0, 400]\nz_mm = [-300, 0]\n"


def _example(*names: str) -> tuple[bytes, ...]:
    """Files of the examples, the first lines of long ones."""
    lines = [(EXAMPLES / name).read_bytes().splitlines(keepends=True) for name in names]
    return tuple(b"".join(rows[:40]) for rows in lines)


def _separation_result() -> bytes:
    """The part of a result of `separate` that is read of it."""
    azimuth = [0.0, 90.0, 180.0, 270.0]
    columns = {
        "kind": ["machine"] * 4 + ["probe"] * 4,
        "variance_um2": [0.2, 0.3, 0.2, 0.1, 0.4, 0.3, 0.5, 0.4],
        "azimuth_deg": azimuth + azimuth,
    }
    table = [{"name": name, "values": values} for name, values in columns.items()]
    content = {"document": {"data": [{"title": "Directions", "columns": table}]}}
    return json.dumps(content).encode()


def _short_trace() -> bytes:
    """A trace of the rig with every 30th of its samples."""
    lines = (EXAMPLES / "rig" / "rig_000_1.csv").read_bytes().splitlines(keepends=True)
    return lines[0] + b"".join(lines[1::30])


_LOGS = tuple(
    Reader(name, _readings(name, options), (text.encode(),))
    for name, (text, options) in SAMPLES.items()
)
_REFUSED = tuple(text.encode() for texts, _ in REFUSED_FILES.values() for text in texts)
_MAP = b"polar_deg,azimuth_deg,pretravel_um,u_um,tip_radius_mm,feed_mm_min\n" + b"".join(
    b"%d,%d,%d,0.5,3,50\n" % (polar, azimuth, 10 + azimuth / 60)
    for polar in (0, 45, 90)
    for azimuth in range(0, 360, 90)
    if polar or not azimuth
)
_POINTS = (
    b"label,x_mm,y_mm,z_mm,nx,ny,nz,pretravel_um,u_um,deviation_um,shared_tip_radius_um\n"
    b"a,1,0,0,-1,0,0,5,0.5,1,0.1\nb,1,0,0,0,0,1,5,0.5,1,0.1\n"
)
_JSON_POINTS = (
    b'[{"label": "a", "x_mm": 1.0, "y_mm": 0, "z_mm": 0, "nx": -1, "ny": 0, "nz": 0, "u_um": 0.5}'
    b',\n{"label": "b", "x_mm": 1, "y_mm": 0, "z_mm": null, "nx": 0, "ny": 0, "nz": 1, "u_um": 1}]'
)
_JSON_SAMPLES = (_JSON_POINTS, _JSON_POINTS.replace(b"null", b"5"))
_PARAMETERS = {5210: 1, 5211: 1, 5212: 2, 5213: 3, 5220: 1, 5221: 10, 5222: 20, 5223: -30, 5230: 90,
               5381: 1, 5382: 2, 5383: 3}  # fmt: skip
_TOML_WORDS = (
    b"[]", b"{}", b"[[1]]", b"[[1], 2]", b"[{}]", b'"text"', b"true", b"inf", b"nan", b"1979-05-27",
    b"07:32:00", b"[stylus]", b"[[stylus]]", b"[materials]", b'"a\\u0000"', b"'''", b'"""',
    b"a.b = 1", b"[tripod.radius_mm]", b'"\\ud800"', b"0xff", b"[" * 2000,
)  # fmt: skip


def _result(path: Path) -> object:
    """A result that is read, with its pictures for the scripts of a page."""
    content = read_result(path)
    return [picture_figures(picture) for picture in content.document.pictures]


def _result_sample() -> bytes:
    return json.dumps(result_values(plain_content(3))).encode()


def _read_history(path: Path) -> object:
    """And what is made of one: its drift, report and table."""
    entries = read_history(path)
    history_document(entries)
    return drift_of_history(entries), history_columns(entries)


TEXT_READERS: tuple[Reader, ...] = (
    *_LOGS,
    Reader("refused", _readings("csv", None), _REFUSED),
    Reader("qif2", _readings("qif", None), (_QIF_2.encode(),)),
    Reader(
        "shop-tables",
        _shop_table,
        tuple(text.encode() for text in _SHOP_TABLES) + _example("sphere_touches.csv"),
    ),
    Reader("joined-table", _joined_table, (_JOINED_TABLE,)),
    Reader("targets", _targets, _example("targets.csv", "part_touches.csv", "bore_touches.csv")),
    Reader("points", lambda c: read_points(SourceFile("points.csv", c)), (_POINTS,)),
    Reader("points-json", lambda c: read_points(SourceFile("points.json", c)), _JSON_SAMPLES),
    Reader(
        "map",
        at_a_path(_used_map, "map.json"),
        tuple(json_of_map(made) for made in (mean_map(0.01), small_harmonic_map())),
        (b"NaN", b"1e999", b"null", b"[]", b"{}", b"[" * 2000, b'"a"', b"-", b"9" * 5000),
    ),
    Reader("map-content", _map_content, (json_of_map(small_harmonic_map()),)),
    Reader("map-table", at_a_path(read_map, "map.csv"), (_MAP, *_example("kp3_ring.csv"))),
    Reader(
        "rig-trace",
        at_a_path(read_rig_trace, "rig_000_1.csv"),
        (_short_trace(),),
    ),
    Reader(
        "rig-scale",
        at_a_path(read_scale_check, "scale.csv"),
        (
            b"scale_mm,reference_mm,run\n"
            + b"".join(
                b"%.3f,%.6f,%d\n" % (0.05 * k, 0.05 * k + 1e-6 * (k % 5), k % 2) for k in range(40)
            ),
        ),
    ),
    Reader("rig-budget", at_a_path(read_budget, "budget.csv"), _example("rig_budget.csv")),
    Reader(
        "multi-step",
        at_a_path(read_multi_step_readings, "readings.csv"),
        _example("redundancy_24x24.csv"),
    ),
    Reader(
        "separation",
        at_a_path(read_touch_scatter, "separation.json"),
        (_separation_result(),),
    ),
    Reader("machine", at_a_path(read_machine, "mill.toml"), _machine_samples(), _TOML_WORDS),
    Reader(
        "probe-description",
        at_a_path(_description, "probe.toml"),
        (
            description_text("omp40-2").encode(),
            (description_text("omp40-2") + _DESCRIPTION).encode(),
        ),
        _TOML_WORDS,
    ),
    Reader(
        "laboratory",
        at_a_path(read_laboratory, "laboratory.toml"),
        (laboratory_template().encode(),),
        _TOML_WORDS,
    ),
    Reader("features", at_a_path(read_drawing, "drawing.toml"), (DRAWING.encode(),), _TOML_WORDS),
    Reader("features-dmis", at_a_path(read_plan_features, "plan.dmi"), (DMIS_PLAN.encode(),)),
    Reader("features-qif", at_a_path(read_plan_features, "plan.qif"), (QIF_PLAN.encode(),)),
    Reader(
        "linuxcnc-parameters",
        _parameters,
        (b"".join(b"%d\t%d\n" % pair for pair in _PARAMETERS.items()),),
    ),
    Reader(
        "linuxcnc-tools",
        lambda c: read_tool(SourceFile("tool.tbl", c), 99),
        (b"T1 P1 D6.0 Z100.0 ;mill\nT2 P2 Z+.5\nT99 P3 D6.0 Z101.5 ;probe\n",),
    ),
    Reader(
        "result",
        at_a_path(_result, "result.json"),
        (_result_sample(),),
        (b"</script>", b"<!--", b"null", b"[]", b"{}", b'{"infinite":1}', b"1e999", b"[" * 2000),
    ),
    Reader(
        "history",
        at_a_path(_read_history, "h.jsonl"),
        (HISTORY.read_bytes(),),
        (b"NaN", b"1e999", b"null", b"true", b"[" * 2000, b"9" * 5000, b'"\\ud800"', b"9999-12-31"),
    ),
    Reader("step-text", _step_text, (_STEP,), (b"/*", b"*/", b"'", b"$", b"=PLANE(", b"(" * 50)),
    Reader(
        "iges-text",
        at_a_path(_entity_types, "part.igs"),
        (_IGES,),
        (b"9999999999H", b"1H,", b"0H", "²H".encode()),
    ),
)
