"""Converts a STEP or IGES file into the CAD kernel's text form; runs as a process of its own."""

from __future__ import annotations

import json
import sys
from pathlib import Path


def convert(file: Path, folder: Path) -> None:
    """Write ``part.brep`` and ``content.json`` (names of faces, number of bodies) into a folder.

    The names are those of the faces themselves, and those of the parts that they belong to.

    Parameters
    ----------
    file : Path
        Its name ends with ``.step`` or ``.iges``, in lower case: the kernel requires it.
    folder : Path
    """
    content: dict[str, object] = {}
    if file.suffix == ".iges":
        from netgen.occ import OCCGeometry

        from pretravel.surface.cad.iges_bodies import joined

        shape, content["closed"], content["open"] = joined(OCCGeometry(str(file)).shape)
    else:
        from pretravel.surface.cad.step_roots import whole_shape

        shape, part_of = whole_shape(file)
        content["parts"] = [part_of.get(face, "") for face in shape.faces]
    shape.WriteBrep(str(folder / "part.brep"), withTriangles=False)
    content["names"] = [str(face.name or "") for face in shape.faces]
    (folder / "content.json").write_text(json.dumps(content), encoding="utf-8")


def main() -> None:
    """Convert the file ``sys.argv[1]`` into the folder [2].

    In at most [3] bytes of memory, with files of at most [4] bytes.
    """
    file, folder, memory, written = sys.argv[1:]
    _limit(int(memory), int(written))
    try:
        convert(Path(file), Path(folder))
    except MemoryError:
        sys.exit("MemoryError")
    except Exception as error:
        sys.exit(str(error) or type(error).__name__)


def _limit(memory: int, written: int) -> None:
    """Limit memory and files of this process; a crash leaves no image of it on the disk."""
    if sys.platform == "win32":  # which has no such limits
        return
    import resource
    import signal

    _, most = resource.getrlimit(resource.RLIMIT_AS)
    if most != resource.RLIM_INFINITY:
        memory = min(memory, most)
    resource.setrlimit(resource.RLIMIT_AS, (memory, most))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    signal.signal(signal.SIGXFSZ, signal.SIG_DFL)  # Python ignores it
    resource.setrlimit(resource.RLIMIT_FSIZE, (written, written))
