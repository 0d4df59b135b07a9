"""PC-DMIS: a measurement routine as text, with THEO/ and ACTL/ of its points and hits; reading."""

from __future__ import annotations

import re
from dataclasses import dataclass, field

import numpy as np

from pretravel.base import InputError
from pretravel.files.file_format import FileFormat, FileReadings
from pretravel.files.logs.dmis import checked_radius_taken_off, with_unit_normals
from pretravel.files.source_file import Source, SourceFile, opened
from pretravel.touches import Touches

_FEATURE = re.compile(r"=\s*(?:FEAT|AUTO)\s*/", re.IGNORECASE)
"""Stands between the label of a feature and its kind."""
_VALUES = re.compile(r"^(THEO|ACTL)\s*/\s*(.*)$", re.IGNORECASE)
_HIT = re.compile(r"^HIT\s*/\s*(.*)$", re.IGNORECASE)
_ALIGNMENT = re.compile(r"(?:=\s*ALIGNMENT/START|^RECALL/ALIGNMENT)", re.IGNORECASE)
_NO_TOUCH = re.compile(r"^(?:READPOINT|CONSTR)\b", re.IGNORECASE)
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
        an alignment stands among the touches; every point equals its nominal; there is no touch.

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
    radius = checked_radius_taken_off(file, "the text of a routine of PC-DMIS", radius_taken_off)
    scale = file.scale(units, "the text of a routine does not state its units")
    return FileReadings(_touches(file, routine, scale, radius), warnings=_warnings(routine))


@dataclass
class _Feature:
    """A feature while its lines are read: values of THEO and ACTL, and touches from its hits."""

    label: str
    kind: str
    line: int
    values: dict[str, tuple[list[float], int]] = field(default_factory=dict)
    hits: list[tuple[list[float], int]] = field(default_factory=list)
    touched: bool = True


@dataclass
class _Routine:
    """What was read of a routine so far.

    Attributes
    ----------
    touches : list of label, nominal x, y, z, i, j, k and measured x, y, z, and line
    without_touches : labels of features
    alignment : line of an alignment after a touch
    """

    file: SourceFile
    touches: list[tuple[str, list[float], int]] = field(default_factory=list)
    without_touches: list[str] = field(default_factory=list)
    feature: _Feature | None = None
    alignment: int | None = None

    def read_statement(self, statement: str, number: int) -> None:
        """Read one statement: a feature begins, its values, a hit, an alignment."""
        if _ALIGNMENT.search(statement):
            self.close_feature()
            self.alignment = number if self.touches else None
        elif (found := _FEATURE.search(statement)) and (label := statement[: found.start()]):
            self.close_feature()
            kind = statement[found.end() :].strip()
            self.feature = _Feature(label.strip(), kind, number)
        elif self.feature is None:
            return
        elif _NO_TOUCH.match(statement):
            self.feature.touched = False
        elif found := _VALUES.match(statement):
            self.feature.values[found[1].upper()] = (self._numbers(found[2], number), number)
        elif found := _HIT.match(statement):
            if "<" not in found[1] and "USE" not in found[1].upper():
                raise self.file.error("this hit is cut off: its USE THEO= is missing", number)
            self.feature.hits.append((self._numbers(found[1], number), number))

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
        if self.alignment is not None:
            raise self.file.error(
                "an alignment stands among the touches: those before and after it have different "
                "coordinates. Split the file there",
                self.alignment,
            )
        if re.search(r"\bPOLA?R\b", feature.kind, re.IGNORECASE):
            raise self.file.error(
                f"the feature {feature.label} is in polar coordinates; CARTESIAN is read",
                feature.line,
            )
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
        )


def _warnings(routine: _Routine) -> tuple[str, ...]:
    others = routine.without_touches
    if not others:
        return ()
    shown = ", ".join(others[:_SHOWN]) + ("…" if len(others) > _SHOWN else "")
    what = "features without hits, constructed or read without a touch are left out"
    return (f"{len(others)} {what}: {shown}",)


def _statements(lines: list[str]) -> list[tuple[int, str]]:
    """Return line numbers and statements; a line that ends in $ continues.

    Empty lines are skipped, so that doubled line ends do no harm.
    """
    statements: list[tuple[int, str]] = []
    before = ""
    first = 0
    for number, text in enumerate(lines, start=1):
        line = text.strip()
        if not line:
            continue
        first = first if before else number
        if line.endswith("$"):
            before += line[:-1].rstrip()
            continue
        statements.append((first, before + line))
        before = ""
    return statements


def _is_pc_dmis(lines: list[str]) -> bool:
    return any(_FEATURE.search(line) for line in lines) and any(
        _VALUES.match(line) for line in lines
    )


PC_DMIS = FileFormat(
    name="pcdmis",
    what="measurement routine of PC-DMIS as text: THEO/, ACTL/, HIT/BASIC",
    reads="touches",
    needs="units, radius taken off",
    verified="the maker's documentation and public routines: their form; no routine that was run",
    recognises=_is_pc_dmis,
    parse=lambda file, options: read_pc_dmis(file, options.radius_taken_off, options.units),
)
