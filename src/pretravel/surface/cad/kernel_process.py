"""The CAD kernel reads each file in a process of its own: some files make it crash."""

from __future__ import annotations

import importlib
import json
import os
import re
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pretravel.base import InputError, PretravelError, module_folders
from pretravel.surface.cad.brep import Brep, parse_brep

_NEEDED_NEXT = ("scipy.interpolate", "scipy.spatial", "shapely")
_NO_MEMORY = "bad_alloc|MemoryError|OutOfMemory|[Mm]emory allocation|failed to map segment"
"""In the messages of libraries that got no memory."""
_START = (
    "import json, sys; sys.path[:] = json.loads(sys.argv.pop(1)); "
    "from pretravel.surface.cad.file_to_brep import main; main()"
)
"""The program of the process; isolated (-I), it takes the folders of modules as its argument."""


class KernelLimit(NamedTuple):
    """A limit of the kernel's process: a fixed part and a part for each byte of the file."""

    fixed: float
    per_byte: float


MEMORY = KernelLimit(3e9, 100.0)
"""Address space of the process; a file of 12 MB needs 0.2 GB. [bytes]"""
WRITTEN = KernelLimit(300e6, 30.0)
"""Largest file that it may write; its text of a part has about the size of the part. [bytes]"""
TIME = KernelLimit(120.0, 30e-6)
"""Time that the kernel may take; a file of 12 MB takes 5 s. [s]"""


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
    part_names : tuple of str
        The part of each face, as the path of its assemblies; empty for a file of one part.
    """

    brep: Brep
    face_names: tuple[str, ...]
    closed: int = 0
    open: int = 0
    part_names: tuple[str, ...] = ()


def run_kernel(copy: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """Let the kernel read a file and write its text form into a folder.

    The process imports no module from the current folder, where files of strangers can lie, and has
    limits of memory and time that grow with the file.

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
    size = copy.stat().st_size
    memory = int(MEMORY.fixed + MEMORY.per_byte * size)
    seconds = TIME.fixed + TIME.per_byte * size
    written = int(WRITTEN.fixed + WRITTEN.per_byte * size)
    given = [json.dumps(module_folders()), str(copy), str(folder), str(memory), str(written)]
    command = [sys.executable, "-I", "-c", _START, *given]
    with subprocess.Popen(
        command,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        cwd=folder,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},  # each thread reserves memory
    ) as process:
        try:
            # Half a second of imports for what follows, while the kernel reads.
            for module in _NEEDED_NEXT:
                importlib.import_module(module)

            stdout, stderr = process.communicate(timeout=seconds)
        except subprocess.TimeoutExpired:
            process.kill()
            reason = f"it took longer than {seconds:.0f} s"
            return subprocess.CompletedProcess(command, 1, "", reason)
        except BaseException:
            process.kill()
            raise
    if process.returncode and re.search(_NO_MEMORY, stdout + stderr):
        reason = f"it needs more than {memory / 1e9:.1f} GB of memory"
        return subprocess.CompletedProcess(command, 1, "", reason)
    if sys.platform != "win32" and process.returncode == -signal.SIGXFSZ:
        reason = f"its content takes more than {written / 1e6:.0f} MB"
        return subprocess.CompletedProcess(command, 1, "", reason)
    return subprocess.CompletedProcess(command, process.returncode, stdout, stderr)


def kernel_content(folder: Path, path: Path) -> CadContent:
    """The content that `run_kernel` wrote into a folder.

    Parameters
    ----------
    folder : Path
    path : Path
        Of the CAD file, for messages.

    Raises
    ------
    InputError
        The kernel read a damaged file and wrote a description that is none.
    """
    text = (folder / "part.brep").read_text("ascii", errors="replace")
    content = json.loads((folder / "content.json").read_text("utf-8"))
    return CadContent(
        understood(text, path),
        tuple(content["names"]),
        int(content.get("closed", 0)),
        int(content.get("open", 0)),
        tuple(content.get("parts", ())),
    )


def understood(text: str, path: Path) -> Brep:
    """The kernel's description of a part; a damaged part can have one that is none.

    Parameters
    ----------
    text : str
        In the kernel's text form.
    path : Path
        Of the CAD file, for messages.

    Raises
    ------
    InputError
        Knots, poles or references that do not fit together.
    """
    try:
        with np.errstate(over="raise", invalid="raise", divide="raise"):
            return parse_brep(text)
    except PretravelError as error:
        raise InputError(str(error), path=path) from None
    except (ValueError, LookupError, TypeError, ArithmeticError, RecursionError) as error:
        raise InputError(
            f"is damaged: what the CAD kernel read of it does not fit together ({error}). Export "
            "the part again",
            path=path,
        ) from error


def kernel_message(kernel: subprocess.CompletedProcess[str]) -> str:
    """The kernel's last message about an error."""
    if kernel.returncode < 0:
        return f"it crashed (signal {-kernel.returncode})"
    lines = [line for line in (kernel.stdout + kernel.stderr).splitlines() if line.strip()]
    errors = [line for line in lines if "ERR" in line] or lines
    plain = re.sub(r"\x1b\[[0-9;]*m|\*{4}", "", " ".join(errors[-1:])).strip()
    return " ".join(plain.split())[:200] or "it does not say why"
