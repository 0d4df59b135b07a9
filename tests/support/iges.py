"""IGES files made of bilinear B-spline surfaces or of lines, written by hand (IGES 5.3)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

BOX = np.array([[0.0, 0.0, 0.0], [10.0, 20.0, 30.0]])


def box_patches(low: np.ndarray = BOX[0], high: np.ndarray = BOX[1]) -> list[np.ndarray]:
    """The six faces of a box as corners (u, v, 3); three of their normals point into it."""
    patches = []
    for axis in range(3):
        for end in (low, high):
            corners = np.empty((2, 2, 3))
            one, two = (axis + 1) % 3, (axis + 2) % 3
            for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):
                corners[i, j, axis] = end[axis]
                corners[i, j, one] = (low, high)[i][one]
                corners[i, j, two] = (low, high)[j][two]
            patches.append(corners)
    return patches


def write_iges(path: Path, patches: list[np.ndarray], *, unit: str = "MM", lines: int = 0) -> Path:
    """Write surfaces (entity 128, degree one) and lines (entity 110)."""
    flag = {"MM": 2, "INCH": 1}[unit]
    entities = []
    for corners in patches:
        poles = ",".join(f"{x:.9g}" for j in (0, 1) for i in (0, 1) for x in corners[i, j])
        knots, weights = "0.,0.,1.,1.,0.,0.,1.,1.", "1.,1.,1.,1."
        text = f"128,1,1,1,1,0,0,1,0,0,{knots},{weights},{poles},0.,1.,0.,1.;"
        entities.append((128, text))
    entities += [(110, f"110,0.,0.,0.,1.,{i}.,0.;") for i in range(lines)]
    start = ["written by hand"]
    head = _wrapped(
        f"1H,,1H;,4Hpart,8Hpart.igs,4Hhand,1H1,32,38,6,308,15,4Hpart,1.,{flag},"
        f"{len(unit)}H{unit},1,0.1,15H20260101.000000,1E-6,1000.,4Hhand,4Hhand,11,0;", 72
    )  # fmt: skip
    directory: list[str] = []
    parameters: list[str] = []
    for kind, text in entities:
        number = len(directory) + 1
        rows = _wrapped(text, 64)
        fields = [kind, len(parameters) + 1, 0, 0, 0, 0, 0, 0]
        directory.append("".join(f"{field:>8}" for field in fields) + "00000000")
        fields = [kind, 0, 0, len(rows), 0]
        directory.append("".join(f"{field:>8}" for field in fields) + " " * 32)
        parameters += [f"{row:<64}{number:>8}" for row in rows]
    sections = {"S": start, "G": head, "D": directory, "P": parameters}
    rows = [
        f"{row:<72}{letter}{i:>7}"
        for letter, section in sections.items()
        for i, row in enumerate(section, start=1)
    ]
    counts = "".join(f"{letter}{len(section):>7}" for letter, section in sections.items())
    path.write_text("\n".join([*rows, f"{counts:<72}T{1:>7}"]) + "\n", encoding="ascii")
    return path


def _wrapped(text: str, width: int) -> list[str]:
    """Text in rows that end at a comma."""
    rows = [""]
    for piece in text.replace(",", ",\0").split("\0"):
        if len(rows[-1]) + len(piece) > width:
            rows.append("")
        rows[-1] += piece
    return rows
