"""The reader of STEP files: the CAD kernel reads each file in a process of its own."""

from __future__ import annotations

import json
import logging
import re
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pretravel.errors import InputError
from pretravel.surface.cad.brep import Brep, parse_brep

_logger = logging.getLogger("pretravel")

_SCANNED = 50_000_000
"""Largest part of an unreadable file that is searched for the reason. [bytes]"""
_HEAD = 4096
"""Part of a file in which the mark of STEP must stand. [bytes]"""


@dataclass(frozen=True, eq=False)
class StepContent:
    """The content of a STEP file, in mm.

    Attributes
    ----------
    brep : Brep
        Surfaces, curves and the tree of shapes.
    face_names : tuple of str
        Names of the faces in the kernel's order; empty where the file has no name.
    """

    brep: Brep
    face_names: tuple[str, ...]


def read_step(path: str | Path) -> StepContent:
    """Read a STEP file.

    Parameters
    ----------
    path : str or Path
        AP203, AP214 or AP242, in any unit of length.

    Returns
    -------
    StepContent

    Raises
    ------
    InputError
        A file that is no STEP file, or that the CAD kernel cannot read.
    """
    path = Path(path)
    with tempfile.TemporaryDirectory() as folder:
        _convert(path, Path(folder))
        brep = parse_brep((Path(folder) / "part.brep").read_text("ascii", errors="replace"))
        names = json.loads((Path(folder) / "names.json").read_text("utf-8"))
    return StepContent(brep, tuple(names))


def read_step_solids(path: str | Path) -> list[Any]:
    """Read the solids of a STEP file as objects of the CAD kernel, to be meshed.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    list of netgen.occ.Solid
        In the file's order, with their names. [mm]

    Raises
    ------
    InputError
        A file that is no STEP file, that the CAD kernel cannot read, or that contains no solid.

    Notes
    -----
    The kernel's objects cannot be passed between processes without a change of the last digits,
    and with them the mesh changes. Therefore a process of its own reads the file first, as a trial:
    a file that makes the kernel fail or crash is refused there. Then this process reads it.
    """
    from netgen.occ import OCCGeometry

    path = Path(path)
    with tempfile.TemporaryDirectory() as folder:
        _convert(path, Path(folder))
        solids = list(OCCGeometry(str(Path(folder) / "part.step")).shape.solids)
    if not solids:
        raise InputError("contains no solid; surfaces alone cannot be meshed", path=path)
    return solids


def _convert(path: Path, folder: Path) -> None:
    """Let the CAD kernel, in a process of its own, read a file and write its text form."""
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except OSError as error:
        raise InputError(f"cannot be opened: {error.strerror}", path=path) from None
    if b"ISO-10303-21" not in head:
        raise InputError(
            "is not a STEP file: it does not begin with ISO-10303-21; export the part as STEP "
            "(AP214 or AP242)",
            path=path,
        )
    _logger.info("reading %s", path.name)
    # The kernel recognizes a format by its ending, and only in lower case.
    copy = folder / "part.step"
    shutil.copyfile(path, copy)
    # The kernel prints messages, and some files make it crash.
    kernel = subprocess.run(
        [sys.executable, "-m", "pretravel.surface.cad.step_to_brep", str(copy), str(folder)],
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
    )
    if kernel.returncode != 0:
        raise InputError(
            f"{_reason(path, kernel)}. Export it again as AP214 or AP242, with exact geometry",
            path=path,
        )


def _reason(path: Path, kernel: subprocess.CompletedProcess[str]) -> str:
    """Why a file cannot be read, from its content rather than from the kernel's messages."""
    with path.open("rb") as file:
        text = file.read(_SCANNED).upper()
    if re.search(rb"FILE_SCHEMA\s*\(\s*\(\s*'IFC", text):
        return "is a building model (IFC), not a part"
    if b"END-ISO-10303-21" not in text[-2000:] and len(text) < _SCANNED:
        return f"is not complete: it does not end with END-ISO-10303-21 ({_last_message(kernel)})"
    if not re.search(rb"ADVANCED_FACE|FACE_SURFACE", text):
        if re.search(rb"TRIANGULATED|TESSELLATED", text):
            return "contains only triangles, no exact geometry"
        if b"DOCUMENT_FILE" in text:
            return "contains only references to other files; the parts are in those files"
        return "contains no faces"
    return f"the CAD kernel cannot read it: {_last_message(kernel)}"


def _last_message(kernel: subprocess.CompletedProcess[str]) -> str:
    """The kernel's last message about an error."""
    if kernel.returncode < 0:
        return f"it crashed (signal {-kernel.returncode})"
    lines = [line for line in (kernel.stdout + kernel.stderr).splitlines() if line.strip()]
    errors = [line for line in lines if "ERR" in line] or lines
    plain = re.sub(r"\x1b\[[0-9;]*m|\*{4}", "", " ".join(errors[-1:])).strip()
    return " ".join(plain.split())[:200] or "it does not state why"
