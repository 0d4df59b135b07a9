"""What a command leaves out at its start: parts of libraries that it does not use."""

from __future__ import annotations

import gc
import importlib.util
import sys

_UNUSED = ("numpy.f2py", "numpy.testing")
"""Parts of NumPy that SciPy loads, because it takes all names of NumPy; it uses none of them."""
_OBJECTS = 50_000
"""New objects until the garbage is collected; Python's 700 are met hundreds of times by imports."""


def collect_rarely() -> None:
    """Collect the garbage rarely: a seventh of the time of a short command goes into it."""
    gc.set_threshold(_OBJECTS, 20, 20)


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
