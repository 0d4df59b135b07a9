"""What a command leaves out at its start and end: parts of libraries that it does not use."""

from __future__ import annotations

import gc
import importlib.util
import os
import sys

_UNUSED = ("numpy.f2py", "numpy.testing")
"""Parts of NumPy that SciPy loads, because it takes all names of NumPy; it uses none of them."""
_OBJECTS = 500_000
"""New objects until the garbage is collected; Python's 700 are met hundreds of times by imports."""


def start_lean() -> None:
    """Collect garbage rarely, and compute with one thread where the user does not ask for more.

    A seventh of the time of a short command goes into the garbage. Its matrices are small: threads
    of the linear algebra wait for each other, and use the processor meanwhile, several times as
    long as they compute.
    """
    gc.set_threshold(_OBJECTS, 20, 20)
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # read when NumPy is loaded


def end_lean() -> None:
    """Leave all objects to the end of the process: Python would search them for cycles twice.

    The search takes a tenth of the time of a short command.
    """
    gc.freeze()


def without_unused_parts() -> None:
    """Load unused parts of NumPy when they are first used, not before SciPy."""
    import numpy as np

    for name in _UNUSED:
        spec = importlib.util.find_spec(name) if name not in sys.modules else None
        if spec is None or spec.loader is None:
            continue
        spec.loader = loader = importlib.util.LazyLoader(spec.loader)
        module = sys.modules[name] = importlib.util.module_from_spec(spec)
        loader.exec_module(module)
        setattr(np, name.partition(".")[2], module)
