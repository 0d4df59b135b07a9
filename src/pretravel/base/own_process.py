"""Processes of their own for libraries that hostile files make crash, hang or fill the memory."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np


def module_folders() -> list[str]:
    """Folders of modules for a process of its own: those of this process, not the current one.

    ``python -m`` puts the current folder first, and an empty part of PYTHONPATH means it too. A
    current folder with the NumPy that runs in this process is the folder of the libraries.
    """
    here = Path.cwd()
    kept = here == Path(np.__file__).parents[1]
    absolute = [folder for folder in sys.path if Path(folder).is_absolute()]
    folders = [folder for folder in absolute if kept or Path(folder) != here]
    ours = str(Path(__file__).resolve().parents[1])
    return folders if ours in folders else [*folders, ours]
