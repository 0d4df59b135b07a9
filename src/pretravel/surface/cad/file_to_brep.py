"""Converts a STEP or IGES file into the CAD kernel's text form; runs as a process of its own."""

from __future__ import annotations

import json
import sys
from pathlib import Path


def convert(file: Path, folder: Path) -> None:
    """Write ``part.brep`` and ``content.json`` (names of faces, number of bodies) into a folder.

    Parameters
    ----------
    file : Path
        Its name ends with ``.step`` or ``.iges``, in lower case: the kernel requires it.
    folder : Path
    """
    from netgen.occ import OCCGeometry

    shape = OCCGeometry(str(file)).shape
    content: dict[str, object] = {}
    if file.suffix == ".iges":
        from pretravel.surface.cad.iges_bodies import joined

        shape, content["closed"], content["open"] = joined(shape)
    shape.WriteBrep(str(folder / "part.brep"), withTriangles=False)
    content["names"] = [str(face.name or "") for face in shape.faces]
    (folder / "content.json").write_text(json.dumps(content), encoding="utf-8")


if __name__ == "__main__":
    try:
        convert(Path(sys.argv[1]), Path(sys.argv[2]))
    except Exception as error:
        sys.exit(str(error))
