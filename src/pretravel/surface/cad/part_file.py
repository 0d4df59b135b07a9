"""Parts from CAD files of any kind that has exact geometry."""

from __future__ import annotations

import logging
import warnings
from dataclasses import replace
from pathlib import Path

from pretravel.base import InputError
from pretravel.surface.cad.part import Part
from pretravel.surface.cad.part_cache import keep_faces, kept_faces, part_key

_logger = logging.getLogger("pretravel")

STEP_ENDINGS = (".step", ".stp", ".p21")
IGES_ENDINGS = (".iges", ".igs")
MESH_ENDINGS = (".stl", ".obj", ".3mf", ".ply", ".off", ".amf")
_NATIVE = {
    ".sldprt": "SolidWorks",
    ".ipt": "Inventor",
    ".f3d": "Fusion",
    ".fcstd": "FreeCAD",
    ".catpart": "CATIA",
    ".prt": "NX or Creo",
    ".3dm": "Rhino",
    ".par": "Solid Edge",
    ".x_t": "Parasolid",
    ".x_b": "Parasolid",
    ".sat": "ACIS",
    ".dwg": "AutoCAD",
    ".dxf": "AutoCAD",
    ".brep": "OpenCASCADE",
}
CAD_ENDINGS = (*STEP_ENDINGS, *IGES_ENDINGS, *MESH_ENDINGS, *_NATIVE)
"""Endings of files that contain a part, whether they can be read or not."""


def read_part(path: str | Path) -> Part:
    """Read all faces of a CAD file, STEP or IGES.

    Parameters
    ----------
    path : str or Path
        STEP (AP203, AP214, AP242) or IGES, in any unit of length.

    Returns
    -------
    Part
        In mm. `Part.unreadable` contains the faces that cannot be used, with the reasons.

    Raises
    ------
    InputError
        A file of another kind, with what to do; a file that cannot be read; one without faces.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending in MESH_ENDINGS:
        raise InputError(
            f"is a mesh ({ending[1:].upper()}): triangles have no exact normals and no curvature, "
            "so neither the contact nor the pretravel there can be computed. Export the part from "
            "its CAD program as STEP (AP214 or AP242); a mesh converted to STEP is still a mesh",
            path=path,
        )
    if ending in _NATIVE:
        raise InputError(
            f"is a file of {_NATIVE[ending]}, which is not read; export the part as STEP (AP214 or "
            "AP242)",
            path=path,
        )
    key = part_key(path)
    kept = kept_faces(key) if key else None
    if kept is not None:
        faces, unreadable = kept
        _logger.info("%s was read before", path.name)
        return Part(path.name, faces, tuple(range(len(faces))), unreadable, key)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        part = _read(path)
    for each in said:
        warnings.warn(each.message, each.category, stacklevel=2)
    if key and all(each.category is UserWarning for each in said):
        keep_faces(key, part.faces, part.unreadable, [str(each.message) for each in said])
    return replace(part, key=key)


def _read(path: Path) -> Part:
    from pretravel.surface.cad.step_part import part_from_content, read_step_part

    if path.suffix.lower() not in IGES_ENDINGS:
        return read_step_part(path)
    from pretravel.surface.cad.iges_reader import read_iges

    return part_from_content(read_iges(path), path)
