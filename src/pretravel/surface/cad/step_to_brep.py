"""Converts a STEP file into the CAD kernel's text form; runs as a process of its own."""

from __future__ import annotations

import json
import sys
from pathlib import Path


def convert(step: Path, folder: Path) -> None:
    """Write ``part.brep`` and ``names.json`` (the faces' names) into a folder.

    Parameters
    ----------
    step : Path
        A file that ends with ``.step`` in lower case: the kernel requires it.
    folder : Path
    """
    from netgen.occ import OCCGeometry

    shape = OCCGeometry(str(step)).shape
    shape.WriteBrep(str(folder / "part.brep"), withTriangles=False)
    names = [str(face.name or "") for face in shape.faces]
    (folder / "names.json").write_text(json.dumps(names), encoding="utf-8")


if __name__ == "__main__":
    try:
        convert(Path(sys.argv[1]), Path(sys.argv[2]))
    except Exception as error:
        sys.exit(str(error))
