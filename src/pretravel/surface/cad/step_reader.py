"""The reader of STEP files."""

from __future__ import annotations

import logging
import re
import subprocess
import warnings
from pathlib import Path
from typing import Any

from pretravel.base import InputError, needed, temporary_folder
from pretravel.surface.cad.kernel_process import (
    CadContent,
    kernel_content,
    kernel_message,
    run_kernel,
)
from pretravel.surface.cad.step_text import faces_in_text, with_names, without_pmi

_logger = logging.getLogger("pretravel")

_SCANNED = 50_000_000
"""Largest part of an unreadable file that is searched for the reason. [bytes]"""
_HEAD = 4096
"""Part of a file in which the mark of STEP must stand. [bytes]"""


def read_step(path: str | Path) -> CadContent:
    """Read a STEP file.

    Parameters
    ----------
    path : str or Path
        AP203, AP214 or AP242, in any unit of length.

    Returns
    -------
    CadContent
        Of all roots of the file. A warning says how many faces of its text are absent.

    Raises
    ------
    InputError
        A file that is not a STEP file, or that the CAD kernel cannot read.
    MissingExtraError
        Without the extra ``cad``.
    """
    needed("netgen", "cad")
    needed("shapely", "cad")
    path = Path(path)
    with temporary_folder() as folder:
        _convert(path, folder)
        content = kernel_content(folder, path)
        stated = faces_in_text((folder / "part.step").read_bytes())
    read = sum(shape.kind == "Fa" for shape in content.brep.shapes.values())
    if read < stated:
        warnings.warn(
            f"{path.name} defines {stated} faces, and {read} of them were read: {stated - read} "
            "belong to no part, or the CAD kernel could not translate them. They are neither "
            "touched nor obstacles. If the part lacks some, export it again (AP214 or AP242)",
            stacklevel=2,
        )
    return content


def read_step_solids(path: str | Path) -> list[Any]:
    """Read the solids of a STEP file as objects of the CAD kernel, to be meshed.

    Returns
    -------
    list of netgen.occ.Solid
        In the file's order, with their names. [mm]

    Raises
    ------
    InputError
        A file that is not a STEP file, that the CAD kernel cannot read, or that contains no solid.

    Notes
    -----
    The kernel's objects cannot be passed between processes without a change of the last digits,
    and with them the mesh changes. Therefore a process of its own reads the file first, as a trial:
    a file that makes the kernel fail or crash is refused there. Then this process reads it.
    """
    from pretravel.surface.cad.step_roots import whole_shape

    path = Path(path)
    with temporary_folder() as folder:
        _convert(path, folder)
        solids = list(whole_shape(folder / "part.step")[0].solids)
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
    text, nameless = with_names(path.read_bytes())
    copy.write_bytes(without_pmi(text))
    kernel = run_kernel(copy, folder)
    if kernel.returncode != 0:
        raise InputError(
            f"{_reason(path, kernel)}. Export it again as AP214 or AP242, with exact geometry",
            path=path,
        )
    if nameless:
        warnings.warn(
            f"{path.name}: {nameless} items of geometry have no name ($), which STEP requires; "
            "they are read as if their names were empty",
            stacklevel=4,
        )


def _reason(path: Path, kernel: subprocess.CompletedProcess[str]) -> str:
    """Why a file cannot be read, from its content rather than from the kernel's messages."""
    with path.open("rb") as file:
        text = file.read(_SCANNED).upper()
    if re.search(rb"FILE_SCHEMA\s*\(\s*\(\s*'IFC", text):
        return "is a building model (IFC), not a part"
    if b"END-ISO-10303-21" not in text[-2000:] and len(text) < _SCANNED:
        return f"is not complete: it does not end with END-ISO-10303-21 ({kernel_message(kernel)})"
    if not re.search(rb"ADVANCED_FACE|FACE_SURFACE", text):
        if re.search(rb"TRIANGULATED|TESSELLATED", text):
            return "contains only triangles, no exact geometry"
        if b"DOCUMENT_FILE" in text:
            return "contains only references to other files; the parts are in those files"
        return "contains no faces"
    return f"the CAD kernel cannot read it: {kernel_message(kernel)}"
