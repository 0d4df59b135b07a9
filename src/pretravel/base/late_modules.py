"""Modules of other packages that are loaded when something of them is first used."""

from __future__ import annotations

import importlib.util
import sys


def load_when_used(*names: str) -> None:
    """Load modules when something of them is first used, not when another module imports them.

    That is so where their names are imported from their packages; ``import package.name`` loads it.

    Parameters
    ----------
    *names : str
        Of modules within packages. One that is loaded, or is not there, is left as it is.

    >>> load_when_used("wsgiref.headers", "wsgiref.missing")
    >>> from wsgiref import headers
    >>> type(headers).__name__, headers.Headers().items(), type(headers).__name__
    ('_LazyModule', [], 'module')
    """
    for name in names:
        package, _, last = name.rpartition(".")
        spec = importlib.util.find_spec(name) if name not in sys.modules else None
        if spec is None or spec.loader is None:
            continue
        spec.loader = loader = importlib.util.LazyLoader(spec.loader)
        module = sys.modules[name] = importlib.util.module_from_spec(spec)
        loader.exec_module(module)
        setattr(sys.modules[package], last, module)
