"""PC-DMIS: a measurement routine as text, with THEO/ and ACTL/ of its points and hits; reading."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np

from pretravel.base import InputError
from pretravel.files.file_format import FileFormat, FileReadings
from pretravel.files.logs.dmis import (
    checked_radius_taken_off,
    refuse_other_compensation,
    with_unit_normals,
)
from pretravel.files.row_statements import (
    RowStatement,
    RowStatements,
    StatedRows,
    any_of,
    changes_rows,
    is_note,
)
from pretravel.files.source_file import UNITS, Source, SourceFile, opened
from pretravel.touches import Touches, word_fields

_FEATURE = re.compile(r"=\s*(?:FEAT|AUTO)\s*/", re.IGNORECASE)
"""Stands between the label of a feature and its kind."""
_VALUES = re.compile(r"^(THEO|ACTL)\s*/\s*(.*)$", re.IGNORECASE)
_HIT = re.compile(r"^HIT\s*/\s*(.*)$", re.IGNORECASE)
_NAMED = r"(?:[\w.$-]+\s*=\s*)?"
"""The label of a statement, where it has one."""
_LOADED = "`LOADPROBE/`"
_TABLE = (
    RowStatement(
        "`TIP/`, and any word with a name such as `T2A90B0`",
        _NAMED + r"TIP\s*/\s*([^,]+)|[\w ]+/\s*(T\d+A-?\d+(?:\.\d+)?B-?\d+(?:\.\d+)?)\b", "tip",
        "carried", "TIP/T2A90B0, SHANKIJK=0, 1, 0, ANGLE=90",
    ),
    RowStatement(
        _LOADED, _NAMED + r"LOADPROBE\s*/\s*([^,]+)", "tip", "carried", "LOADPROBE/STAR_2"
    ),
    RowStatement(
        "`ALIGNMENT/` (but not its END)", _NAMED + r"ALIGNMENT\s*/\s*(?!END)(.*)", "frame",
        "refused", "A2 =ALIGNMENT/START,RECALL:A1,LIST=YES",
    ),
    RowStatement(
        "`RECALL/`, `ROTAB/`, `MOVE/ROTAB`, `EQUATE/`, `ITERATE/`, `BF3D/`, `MATRIX/`",
        _NAMED + r"(?:MOVE\s*/\s*)?" + any_of(
            "RECALL ROTAB ROTARYTABLE ROTARY_TABLE EQUATE ITERATE BF2D BF3D BEST_FIT BESTFIT "
            "MATRIX LEAPFROG ROTATE TRANS"
        ) + "(.*)",
        "frame", "refused", "RECALL/ALIGNMENT,INTERNAL,A1",
    ),
    RowStatement(
        "`PROBECOM/`, `PROBE COMPENSATION/`, `AUTOCALIBRATE/`",
        _NAMED + any_of(
            "PROBECOM PROBE_COMPENSATION POLARVECTORCOMP POLAR_VECTOR_COMP AUTOCALIBRATE CALIBRATE"
        ) + "(.*)",
        "radius", "refused", "PROBECOM/OFF",
    ),
    RowStatement(
        "`TEMP COMP/`, `SCALEFACTOR/`, `UNITS/`",
        any_of("TEMP_COMP TEMPERATURE_COMP SCALE_FACTOR UNIT UNITS") + "(.*)",
        "unit", "refused", "TEMP COMP/ORIGIN",
    ),
    RowStatement(
        "`PART NAME:`, `SER NUMBER:` again", r"((?:PART NAME|SER NUMBER)\s*:.*)", "part", "refused",
        "PART NAME  : HOUSING 2", event=True,
    ),
    RowStatement(
        "`LOOP/START`, `GOTO/`, `CALLSUB/`",
        _NAMED + r"((?:LOOP\s*/\s*START|GOTO\s*/|CALLSUB\s*/|PASTE WITH PATTERN).*)",
        "part", "refused", "V1 =LOOP/START, ID=YES, NUMBER=4",
    ),
    RowStatement(
        "`TOUCHSPEED/`", r"TOUCHSPEED\s*/\s*(.*)", "pass", "carried", "TOUCHSPEED/ 4"
    ),
    RowStatement(
        "`MODE/`, `MOVE/`, `MOVESPEED/`, `PREHIT/`, `RETRACT/`, `CHECK/`, `CLEARP/`, `FLY/`",
        any_of(
            "MODE MOVE MOVESPEED SCANSPEED PREHIT RETRACT CHECK CLEARP CLAMP FLY WORKPLANE FORMAT "
            "ARMTYPE MANRETRACT MAXMINEAV DELAY AVOIDANCE_MOVE AUTO_MOVE LIMITEDAVOID "
            "IGNOREMOTIONERRORS ONERROR ENABLECLEARP"
        ),
        example="MOVE/POINT,NORMAL,<0,0,50>",
    ),
    RowStatement(
        "settings of a feature: `SNAP=`, `AUTO MOVE=`, `SHOW HITS=` …",
        any_of(
            "THEO ACTL TARG MEAS ENDMEAS HIT RMEAS ANGLE_VEC START_ANG DIRECTION SNAP SHOW AUTO "
            "FIND READ INIT PERM SPACER NUMHITS DEPTH PITCH SAMPLE VOID EDGE DISPLAY THICKNESS "
            "OFFSET REF SURFACE GRAPH DETAIL DETAILS MEASURE_ORDER FILTER OUTLIER USE_THEO TWO_D "
            "RELATIVE CONSTR READPOINT INDENT INCREMENT"
        ),
        example="SNAP=NO",
    ),
    RowStatement(
        "dimensions, comments, `ALIGNMENT/END`, `IF/`, `ASSIGN/`, `PRINT/`",
        r"(?:\$\$|" + _NAMED + any_of(
            "ALIGNMENT/END DIM DIMENSION END_OF_DIMENSION AX COMMENT ASSIGN PRINT REPORT STATS "
            "REV_NUMBER STARTUP STATISTICS PARTNAME DATE TIME FCF LOCATION_OF FLATNESS ROUNDNESS "
            "DATDEF TOL LABEL TRACEFIELD VISION DISPLAYMETAFILE EXTERNALCOMMAND GROUP ENDGROUP IF "
            "END_IF ELSE LOOP/END OPTIMIZE COLUMN LEVEL"
        ) + ")",
        example="COMMENT/REPT,a note",
    ),
    RowStatement(
        "rows of a dimension", r"(?:[A-Z][A-Z0-9]{0,3}\s+[-+\d.]|-{3}|={3}|\||\*)",
        example="X   10.000   0.010   0.010   10.002   0.002   0.000",
    ),
    RowStatement("features", r"[^=]*=\s*" + any_of("FEAT AUTO GENERIC BASICSCAN SCAN CURVE") + "/"),
)  # fmt: skip
_COMPENSATION = re.compile(r"PROBE ?COM(?:PENSATION)?\s*/\s*(ON|OFF)\b", re.IGNORECASE)
_STATEMENTS = RowStatements(_TABLE)
_UNIT = re.compile(r"^(DIM\b.*\b)?UNITS?\s*[/:=]\s*(MM|IN)", re.IGNORECASE)
"""The unit of the routine, or of a dimension, which can be another one."""
_NO_TOUCH = re.compile(r"^(?:READPOINT|CONSTR)\b", re.IGNORECASE)
_SHANK = re.compile(r"SHANKIJK\s*=([-+\d., ]+)(?:,|$)", re.IGNORECASE)
_UPRIGHT = 0.996
"""Cosine of the angle to z, 5°, below which a shank is not along z."""
_OF_ONE_TOUCH = re.compile(r"^(?:\w+/)?(?:VECTOR POINT|POINT)\b", re.IGNORECASE)
_SHOWN = 8
"""Most features that a warning names."""


def read_pc_dmis(
    source: Source, radius_taken_off: float | None = None, units: str | None = None
) -> FileReadings:
    r"""Read touches from the text of a measurement routine of PC-DMIS that was run.

    The hits of a measured feature are touches, and so are a measured or a vector point. A feature
    without hits (a circle, an edge point), a point that was constructed, and a point that was read
    without a touch (READPOINT) are not; a warning names them.

    Parameters
    ----------
    source : str, Path or SourceFile
    radius_taken_off : float
        Radius that was subtracted from the points along their normals: 0 for tip centres, the
        tip's (qualified) radius for surface points. The file does not state it. [mm]
    units : str
        mm or inch; the file does not state it.

    Returns
    -------
    FileReadings
        Tip centres, with the vectors and points of THEO as normals and nominal points.

    Raises
    ------
    InputError
        The radius or the units are missing; coordinates are polar; a vector is not a unit vector;
        an alignment, or another statement that changes what the points are, is among the
        touches; every point equals its nominal; there is no touch.

    >>> text = b"P1 =FEAT/POINT,CARTESIAN\nTHEO/<0,0,5>,<0,0,1>\nACTL/<0,0,5.01>,<0,0,1>\n"
    >>> read_pc_dmis(SourceFile("a.txt", text), 3.0, "mm").touches.positions.round(6).tolist()
    [[0.0, 0.0, 8.01]]
    """
    file = opened(source)
    lines = file.lines("a measurement routine of PC-DMIS")
    routine = _Routine(file)
    for number, statement in _statements(lines):
        routine.read_statement(statement, number)
    routine.close_feature()
    _check(file, routine)
    compensated, line = routine.compensated or (None, 0)
    if compensated is False and radius_taken_off is None:
        radius_taken_off = 0.0
    radius = checked_radius_taken_off(file, "the text of a routine of PC-DMIS", radius_taken_off)
    if compensated is not None:
        refuse_other_compensation(file, radius, line, compensated=compensated)
    scale = file.scale(routine.unit_with(units), "the text of a routine does not give its units")
    return FileReadings(_touches(file, routine, scale, radius), warnings=_warnings(routine, scale))


@dataclass
class _Feature:
    """A feature while its lines are read: values of THEO and ACTL, and touches from its hits."""

    label: str
    kind: str
    line: int
    values: dict[str, tuple[list[float], int]] = field(default_factory=dict)
    hits: list[tuple[list[float], int]] = field(default_factory=list)
    held: list[dict[str, str]] = field(default_factory=list)
    at: dict[str, str] = field(default_factory=dict)
    touched: bool = True

    @property
    def is_complete(self) -> bool:
        """Whether its touches are read."""
        return bool(self.hits) or "ACTL" in self.values


@dataclass
class _Routine:
    """What was read of a routine so far.

    Attributes
    ----------
    touches : list of label, nominal x, y, z, i, j, k and measured x, y, z, and line
    without_touches : labels of features
    stated : tip, frame … as the statements between the features say
    """

    file: SourceFile
    touches: list[tuple[str, list[float], int]] = field(default_factory=list)
    without_touches: list[str] = field(default_factory=list)
    feature: _Feature | None = None
    stated: StatedRows = field(init=False)
    compensated: tuple[bool, int] | None = None
    probe: str = ""
    probes: set[str] = field(default_factory=set)
    units: dict[bool, tuple[str, int]] = field(default_factory=dict)
    shanks: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.stated = StatedRows(self.file)

    def read_statement(self, statement: str, number: int) -> None:
        """Read one statement: a feature begins, its values, a hit; or what holds from here on."""
        if found := _UNIT.match(statement):
            unit = "mm" if found[2].upper() == "MM" else "inch"
            self.units.setdefault(bool(found[1]), (unit, number))
        known = _STATEMENTS.of(statement)
        if known is None or known[0].then != "harmless":
            changing = known is None and changes_rows(statement)
            complete = self.feature is not None and self.feature.is_complete
            if (known is not None and known[0].then == "refused") or (changing and complete):
                self.close_feature()
            self._hold(known, statement, number)
        elif is_note(statement):
            if changes_rows(statement):
                self.stated.unknown.append((number, statement))
            else:
                self.stated.note(statement, number)
        elif (found := _FEATURE.search(statement)) and (label := statement[: found.start()]):
            self.close_feature()
            kind = statement[found.end() :].strip()
            self.feature = _Feature(label.strip(), kind, number)
        elif self.feature is None:
            if _HIT.match(statement) and self.touches:
                self.stated.row(number)  # of a feature that a change of the coordinates cut off
                raise self.file.error("this hit belongs to no feature", number)
        elif _NO_TOUCH.match(statement):
            self.feature.touched = False
        elif found := _VALUES.match(statement):
            self.feature.values[found[1].upper()] = (self._numbers(found[2], number), number)
            self.feature.at = dict(self.stated.values)
        elif found := _HIT.match(statement):
            if "<" not in found[1] and "USE" not in found[1].upper():
                raise self.file.error("this hit is cut off: its USE THEO= is missing", number)
            self.feature.hits.append((self._numbers(found[1], number), number))
            self.feature.held.append(dict(self.stated.values))

    def _hold(self, known: tuple[RowStatement, str] | None, statement: str, number: int) -> None:
        """Keep what a statement between the features says."""
        if known is not None and known[0].means == "tip":
            if known[0].words == _LOADED:
                self.probe = known[1]
                self.probes.add(known[1])
                self.stated.state("tip", self.probe)
            else:
                self.stated.state("tip", f"{self.probe} {known[1]}".strip())
                self._keep_shank(known[1], statement, number)
            return
        if (found := _COMPENSATION.search(statement)) and not self.touches:
            self.compensated = found[1].upper() == "ON", number
        self.stated.take(known, statement, number)

    def _keep_shank(self, tip: str, statement: str, number: int) -> None:
        """Keep the direction of a shank that the name of its tip does not state, if not along z."""
        found = _SHANK.search(statement)
        if found is None or re.search(r"A-?0*[1-9]", tip):
            return
        shank = self._numbers(found[1], number)
        if abs(shank[2]) < _UPRIGHT * float(np.linalg.norm(shank)):
            self.shanks[tip] = f"{tip} along {found[1].strip(' ,')} (line {number})"

    def tips(self) -> dict[str, tuple[str, ...]]:
        """Words of the touches; the probe's name is left out where only one was loaded."""
        words = self.stated.columns()
        if "tip" in words and len(self.probes) < 2:
            mark = f"{self.probe} "
            words["tip"] = tuple(word.removeprefix(mark) for word in words["tip"])
        return words

    def unit_with(self, given: str | None) -> str | None:
        """The unit of the routine, which the user gives or a line of it.

        Raises
        ------
        InputError
            They differ.
        """
        own, line = self.units.get(False, (given, 0))
        if given not in (None, own):
            raise self.file.error(
                f"the file's units are {own}, the given ones {given}", line, inputs=("units",)
            )
        return own

    def _numbers(self, text: str, number: int) -> list[float]:
        if text.count("<") != text.count(">"):
            raise self.file.error("this line is cut off: a < without its >", number)
        cells = [cell.strip(" <>") for cell in text.split(",")]
        return self.file.numbers([cell for cell in cells if re.match(r"[-+.\d]", cell)], number)

    def close_feature(self) -> None:
        """Keep the touches of the feature whose lines have ended."""
        feature, self.feature = self.feature, None
        if feature is None:
            return
        found = self._touches_of(feature)
        if not found:
            self.without_touches.append(feature.label)
            return
        if re.search(r"\bPOLA?R\b", feature.kind, re.IGNORECASE):
            raise self.file.error(
                f"the feature {feature.label} is in polar coordinates; CARTESIAN is read",
                feature.line,
            )
        held = feature.held or [feature.at] * len(found)
        for (_, _, line), values in zip(found, held, strict=True):
            self.stated.row(line, values)
        self.touches += found

    def _touches_of(self, feature: _Feature) -> list[tuple[str, list[float], int]]:
        if feature.hits:
            for values, line in feature.hits:
                if len(values) != 9:
                    raise self._unclear(feature, f"a hit with {len(values)} numbers", line)
            several = len(feature.hits) > 1
            return [
                (f"{feature.label}-{row}" if several else feature.label, values, line)
                for row, (values, line) in enumerate(feature.hits, start=1)
            ]
        if not (feature.touched and _OF_ONE_TOUCH.match(feature.kind)):
            return []
        if "ACTL" not in feature.values or "THEO" not in feature.values:
            raise self._unclear(feature, "no THEO or no ACTL", feature.line)
        nominal, (measured, line) = feature.values["THEO"][0], feature.values["ACTL"]
        if len(nominal) != 6 or len(measured) != 6:
            raise self._unclear(feature, f"{len(nominal)} and {len(measured)} numbers", line)
        return [(feature.label, nominal + measured[:3], line)]

    def _unclear(self, feature: _Feature, what: str, line: int) -> InputError:
        return self.file.error(
            f"the feature {feature.label} has {what}; a point needs THEO/x,y,z,i,j,k and "
            "ACTL/x,y,z,i,j,k, a hit needs HIT/BASIC with nominal x,y,z,i,j,k and measured x,y,z",
            line,
        )


def _check(file: SourceFile, routine: _Routine) -> None:
    if not routine.touches:
        raise file.error(
            "the file contains no touches: no hits (HIT/BASIC) and no measured or vector point "
            "with THEO/ and ACTL/. Features alone cannot be compensated; let PC-DMIS show the hits "
            "before the routine is saved as text"
        )
    seen = set()
    for label, _, line in routine.touches:
        if label in seen:
            raise file.error(f"the point {label} occurs twice", line)
        seen.add(label)
    if all(values[:3] == values[6:] for _, values, _ in routine.touches):
        raise file.error(
            "every measured point equals its nominal point: the routine was not run on a machine, "
            "or the text was saved before"
        )


def _touches(file: SourceFile, routine: _Routine, scale: float, radius: float) -> Touches:
    labels = tuple(label for label, _, _ in routine.touches)
    lines = tuple(line for _, _, line in routine.touches)
    table = np.array([values for _, values, _ in routine.touches])
    normals = with_unit_normals(file, table[:, 3:6], labels, lines)
    with file.named_in_errors(lines):
        return Touches(
            positions=scale * table[:, 6:] + radius * normals,
            normals=normals,
            labels=labels,
            nominal_points=scale * table[:, :3],
            source=file.name,
            lines=lines,
            **word_fields(routine.tips()),
        )


def _warnings(routine: _Routine, scale: float) -> tuple[str, ...]:
    others, unknown = routine.without_touches, routine.stated.warnings()
    unit, line = routine.units.get(True, ("", 0))
    if unit and UNITS[unit] != scale:
        taken = "mm" if unit == "inch" else "inch"
        said = f"line {line} gives a dimension in {unit}; the points were taken in {taken}"
        unknown = (said, *unknown)
    if routine.shanks:
        held = f"the shank is not along z: {', '.join(routine.shanks.values())}"
        unknown = (
            *unknown,
            f"{held}: this is not kept. Use a map of the probe as it is held there",
        )
    if not others:
        return unknown
    shown = ", ".join(others[:_SHOWN]) + ("…" if len(others) > _SHOWN else "")
    what = "features without hits, constructed or read without a touch are left out"
    return (f"{len(others)} {what}: {shown}", *unknown)


def _statements(lines: list[str]) -> list[tuple[int, str]]:
    """Return line numbers and statements; a line ending in $ continues, and a comment in a comma.

    Empty lines are skipped, so that doubled line ends do no harm.
    """
    statements: list[tuple[int, str]] = []
    before = ""
    first = 0
    for number, text in enumerate(lines, start=1):
        line = text.strip()
        if not line:
            continue
        if before and is_note(before) and "/" in line:  # a statement, no text of the comment
            statements.append((first, before))
            before = ""
        first = first if before else number
        if line.endswith("$"):
            before += line[:-1].rstrip()
            continue
        if is_note(line) and line.endswith(","):
            before = f"{line} "
            continue
        statements.append((first, before + line))
        before = ""
    return statements + [(first, before)] * bool(before)


def _is_pc_dmis(lines: list[str]) -> bool:
    return any(_FEATURE.search(line) for line in lines) and any(
        _VALUES.match(line) for line in lines
    )


PC_DMIS = FileFormat(
    name="pcdmis",
    what="measurement routine of PC-DMIS as text: THEO/, ACTL/, HIT/BASIC",
    reads="touches",
    needs="units, subtracted radius",
    takes=("radius_taken_off",),
    verified=(
        "the syntax of the maker's documentation and of public routines; no routine that was run"
    ),
    recognises=_is_pc_dmis,
    parse=lambda file, options: read_pc_dmis(file, options.radius_taken_off, options.units),
    statements=_TABLE,
    other_lines="named",
)
