"""Labelled datasets as NetCDF files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from pretravel.whole_file import whole_file

if TYPE_CHECKING:
    import xarray as xr


def write_dataset(path: str | Path, dataset: xr.Dataset) -> None:
    """Write a dataset. An error leaves no partial file.

    The content is made in memory first, because HDF5 ends the process when a disk is full.

    Parameters
    ----------
    path : str or Path
    dataset : xarray.Dataset
    """
    content = bytes(dataset.to_netcdf(engine="h5netcdf"))
    with whole_file(path) as temporary:
        temporary.write_bytes(content)
