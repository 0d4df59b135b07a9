"""DMIS (ISO 22093): measured points, ``FA(label)=FEAT/POINT,CART,x,y,z,i,j,k``; reading."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.errors import InputError, PretravelError
from pretravel.formats.logs.joining import UNITS, FileReadings, file_lines, finite, scale_of
from pretravel.touches import Touches

_POINT = re.compile(r"^(FA?)\s*\(\s*([^)]+?)\s*\)\s*=\s*FEAT\s*/\s*POINT\s*,\s*(.*)$", re.I)
_UNITS = re.compile(r"^UNITS\s*/\s*(\w+)", re.I)
_NAMES = {"MM": "mm", "INCH": "inch"}
_ROUNDED = 5e-3


def read_dmis(
    path: str | Path, taken_off: float | None = None, units: str | None = None
) -> FileReadings:
    r"""Touches from the measured points of a DMIS output file.

    Parameters
    ----------
    path : str or Path
    taken_off : float
        Radius that the points have had taken off along their normals: 0 for tip centres, the tip's
        (qualified) radius for surface points. The file does not tell. [mm]
    units : str, optional
        mm or inch, where the file has no UNITS.

    Returns
    -------
    FileReadings
        Tip centres, with nominal points where ``F(label)`` gives them.

    Raises
    ------
    InputError
        What was taken off, or the units, not told; points that are not cartesian, normals that are
        not unit vectors, labels twice: with the line.

    >>> import tempfile
    >>> file = Path(tempfile.mkdtemp()) / "out.dmo"
    >>> _ = file.write_text("UNITS/MM, ANGDEC\nFA(P1)=FEAT/POINT,CART,0,0,$\n0.01,0,0,1\nENDFIL\n")
    >>> read_dmis(file, 3.0).touches.positions.tolist()
    [[0.0, 0.0, 3.01]]
    """
    lines = file_lines(path, "a DMIS file")
    if taken_off is None:
        raise InputError(
            "a DMIS file does not tell whether its points had the tip's radius taken off; give "
            "--radius-taken-off 0 for tip centres, or the radius in mm",
            path=path,
        )
    if not 0.0 <= taken_off < 1000.0:
        raise InputError(
            f"--radius-taken-off {taken_off:g}: a radius in mm, or 0, is needed", path=path
        )
    nominal: dict[str, FloatArray] = {}
    actual: dict[str, tuple[list[float], int]] = {}
    for number, line in _joined(lines):
        if re.match(r"^\w+\s*=\s*FEAT/POINT", line, re.I):
            raise InputError(
                "this is PC-DMIS's own report, not DMIS (FA(label)=FEAT/POINT,…)",
                path=path,
                line=number,
            )
        if found := _UNITS.match(line):
            own = _NAMES.get(found[1].upper())
            if own is None:
                raise InputError(f"units {found[1]}: MM and INCH are read", path=path, line=number)
            if units is not None and units != own:
                raise InputError(
                    f"the file says {own}, --units says {units}", path=path, line=number
                )
            units = own
        if not (found := _POINT.match(line)):
            continue
        kind, label, rest = found[1].upper(), found[2], found[3].split(",")
        if rest[0].strip().upper() != "CART":
            raise InputError(
                f"point {label} is given in {rest[0].strip()}; CART is read",
                path=path,
                line=number,
            )
        values = finite([cell.strip() for cell in rest[1:]], path, number)
        if len(values) != 6:
            raise InputError(
                f"point {label} has {len(values)} numbers; x, y, z, i, j, k are needed",
                path=path,
                line=number,
            )
        if kind == "F":
            nominal[label] = np.array(values[:3])
        elif label in actual:
            raise InputError(f"the point {label} is there twice", path=path, line=number)
        else:
            actual[label] = (values, number)
    if not actual:
        raise InputError("no measured point, FA(label)=FEAT/POINT,CART,…, in it", path=path)
    scale_of(units, path, "the file has no UNITS")
    scale = UNITS[str(units)]
    for label, (values, number) in actual.items():
        length = float(np.linalg.norm(values[3:]))
        if abs(length - 1.0) > _ROUNDED:
            raise InputError(
                f"point {label}: i, j, k has length {length:.4g}; the unit normal is needed (some "
                "systems write zeros, or angles, there)",
                path=path,
                line=number,
            )
    table = np.array([values for values, _ in actual.values()])
    normals = table[:, 3:] / np.linalg.norm(table[:, 3:], axis=1)[:, None]
    known = all(label in nominal for label in actual)
    try:
        touches = Touches(
            positions=scale * table[:, :3] + taken_off * normals,
            normals=normals,
            labels=tuple(actual),
            nominal_points=scale * np.array([nominal[label] for label in actual])
            if known
            else None,
            source=Path(path).name,
            lines=tuple(number for _, number in actual.values()),
        )
    except PretravelError as error:
        raise InputError(str(error), path=path) from None
    missed = tuple(label for label in nominal if label not in actual)
    return FileReadings(touches, missed=missed)


def _joined(lines: list[str]) -> list[tuple[int, str]]:
    """Statements without comments, lines that end in $ joined with the next; with line numbers."""
    statements: list[tuple[int, str]] = []
    begun: tuple[int, str] | None = None
    for number, text in enumerate(lines, start=1):
        line = text.strip()
        if line.startswith("$$"):
            continue
        where, before = begun or (number, "")
        whole = before + line
        begun = None
        if whole.endswith("$"):
            begun = (where, whole[:-1].rstrip())
        elif whole:
            statements.append((where, whole))
    if begun is not None:
        statements.append(begun)
    return statements
