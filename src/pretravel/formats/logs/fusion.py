"""Fusion inspection results: G800 nominal, G801 measured tip centre, between START and END."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import numpy.typing as npt

from pretravel.arrays import FloatArray
from pretravel.compensation.compensation import Points
from pretravel.errors import InputError, PretravelError
from pretravel.formats.csv_table import exact_number
from pretravel.formats.logs.joining import FileReadings, file_lines, scale_of
from pretravel.frames import turned_about_axes
from pretravel.touches import Touches
from pretravel.units import DEGREE
from pretravel.whole_file import whole_file

_WORD = re.compile(r"([A-DI-LN-OR-UW-Z])([+-]?(?:\d+\.?\d*|\.\d+))")
_ROUNDED = 5e-3
"""Normals are printed with four decimals, or fewer; they are scaled to length one."""
_LABEL = ";LABEL "


def read_fusion(path: str | Path, units: str | None = None) -> FileReadings:
    r"""Touches from a results file of Fusion's inspection programs.

    Parameters
    ----------
    path : str or Path
    units : str
        mm or inch; the file does not tell.

    Returns
    -------
    FileReadings
        Tip centres, nominal points and normals in the work coordinates (turned back by G330);
        a G800 without its G801 is a miss. The control has taken off eccentricity, but no radius.
        G802 is left alone: its sign differs between posts.

    Raises
    ------
    InputError
        Units not told; letters twice or missing, numbers that are none, a G801 of another N,
        points after END, no point at all: with the line.

    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "results.txt"
    >>> _ = file.write_text("START\nG800 N1 X0 Y0 Z0 I0 J0 K1\nG801 N1 X0 Y0 Z2.99 R3\nEND\n")
    >>> read_fusion(file, "mm").touches.positions.tolist()
    [[0.0, 0.0, 2.99]]
    """
    lines = file_lines(path, "a results file of Fusion")
    scale = scale_of(units, path, "a results file does not tell its units")
    turn = np.eye(3)
    toolpath = ""
    name: str | None = None
    waiting: dict[str, float] | None = None
    waiting_label, waiting_line = "", 0
    found: list[tuple[str, FloatArray, FloatArray, FloatArray, float, int]] = []
    missed: list[str] = []
    ended, seen_end = True, False

    def close() -> None:
        if waiting is not None:
            missed.append(waiting_label)

    for number, text in enumerate(lines, start=1):
        line = text.replace("*", " ").strip()
        if line.upper().startswith("TOOLPATHID"):
            toolpath = line[10:].strip()
        if line.startswith(_LABEL):
            name = line[len(_LABEL) :].strip()
        if line.upper() == "START":
            ended, turn = False, np.eye(3)
        elif line.upper() == "END":
            ended = seen_end = True
        code = line[:4].upper()
        if code not in ("G330", "G800", "G801"):
            continue
        if ended and seen_end:
            raise InputError("a point after END", path=path, line=number)
        words = _words(line[4:], path, number)
        if code == "G330":
            turn = turned_about_axes(*(words.get(letter, 0.0) * DEGREE for letter in "ABC"))
        elif code == "G800":
            close()
            _need(words, "NXYZIJK", "G800", path, number)
            waiting, waiting_line = words, number
            plain = f"{toolpath}-{words['N']:g}" if toolpath else f"{words['N']:g}"
            waiting_label, name = name or plain, None
        else:
            _need(words, "NXYZ", "G801", path, number)
            if waiting is None:
                raise InputError("a G801 without a G800 before it", path=path, line=number)
            if words["N"] != waiting["N"]:
                raise InputError(
                    f"G801 is of point {words['N']:g}, the G800 before it (line {waiting_line}) of "
                    f"{waiting['N']:g}",
                    path=path,
                    line=number,
                )
            normal = np.array([waiting[letter] for letter in "IJK"])
            length = float(np.linalg.norm(normal))
            if abs(length - 1.0) > _ROUNDED:
                raise InputError(
                    f"the normal I J K has length {length:.4g}; it must be a unit vector",
                    path=path,
                    line=waiting_line,
                )
            nominal = scale * np.array([waiting[letter] for letter in "XYZ"])
            center = scale * np.array([words[letter] for letter in "XYZ"])
            found.append(
                (
                    waiting_label,
                    turn @ center,
                    turn @ (normal / length),
                    turn @ nominal,
                    scale * words.get("R", np.nan),
                    number,
                )
            )
            waiting = None
    close()
    if not found:
        raise InputError("no measured point (G800 with its G801) in it", path=path)
    labels = [entry[0] for entry in found]
    if len(set(labels)) < len(labels):
        twice = next(i for i, label in enumerate(labels) if label in labels[:i])
        raise InputError(
            f"the point {labels[twice]} is there twice: two runs? Keep them in files of their own",
            path=path,
            line=found[twice][5],
        )
    radii = {round(entry[4], 6) for entry in found if np.isfinite(entry[4])}
    warnings = [] if ended else ["there is no END: the program did not run to its end"]
    if len(radii) > 1:
        warnings.append(
            f"points have different tip radii R ({', '.join(f'{r:g}' for r in sorted(radii))} mm)"
        )
    try:
        touches = Touches(
            positions=np.array([entry[1] for entry in found]),
            normals=np.array([entry[2] for entry in found]),
            labels=tuple(labels),
            nominal_points=np.array([entry[3] for entry in found]),
            source=Path(path).name,
            lines=tuple(entry[5] for entry in found),
        )
    except PretravelError as error:
        raise InputError(str(error), path=path) from None
    return FileReadings(
        touches,
        missed=tuple(missed),
        warnings=tuple(warnings),
        tip_radius=radii.pop() if len(radii) == 1 else None,
    )


def _words(text: str, path: str | Path, line: int) -> dict[str, float]:
    squeezed = re.sub(r"\s+", "", text).upper()
    pairs = _WORD.findall(squeezed)
    if "".join(letter + value for letter, value in pairs) != squeezed:
        left = _WORD.sub("", squeezed)
        raise InputError(
            f"'{left[:20]}' is neither a letter nor a number of such a line", path=path, line=line
        )
    letters = [letter for letter, _ in pairs]
    if len(set(letters)) < len(letters):
        twice = next(letter for letter in letters if letters.count(letter) > 1)
        raise InputError(f"the letter {twice} is there twice", path=path, line=line)
    return {letter: float(value) for letter, value in pairs}


def _need(words: dict[str, float], letters: str, code: str, path: str | Path, line: int) -> None:
    missing = [letter for letter in letters if letter not in words]
    if missing:
        raise InputError(f"{code} has no {', '.join(missing)}", path=path, line=line)


def write_fusion(
    path: str | Path,
    centers: npt.ArrayLike,
    normals: npt.ArrayLike,
    nominal_points: npt.ArrayLike | None,
    labels: tuple[str, ...],
    tip_radius: float,
    *,
    name: str = "pretravel",
) -> None:
    """Tip centres as a results file, in mm: what Fusion takes R·IJK off to have the surface.

    Parameters
    ----------
    path : str or Path
    centers, normals, nominal_points : (n, 3) float
        [mm]
    labels : tuple of str
        In comments: points are numbered.
    tip_radius : float
        [mm]
    name : str
        Of the results.

    Raises
    ------
    PretravelError
        No nominal points.
    """
    if nominal_points is None:
        raise PretravelError(
            "a Fusion results file needs the nominal points: columns nominal_x_mm, nominal_y_mm, "
            "nominal_z_mm"
        )
    lines = ["START", f"RESULTSFILE {name}"]
    rows = zip(
        labels,
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


def write_fusion_points(
    path: str | Path, points: Points, nominal_points: FloatArray | None, tip_radius: float
) -> None:
    """Compensated points as a results file: the tip as it would stand if nothing gave.

    Parameters
    ----------
    path : str or Path
    points : Points
    nominal_points : (n, 3) float or None
        Those of the touches; without them the feet on the nominal surface, where deviations are
        known. [mm]
    tip_radius : float
        [mm]

    Raises
    ------
    PretravelError
        Neither nominal points nor deviations.
    """
    if nominal_points is None and points.deviation is not None:
        nominal_points = points.positions - points.deviation[:, None] * points.normals
    write_fusion(
        path,
        points.positions + tip_radius * points.normals,
        points.normals,
        nominal_points,
        points.labels,
        tip_radius,
        name=Path(path).stem,
    )


def _text(letters: str, values: FloatArray) -> str:
    return " ".join(f"{a}{exact_number(v)}" for a, v in zip(letters, values, strict=True))
