"""DMIS (ISO 22093): measured points, ``FA(label)=FEAT/POINT,CART,x,y,z,i,j,k``; reading."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np

from pretravel.base import FloatArray
from pretravel.files.file_format import FileFormat, FileReadings
from pretravel.files.row_statements import RowStatement, RowStatements, StatedRows, any_of
from pretravel.files.source_file import Source, SourceFile, opened
from pretravel.touches import Touches, word_fields

_POINT = re.compile(r"^(FA?)\s*\(([^)]+)\)\s*=\s*FEAT\s*/\s*POINT\s*,(.*)$", re.I)
_FEATURE = re.compile(r"^FA\s*\(([^)]+)\)\s*=\s*FEAT\s*/\s*(\w+)", re.I)
_MEASURED = re.compile(r"FA?\s*\([^)]*\)\s*=\s*FEAT\s*/", re.I)
_PC_DMIS = re.compile(r"^\w+\s*=\s*FEAT/POINT", re.I)
_UNITS = re.compile(r"^UNITS\s*/\s*(\w+)", re.I)
_UNIT_NAMES = {"MM": "mm", "INCH": "inch"}
_LABEL = r"(?:\w+\s*\([^)]*\)\s*=\s*)?"
"""The label of a statement, where it has one: D(1)=."""
_COMPENSATED = re.compile(r"PRCOMP\s*/\s*(ON|OFF)\b", re.I)
_SENSOR = re.compile(r"SA?\s*\(([^)]*)\)\s*=\s*SNSDEF\b(.*)", re.I)
_TABLE = (
    RowStatement(
        "`S(name)=SNSDEF/` (its diameter is compared)", _SENSOR.pattern, then="named",
        example="S(T1)=SNSDEF/PROBE,INDEX,POL,0,0,0,0,1,100,6",
    ),
    RowStatement(
        "`SNSLCT/`, `SA(name)`", r"SNSLCT\s*/\s*(.+)|SA?\s*\(([^)]*)\)", "tip", "carried",
        "SNSLCT/SA(TIP_2)",
    ),
    RowStatement(
        "`DATSET/`, `D(name)=`, `DA(name)=`", r"(DA?\s*\([^)]*\).*|DATSET\b.*)", "frame", "refused",
        "D(2)=DATSET/MCS",
    ),
    RowStatement(
        "`RECALL/`, `TRANS/`, `ROTATE/`, `LOCATE/`, `EQUATE/`, `TRMATX/`, `ROTAB/`, `ROTSET/`, "
        "`CRSLCT/`",
        _LABEL + any_of(
            "RECALL TRANS ROTATE LOCATE EQUATE TRMATX ITERAT BESTFIT BFIT MATRIX ROTAB ROTSET "
            "CRSLCT"
        ) + r"(.*)",
        "frame", "refused", "RECALL/DA(1)",
    ),
    RowStatement("`UNITS/`", r"UNITS\s*/\s*(\w+)", "unit", "refused", "UNITS/INCH"),
    RowStatement(
        "`TECOMP/`, `SCALEF/`", any_of("TECOMP SCALEF TEMPCOMP") + "(.*)", "unit", "refused",
        "TECOMP/MACH,ON",
    ),
    RowStatement(
        "`PRCOMP/`, `CALIB/`", any_of("PRCOMP FRCOMP PROBECOMP CMPNTGRP CALIB") + "(.*)",
        "radius", "refused", "PRCOMP/OFF",
    ),
    RowStatement(
        "`FILNAM/` again, and what follows `ENDFIL`", r"(FILNAM\s*/.*|ENDFIL\b)", "part", "refused",
        "FILNAM/'B',05.2", event=True,
    ),
    RowStatement(
        "`PN()=`, `PS()=PARTSN/` again",
        r"((?:P[NSR]|LI|DI)\s*\([^)]*\).*|PART(?:ID|SN|RV)\s*/.*)", "part", "refused",
        "PS(S2)=PARTSN/'0002'",
    ),
    RowStatement(
        "`FEDRAT/MESVEL`", r"(FEDRAT\s*/\s*MESVEL.*)", "pass", "carried", "FEDRAT/MESVEL,MMPS,2"
    ),
    RowStatement(
        "`FEDRAT/`, `ACLRAT/`, `MODE/`, `GOTO/`, `SNSET/`, `WKPLAN/`, `CLRSRF/`, `DECPL/` …",
        any_of(
            "FINPOS FEDRAT ACLRAT MODE GOTO GOHOME WKPLAN CLRSRF DECPL PRCMPS BADTST ERROR CZONE "
            "CZSLCT RAPID DEPTH RETRCT APPRCH SEARCH FLY GEOALG GEOM SNSET THLDEF WRIST"
        ),
        example="GOTO/0,0,50",
    ),
    RowStatement(
        "`F(name)=` and `FA(name)=` of features, `T()=`, `TA()=TOL/`, `R()=REPORT/` …",
        r"(?:FA?|TA?|KC|QISDEF|MSA?|RA?|V|G|CR?|DV|ST|RT|OP|MD|PV|TL|EN|CC|CS|FS)\s*\(",
        example="TA(T1)=TOL/CORTOL,XAXIS,0.002,INTOL",
    ),
    RowStatement(
        "`MEAS/`, `PTMEAS/`, `ENDMES`, `OUTPUT/`, `EVAL/`",
        any_of("MEAS RMEAS PTMEAS ENDMES OUTPUT EVAL CONST BOUND PTBUFF PTDATA RAWDAT"),
        example="ENDMES",
    ),
    RowStatement(
        "comments, `TEXT/`, `DISPLY/`, `DATE/`, `TIME/`, `DMISMN/`",
        r"\$\$|" + any_of(
            "TEXT DISPLY VFORM DMISMN DMISMD DMESW DMESWI DMESWV DMEHW DMEID DATE TIME "
            "PRINT END ENDAT DID CLDEF INCLUD XTERN XTRACT CALL SELECT DECL ASSIGN LOTID OPERID "
            "OPEN CLOSE"
        ),
        example="TEXT/OUTFIL,'a note'",
    ),
)  # fmt: skip
_STATEMENTS = RowStatements(_TABLE)
_ROUNDED = 5e-3
"""Normals are printed with few decimals; they are scaled to length one."""
_ONE_TIP = 0.18
"""A nominal and a qualified diameter of one tip differ by less. [mm]"""
_SHOWN = 8
"""Most features that a message names."""


def read_dmis(
    source: Source, radius_taken_off: float | None = None, units: str | None = None
) -> FileReadings:
    r"""Read touches from the measured points of a DMIS output file.

    Parameters
    ----------
    source : str, Path or SourceFile
    radius_taken_off : float
        Radius that was subtracted from the points along their normals: 0 for tip centres, the
        tip's (qualified) radius for surface points. Needed where the file does not state it, by
        PRCOMP and the diameter of the sensor. [mm]
    units : str, optional
        mm or inch, where the file has no UNITS.

    Returns
    -------
    FileReadings
        Tip centres, with nominal points where every point has its ``F(label)``.

    Raises
    ------
    InputError
        The radius or the units are missing; a point is not cartesian; a normal is not a unit
        vector; a label occurs twice. The message contains the line.

    >>> text = b"UNITS/MM, ANGDEC\nFA(P1)=FEAT/POINT,CART,0,0,$\n0.01,0,0,1\n"
    >>> read_dmis(SourceFile("out.dmo", text), 3.0).touches.positions.tolist()
    [[0.0, 0.0, 3.01]]
    """
    return _read(opened(source), radius_taken_off, units)


def _read(
    file: SourceFile, radius_taken_off: float | None, units: str | None, tip: str | None = None
) -> FileReadings:
    """Read the file, of whose tips one is chosen, perhaps."""
    lines = file.lines("a DMIS file")
    output = _Output(file, units)
    for number, statement in statements(lines):
        output.read_statement(statement, number)
    if not output.actual:
        raise file.error(_without_points(output))
    scale = file.scale(output.units, "the file has no UNITS")
    radius_taken_off = _radius_taken_off(output, scale, radius_taken_off, tip)
    missed = tuple(label for label in output.nominal if label not in output.actual)
    return FileReadings(
        _touches(output, scale, radius_taken_off), missed=missed, warnings=_warnings(output)
    )


def checked_radius_taken_off(file: SourceFile, what: str, radius: float | None) -> float:
    """Return the radius that the user states, in mm.

    Parameters
    ----------
    file : SourceFile
    what : str
        What the file is, for the message: "a DMIS file".
    radius : float or None
        [mm]

    Raises
    ------
    InputError
        The radius is missing, or is no radius.
    """
    if radius is None:
        raise file.error(
            f"{what} does not say whether the tip's radius was subtracted from its points; give "
            "the subtracted radius: 0 for tip centres, or the radius in mm",
            inputs=("radius_taken_off",),
        )
    if not 0.0 <= radius < 1000.0:
        raise file.error(
            f"the subtracted radius is {radius:g}; a radius in mm, or 0, is needed",
            inputs=("radius_taken_off",),
        )
    return radius


def refuse_other_compensation(
    file: SourceFile, radius: float, line: int, *, compensated: bool, statement: str = ""
) -> None:
    """Refuse a subtracted radius that a statement of the file contradicts.

    Parameters
    ----------
    file : SourceFile
    radius : float
        As the user gives it. [mm]
    line : int
        Of the statement.
    compensated : bool
        Whether, by the statement, the tip's radius was subtracted.
    statement : str
        The beginning of the message.

    Raises
    ------
    InputError
        It was subtracted and the radius is 0, or the reverse.
    """
    if compensated != (radius > 0.0):
        raise file.error(
            f"{statement}the tip's radius was {'' if compensated else 'not '}subtracted from the "
            f"points, and a subtracted radius of {radius:g} mm is given",
            line,
            inputs=("radius_taken_off",),
        )


def _without_points(output: _Output) -> str:
    """The refusal of a file without measured points."""
    if output.features:
        return (
            f"the file contains features ({_shown(output.features)}), but no measured point, "
            "FA(label)=FEAT/POINT,CART,…: no touches can be made of features. Let the program "
            "output its points, each measured as a FEAT/POINT"
        )
    return (
        "the file contains no measured point, FA(label)=FEAT/POINT,CART,…: is this a program, "
        "rather than its output?"
    )


def _warnings(output: _Output) -> tuple[str, ...]:
    unknown = output.stated.warnings()
    if not output.features:
        return unknown
    left = f"features are left out, because they are not touches: {_shown(output.features)}"
    return (left, *unknown)


def _shown(features: list[str]) -> str:
    return ", ".join(features[:_SHOWN]) + ("…" if len(features) > _SHOWN else "")


@dataclass
class _Output:
    """What was read of an output file so far: points x, y, z, i, j, k by label, lines, features."""

    file: SourceFile
    units: str | None
    nominal: dict[str, list[float]] = field(default_factory=dict)
    actual: dict[str, list[float]] = field(default_factory=dict)
    lines: dict[str, int] = field(default_factory=dict)
    features: list[str] = field(default_factory=list)
    sensors: dict[str, tuple[float, int]] = field(default_factory=dict)
    compensated: tuple[bool, int] | None = None
    stated: StatedRows = field(init=False)

    def __post_init__(self) -> None:
        self.stated = StatedRows(self.file)

    def read_statement(self, statement: str, number: int) -> None:
        """Read one statement: units, a point, or what holds from here on."""
        if _PC_DMIS.match(statement):
            raise self.file.error(
                "this is a report of PC-DMIS, not DMIS (FA(label)=FEAT/POINT,…)", number
            )
        if found := _UNITS.match(statement):
            self._read_units(found[1], number)
        elif found := _POINT.match(statement):
            label, cells = found[2].strip(), found[3].split(",")
            self._read_point(found[1].upper(), label, cells, number)
        elif found := _FEATURE.match(statement):
            self.features.append(f"{found[1].strip()} {found[2].upper()}")
        else:
            self._hold(_STATEMENTS.of(statement), statement, number)

    def _hold(self, known: tuple[RowStatement, str] | None, statement: str, number: int) -> None:
        """Keep what a statement between the points says."""
        if defined := _SENSOR.match(statement):
            cells = [cell.strip() for cell in defined[2].split(",")]
            numbers = [cell for cell in cells if re.match(r"[-+.\d]", cell)]
            if numbers:  # the last one is the diameter of the tip
                diameter = self.file.numbers(numbers[-1:], number)[0]
                self.sensors[defined[1].strip()] = (diameter, number)
        if (found := _COMPENSATED.match(statement)) and not self.actual:
            self.compensated = found[1].upper() == "ON", number
        if known is not None and known[0].means == "tip":
            inside = re.search(r"\(([^)]*)\)", statement)
            rest = statement.partition(")")[2].strip(" ,") if "SNSLCT" in statement.upper() else ""
            name = inside[1].strip() if inside else known[1]
            self.stated.state("tip", f"{name} {rest}".strip())
            return
        self.stated.take(known, statement, number)

    def _read_units(self, name: str, number: int) -> None:
        own = _UNIT_NAMES.get(name.upper())
        if own is None:
            raise self.file.error(f"the units are {name}; MM and INCH are read", number)
        if self.units not in (None, own):
            raise self.file.error(
                f"the file's units are {own}, the given ones {self.units}",
                number,
                inputs=("units",),
            )
        self.units = own

    def _read_point(self, kind: str, label: str, cells: list[str], number: int) -> None:
        system = cells[0].strip()
        if system.upper() != "CART":
            raise self.file.error(f"the point {label} is given in {system}; CART is read", number)
        values = self.file.numbers([cell.strip() for cell in cells[1:]], number)
        if len(values) != 6:
            raise self.file.error(
                f"the point {label} has {len(values)} numbers; x, y, z, i, j, k are needed", number
            )
        if kind == "F":
            self.nominal[label] = values
            return
        if label in self.actual:
            raise self.file.error(f"the point {label} occurs twice", number)
        self.stated.row(number)
        self.actual[label] = values
        self.lines[label] = number


def _radius_taken_off(output: _Output, scale: float, given: float | None, tip: str | None) -> float:
    """The subtracted radius: the given one, or that of the file; refused if they differ. [mm]"""
    tips = {*output.stated.columns().get("tip", ())} if tip is None else {tip}
    name = tips.pop() if len(tips) == 1 else ""
    diameter, line = output.sensors.get(name, (0.0, 0))
    compensated, of_compensation = output.compensated or (None, 0)
    output.stated.named = [one for one in output.stated.named if one[0] != line]
    if given is None and compensated is False:
        return 0.0
    if given is None and compensated and line:
        return 0.5 * scale * diameter
    if given is None and compensated:
        raise output.file.error(
            "PRCOMP/ON: the tip's radius was subtracted from the points; give this radius in mm",
            of_compensation,
            inputs=("radius_taken_off",),
        )
    radius = checked_radius_taken_off(output.file, "a DMIS file", given)
    if compensated is not None:
        statement = f"PRCOMP/{'ON' if compensated else 'OFF'}: "
        refuse_other_compensation(
            output.file, radius, of_compensation, compensated=compensated, statement=statement
        )
    if radius > 0.0 and line and abs(scale * diameter - 2.0 * radius) > _ONE_TIP:
        raise output.file.error(
            f"this line gives the tip {name} a diameter of {scale * diameter:.6g} mm, and a "
            f"subtracted radius of {radius:.6g} mm is used: one of them is wrong",
            line,
            inputs=("radius_taken_off",),
        )
    return radius


def _touches(output: _Output, scale: float, radius_taken_off: float) -> Touches:
    file, labels = output.file, tuple(output.actual)
    table = np.array(list(output.actual.values()))
    lines = tuple(output.lines.values())
    normals = with_unit_normals(file, table[:, 3:], labels, lines)
    nominal_points: FloatArray | None = None
    if all(label in output.nominal for label in labels):
        nominal_points = scale * np.array([output.nominal[label][:3] for label in labels])
    with file.named_in_errors(lines):
        return Touches(
            positions=scale * table[:, :3] + radius_taken_off * normals,
            normals=normals,
            labels=labels,
            nominal_points=nominal_points,
            source=file.name,
            lines=lines,
            **word_fields(output.stated.columns()),
        )


def with_unit_normals(
    file: SourceFile, vectors: FloatArray, labels: tuple[str, ...], lines: tuple[int, ...]
) -> FloatArray:
    """Return vectors i, j, k scaled to length one, (n, 3).

    Parameters
    ----------
    file : SourceFile
    vectors : (n, 3) float
    labels : n str
    lines : n int

    Raises
    ------
    InputError
        The length of a vector differs from one by more than its last printed digits.
    """
    lengths = np.linalg.norm(vectors, axis=1)
    for label, length, line in zip(labels, lengths.tolist(), lines, strict=True):
        if abs(length - 1.0) > _ROUNDED:
            raise file.error(
                f"point {label}: i, j, k has length {length:.4g}; the unit normal is needed (some "
                "systems write zeros, or angles, there)",
                line,
            )
    return np.asarray(vectors / lengths[:, None])


def statements(lines: list[str]) -> list[tuple[int, str]]:
    """Return line numbers and statements; a line that ends in $ continues, a comment ($$) does not.

    Empty lines are skipped, so that doubled line ends do no harm.
    """
    statements: list[tuple[int, str]] = []
    begun: tuple[int, str] | None = None
    for number, text in enumerate(lines, start=1):
        line = text.strip()
        if line.startswith("$$"):
            statements.append((number, line))
            continue
        if not line:
            continue
        first, before = begun or (number, "")
        whole = before + line
        begun = None
        if whole.endswith("$"):
            begun = (first, whole[:-1].rstrip())
        else:
            statements.append((first, whole))
    if begun is not None:
        statements.append(begun)
    return statements


DMIS = FileFormat(
    name="dmis",
    what="DMIS: FA(…)=FEAT/POINT,CART,… (.dmo)",
    reads="touches",
    needs="subtracted radius",
    takes=("radius_taken_off",),
    verified="the syntax of public files of two systems",
    recognises=lambda lines: any(_MEASURED.match(line) for line in lines),
    parse=lambda file, options: _read(file, options.radius_taken_off, options.units, options.tip),
    statements=_TABLE,
    other_lines="named",
)
