"""The CAD kernel reads each file in a process of its own: some files make it crash."""

from __future__ import annotations

import importlib
import json
import re
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from pretravel.surface.cad.brep import Brep, parse_brep

_NEEDED_NEXT = ("scipy.interpolate", "scipy.spatial", "shapely")


@dataclass(frozen=True, eq=False)
class CadContent:
    """The content of a CAD file, in mm.

    Attributes
    ----------
    brep : Brep
        Surfaces, curves and the tree of shapes.
    face_names : tuple of str
        Names of the faces in the kernel's order; empty where the file has no name.
    closed, open : int
        Number of groups of joined faces that enclose a volume, and that do not. Counted for
        files whose faces are joined after reading (IGES), else zero.
    """

    brep: Brep
    face_names: tuple[str, ...]
    closed: int = 0
    open: int = 0


def run_kernel(copy: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """Let the kernel read a file and write its text form into a folder.

    Parameters
    ----------
    copy : Path
        Its name ends with ``.step`` or ``.iges``, in lower case.
    folder : Path

    Returns
    -------
    subprocess.CompletedProcess
        With a return code other than zero if the kernel failed.
    """
    command = [sys.executable, "-m", "pretravel.surface.cad.file_to_brep", str(copy), str(folder)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, errors="replace"
    ) as process:
        # Half a second of imports for what follows, while the kernel reads.
        for module in _NEEDED_NEXT:
            importlib.import_module(module)

        stdout, stderr = process.communicate()
    return subprocess.CompletedProcess(command, process.returncode, stdout, stderr)


def kernel_content(folder: Path) -> CadContent:
    """The content that `run_kernel` wrote into a folder."""
    brep = parse_brep((folder / "part.brep").read_text("ascii", errors="replace"))
    content = json.loads((folder / "content.json").read_text("utf-8"))
    return CadContent(
        brep, tuple(content["names"]), int(content.get("closed", 0)), int(content.get("open", 0))
    )


def kernel_message(kernel: subprocess.CompletedProcess[str]) -> str:
    """The kernel's last message about an error."""
    if kernel.returncode < 0:
        return f"it crashed (signal {-kernel.returncode})"
    lines = [line for line in (kernel.stdout + kernel.stderr).splitlines() if line.strip()]
    errors = [line for line in lines if "ERR" in line] or lines
    plain = re.sub(r"\x1b\[[0-9;]*m|\*{4}", "", " ".join(errors[-1:])).strip()
    return " ".join(plain.split())[:200] or "it does not state why"
