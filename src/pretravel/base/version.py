"""The version of the package, as the build wrote it from the tags."""

from __future__ import annotations

import functools


@functools.cache
def installed_version() -> str:
    """What the build wrote; a folder that was never installed has no version."""
    # Imported here: it takes as long as the rest of what the package imports.
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("pretravel")
    except PackageNotFoundError:
        return "0+not.installed"
