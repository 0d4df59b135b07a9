"""Packages that not every installation has: the extras of pyproject.toml, and what is in them."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.util import find_spec

from pretravel.base.errors import PretravelError

PURPOSES: Mapping[str, str] = {
    "distributed": "computes on several cores and computers",
    "h5netcdf": "reads and writes NetCDF files",
    "meshio": "writes files for ParaView",
    "netgen": "reads STEP and IGES files and makes meshes",
    "nicegui": "makes the pages of the workbench",
    "pandas": "makes tables of data",
    "pyarrow": "reads and writes Parquet files",
    "shapely": "tells which points lie on a face",
    "skfem": "computes with finite elements",
    "xarray": "makes labelled datasets",
}
"""The modules that come with an extra, and what pretravel needs them for."""


class MissingExtraError(PretravelError, ImportError):
    """A package of an extra is not installed; the text states the line that installs it."""


def needed(module: str, extra: str, *, inputs: tuple[str, ...] = ()) -> None:
    """Refuse to go on without a module of an extra.

    Parameters
    ----------
    module : str
        One of `PURPOSES`.
    extra : str
        Extra of pyproject.toml that installs the module, as part of what the caller does.
    inputs : tuple of str
        Inputs that can do without the module: see `PretravelError`.

    Raises
    ------
    MissingExtraError
        The module is not installed.

    >>> needed("netgen", "cad")
    """
    if find_spec(module) is None:
        raise MissingExtraError(
            f'this needs {module}, which {PURPOSES[module]}: pip install "pretravel[{extra}]"',
            inputs=inputs,
        )
