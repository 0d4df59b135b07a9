"""Fusion inspection results: G800 nominal, G801 measured tip centre, between START and END."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from pretravel.base import DEGREE, FloatArray, PretravelError, turned_about_axes, whole_file
from pretravel.files.csv_table import exact_number
from pretravel.files.file_format import FileFormat, FileReadings, PointsOrigin, labels_or_numbers
from pretravel.files.logs.plain_labels import plain_labels, plain_name
from pretravel.files.row_statements import RowStatement, RowStatements, StatedRows, any_of
from pretravel.files.source_file import Source, SourceFile, opened
from pretravel.files.words_of_lines import units_in_text
from pretravel.touches import Touches, word_fields

if TYPE_CHECKING:
    from pretravel.measurement import Points

_WORD = re.compile(r"([A-DI-LN-OR-UW-Z])([+-]?(?:\d+(?:\.\d*)?|\.\d+))")
_ROUNDED = 5e-3
"""Normals are printed with four decimals or fewer; they are scaled to length one."""
_LABEL = ";LABEL "
_WITHOUT = "; PRETRAVEL COMPENSATED"
"""Above compensated points, so that they are not compensated again."""
_TABLE = (
    RowStatement(
        "`START` … `END`, `RESULTSFILE`", r"(START|END|RESULTSFILE.*)$", "part", "carried",
        "RESULTSFILE B",
    ),
    RowStatement("`TOOLPATHID`", r"TOOLPATHID.*", example="TOOLPATHID 13"),
    RowStatement("`G330` (applied)", r"G330\b.*", example="G330 N1 A0. B0. C0. X0 Y0 Z0 I0 R0"),
    RowStatement("`G802`", r"G80[012]\b.*", then="named", example="G802 N1 X0.1 Y0 Z0"),
    RowStatement(
        "`T` number, `TOOL`", r"(?:TOOL\w*|T)\s*#?[:=]?\s*(\w+)\s*(?:M0?6)?$", "tip", "carried",
        "T2 M6",
    ),
    RowStatement(
        "`G54` …, `G52`, `G68`, `G10`, `G92`, `WCS`",
        "(" + any_of("G52 G53 G54 G55 G56 G57 G58 G59 G68 G69 G10 G92 G43 WCS WORKOFFSET") + ".*)",
        "frame", "refused", "G55",
    ),
    RowStatement(
        "`G20`, `G21`, `UNITS`", "(" + any_of("G20 G21 G70 G71 UNIT UNITS") + ".*)", "unit",
        "refused", "G20",
    ),
    RowStatement(
        "`PARTID`, `SERIAL`", r"(?:PART\w*|SERIAL\w*|SN)\b\s*[:=]?\s*(.*)", "part", "carried",
        "PARTID 2",
    ),
    RowStatement(
        "comments, `DATE`, `TIME`, `PROGRAM`",
        r"[;(%]|O\d|N\d+$|" + any_of("DATE TIME PROGRAM MODEL VERSION DOCUMENT MACHINE"),
        example="(a note)",
    ),
)  # fmt: skip
_STATEMENTS = RowStatements(_TABLE)


def read_fusion(source: Source, units: str | None = None) -> FileReadings:
    r"""Read touches from a results file of Fusion's inspection programs.

    Parameters
    ----------
    source : str, Path or SourceFile
    units : str
        mm or inch, where no line above the points states it.

    Returns
    -------
    FileReadings
        Tip centres, nominal points and normals in work coordinates (the rotation of G330 is
        applied). A G800 without its G801 is a miss. The control has removed the eccentricity, but
        no radius. G802 is not read: its sign differs between posts.

    Raises
    ------
    InputError
        The units are missing; a letter occurs twice or is missing; a number cannot be read; a
        G801 belongs to another N; a point follows END; there is no point. The message contains
        the line.

    >>> text = b"START\nG800 N1 X0 Y0 Z0 I0 J0 K1\nG801 N1 X0 Y0 Z2.99 R3\nEND\n"
    >>> read_fusion(SourceFile("results.txt", text), "mm").touches.positions.tolist()
    [[0.0, 0.0, 2.99]]
    """
    file = opened(source)
    lines = file.lines("a results file of Fusion")
    results = _Results(file, file.scale(_units(file, lines, units), _NO_UNITS))
    for number, text in enumerate(lines, start=1):
        results.read_line(text.replace("*", " ").strip(), number)
    results.close_point()
    _check_labels(file, results.points)
    return FileReadings(
        _touches(file, results),
        missed=tuple(results.missed),
        warnings=_warnings(results),
        tip_radius=results.radii.pop() if len(results.radii) == 1 else None,
    )


_NO_UNITS = "the results file does not give its units"
_READ = {"G330": "NABC", "G800": "NXYZIJKUL", "G801": "NXYZR"}
"""Letters of each line that are read, or give the tolerance of a deviation, U and L."""
_OF_SIEMENS = {"G70": "G20", "G71": "G21"}


def _units(file: SourceFile, lines: Sequence[str], units: str | None) -> str | None:
    """The units that a line above the points gives, or those that are given."""
    for number, line in enumerate(lines, start=1):
        word = line.strip()[:4].upper()
        if word in ("G800", "G801"):
            break
        if line.startswith(_LABEL):
            continue
        for own in units_in_text([_OF_SIEMENS.get(line.strip().upper(), line)]):
            if units not in (None, own):
                raise file.error(f"the file is in {own}, but {units} was given", number,
                                 inputs=("units",))  # fmt: skip
            units = own
    return units


@dataclass(frozen=True, eq=False)
class _Nominal:
    """A nominal point: a G800."""

    label: str
    line: int
    words: dict[str, float]


@dataclass(frozen=True, eq=False)
class _Measured:
    """A measured point: a G801 with its G800, in work coordinates and mm."""

    label: str
    line: int
    center: FloatArray
    normal: FloatArray
    nominal: FloatArray
    tip_radius: float
    part: str


@dataclass
class _Results:
    """What was read of a results file so far."""

    file: SourceFile
    scale: float
    points: list[_Measured] = field(default_factory=list)
    missed: list[str] = field(default_factory=list)
    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    toolpath: str = ""
    next_label: str = ""
    nominal: _Nominal | None = None
    complete: bool = True
    after_end: bool = False
    sets: int = 0
    names: dict[int, str] = field(default_factory=dict)
    name: str = ""
    named_before: bool = False
    unread: dict[str, int] = field(default_factory=dict)
    stated: StatedRows = field(init=False)

    def __post_init__(self) -> None:
        self.stated = StatedRows(self.file, of_centres=True)

    @property
    def radii(self) -> set[float]:
        """The tip radii that the points state. [mm]"""
        return {round(p.tip_radius, 6) for p in self.points if np.isfinite(p.tip_radius)}

    def read_line(self, line: str, number: int) -> None:
        """Read one line: start, end, toolpath, label, rotation, nominal or measured point."""
        if line.upper().startswith("TOOLPATHID"):
            self.toolpath = line[10:].strip()
        elif line.startswith(_LABEL):
            self.next_label = line[len(_LABEL) :].strip()
            return
        code = line[:4].upper()
        if code not in ("G330", "G800", "G801"):
            self._read_statement(line, number)
            return
        if self.after_end:
            raise self.file.error("a point after END", number)
        words = _words(self.file, line[4:], number)
        for letter, value in words.items():
            if letter not in _READ[code] and value != 0.0:
                self.unread.setdefault(f"{letter} of {code}", number)
        if code == "G330":
            angles = (words.get(letter, 0.0) * DEGREE for letter in "ABC")
            self.rotation = turned_about_axes(*angles)
        elif code == "G800":
            self.open_point(words, number)
        else:
            self.measure_point(words, number)

    def _read_statement(self, line: str, number: int) -> None:
        """Read a line that is not a point: a set begins or ends, a tool, a part …."""
        known = _STATEMENTS.of(line) if line else (_STATEMENTS.table[-1], "")
        if known is None or known[0].means != "part" or known[0].then != "carried":
            self.stated.take(known, line, number)
            return
        word = line.split()[0].upper()
        if word not in ("START", "END", "RESULTSFILE"):
            self.stated.state("part", known[1])
            return
        self.close_point()
        if word == "END":
            self.complete = self.after_end = True
            return
        if word == "START":
            self.complete, self.after_end, self.rotation = False, False, np.eye(3)
            self.sets += 1
            if not self.named_before:
                self.name = ""
        else:
            self.name = line[len(word) :].strip()
        self.named_before = word == "RESULTSFILE"
        again = self.name in [name for number, name in self.names.items() if number < self.sets]
        self.names[self.sets] = self.name
        own = self.name if self.name and not again else f"{self.name} set {self.sets}".strip()
        self.stated.state("part", own)

    def open_point(self, words: dict[str, float], number: int) -> None:
        """Read a G800: the nominal point of the next measurement."""
        self.close_point()
        _need(self.file, words, "NXYZIJK", "G800", number)
        numbered = f"{self.toolpath}-{words['N']:g}" if self.toolpath else f"{words['N']:g}"
        self.nominal = _Nominal(self.next_label or numbered, number, words)
        self.next_label = ""

    def close_point(self) -> None:
        """End the nominal point: it is a miss if no G801 followed."""
        if self.nominal is not None:
            self.missed.append(self.nominal.label)
        self.nominal = None

    def measure_point(self, words: dict[str, float], number: int) -> None:
        """Read a G801: the measured tip centre of the nominal point."""
        _need(self.file, words, "NXYZ", "G801", number)
        target = self.nominal
        if target is None:
            raise self.file.error("a G801 without a G800 before it", number)
        if words["N"] != target.words["N"]:
            raise self.file.error(
                f"G801 is of point {words['N']:g}, the G800 before it (line {target.line}) of "
                f"{target.words['N']:g}",
                number,
            )
        normal = np.array([target.words[letter] for letter in "IJK"])
        length = float(np.linalg.norm(normal))
        if abs(length - 1.0) > _ROUNDED:
            raise self.file.error(
                f"the normal I J K has length {length:.4g}; it must be a unit vector", target.line
            )
        radius = self.scale * words.get("R", np.nan)
        tip = f"R{radius:.6g}" if np.isfinite(radius) else ""
        stated = self.stated.values.get("tip", "")
        self.stated.row(number, {**self.stated.values, "tip": f"{stated} {tip}".strip()})
        nominal = self.scale * np.array([target.words[letter] for letter in "XYZ"])
        center = self.scale * np.array([words[letter] for letter in "XYZ"])
        self.points.append(
            _Measured(
                target.label,
                number,
                self.rotation @ center,
                self.rotation @ (normal / length),
                self.rotation @ nominal,
                radius,
                self.stated.values.get("part", ""),
            )
        )
        self.nominal = None


def _check_labels(file: SourceFile, points: list[_Measured]) -> None:
    if not points:
        raise file.error("the file contains no measured point (G800 with its G801)")
    seen = set()
    for point in points:
        if (point.part, point.label) in seen:
            raise file.error(
                f"the point {point.label} occurs twice: are these two runs? Keep them in separate "
                "files",
                point.line,
            )
        seen.add((point.part, point.label))


def _touches(file: SourceFile, results: _Results) -> Touches:
    points = results.points
    lines = tuple(point.line for point in points)
    # One set, or one tip, is the usual file: it has no such column.
    words = {n: each for n, each in results.stated.columns().items() if len(set(each)) > 1}
    with file.named_in_errors(lines):
        return Touches(
            positions=np.array([point.center for point in points]),
            normals=np.array([point.normal for point in points]),
            labels=tuple(point.label for point in points),
            nominal_points=np.array([point.nominal for point in points]),
            source=file.name,
            lines=lines,
            **word_fields(words),
        )


def _warnings(results: _Results) -> tuple[str, ...]:
    warnings = []
    if not results.complete:
        warnings.append("the file has no END: the program did not run to its end")
    if len(results.radii) > 1:
        radii = ", ".join(f"{radius:g}" for radius in sorted(results.radii))
        warnings.append(f"the points have different tip radii R ({radii} mm)")
    if results.unread:
        what = ", ".join(f"{what} (line {line})" for what, line in results.unread.items())
        warnings.append(f"not read: {what}")
    return (*warnings, *results.stated.warnings())


def _words(file: SourceFile, text: str, number: int) -> dict[str, float]:
    """Read the words of a line, by letter; a letter and its number can have spaces between them."""
    squeezed = re.sub(r"\s+", "", text).upper()
    pairs = _WORD.findall(squeezed)
    if "".join(letter + value for letter, value in pairs) != squeezed:
        remainder = _WORD.sub("", squeezed)
        raise file.error(f"'{remainder[:20]}' is neither a letter nor a number of G-code", number)
    letters = [letter for letter, _ in pairs]
    if len(set(letters)) < len(letters):
        twice = next(letter for letter in letters if letters.count(letter) > 1)
        raise file.error(f"the letter {twice} occurs twice", number)
    values = file.numbers([value for _, value in pairs], number)
    return dict(zip(letters, values, strict=True))


def _need(file: SourceFile, words: dict[str, float], letters: str, code: str, number: int) -> None:
    missing = [letter for letter in letters if letter not in words]
    if missing:
        raise file.error(f"{code} has no {', '.join(missing)}", number)


def write_fusion(
    path: str | Path,
    centers: npt.ArrayLike,
    normals: npt.ArrayLike,
    nominal_points: npt.ArrayLike | None,
    labels: tuple[str, ...],
    tip_radius: float,
    note: str = "",
) -> None:
    """Write tip centres as a results file, in mm. Fusion subtracts R·IJK to get the surface.

    Parameters
    ----------
    path : str or Path
        The name of the file without its ending is the name of the results.
    centers, normals, nominal_points : (n, 3) float
        [mm]
    labels : tuple of str
        Written as comments, in plain characters: the format numbers its points.
    tip_radius : float
        [mm]
    note : str
        A comment above the points.

    Raises
    ------
    PretravelError
        There are no nominal points.
    """
    if nominal_points is None:
        raise PretravelError(
            "a Fusion results file needs the nominal points: columns nominal_x_mm, nominal_y_mm, "
            "nominal_z_mm"
        )
    lines = ["START", f"RESULTSFILE {plain_name(Path(path).stem)}", *filter(None, [note])]
    rows = zip(
        plain_labels(labels),
        np.asarray(centers, dtype=np.float64),
        np.asarray(normals, dtype=np.float64),
        np.asarray(nominal_points, dtype=np.float64),
        strict=True,
    )
    for number, (label, center, normal, nominal) in enumerate(rows, start=1):
        lines.append(f"{_LABEL}{label}")
        lines.append(f"G800 N{number} {_text('XYZ', nominal)} {_text('IJK', normal)}")
        lines.append(f"G801 N{number} {_text('XYZ', center)} R{exact_number(tip_radius)}")
    lines.append("END")
    with whole_file(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _text(letters: str, values: FloatArray) -> str:
    return " ".join(f"{a}{exact_number(v)}" for a, v in zip(letters, values, strict=True))


def _write_touches(path: Path, touches: Touches, tip_radius: float | None) -> None:
    if tip_radius is None:
        raise PretravelError(
            "a Fusion results file contains the tip's radius; give the tip's diameter",
            inputs=("tip_diameter",),
        )
    labels = labels_or_numbers(touches.labels, len(touches))
    write_fusion(
        path, touches.positions, touches.normals, touches.nominal_points, labels, tip_radius
    )


def _write_points(path: Path, points: Points, origin: PointsOrigin) -> None:
    """Write compensated points as the tip centres of a probe without pretravel."""
    if origin.tip_radius is None:
        raise PretravelError(
            "a Fusion results file contains the tip's radius; give the tip's radius"
        )
    nominal_points = origin.nominal_points
    if nominal_points is None and points.deviation is not None:
        nominal_points = points.positions - points.deviation[:, None] * points.normals
    centers = points.positions + origin.tip_radius * points.normals
    write_fusion(
        path, centers, points.normals, nominal_points, points.labels, origin.tip_radius, _WITHOUT
    )


FUSION = FileFormat(
    name="fusion",
    what="Fusion inspection results: G800, G801 (.msr, .txt)",
    reads="touches",
    writes="touches, points",
    needs="units",
    verified=(
        "the syntax of public files of a Haas post and of Autodesk's reader, and three points"
    ),
    endings=(".msr", ".txt"),
    recognises=lambda lines: any(re.match(r"G80[01]\s*N", line, re.I) for line in lines),
    parse=lambda file, options: read_fusion(file, options.units),
    write_touches=_write_touches,
    write_points=_write_points,
    statements=_TABLE,
    other_lines="named",
)
