"""Labelled datasets as NetCDF files."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from pretravel.base import module_folders, whole_file
from pretravel.files import netcdf_worker
from pretravel.files.source_file import SourceFile

if TYPE_CHECKING:
    import xarray as xr

LARGEST_CONTENT = 256_000_000
"""Largest content of a file whose arrays are packed, or not stored at all. [bytes]

A few bytes can declare an array of any size. What is stored as it is cannot exceed its file."""
_SECONDS, _BYTES_A_SECOND = 30.0, 5e6
"""Time that reading may take, plus a time for each byte; it usually takes a quarter second."""


@dataclass(frozen=True, eq=False)
class StoredVariable:
    """An array of a file: its axes by name, its values (numbers or text) and its attributes."""

    dims: tuple[str, ...]
    values: npt.NDArray[Any]
    attrs: Mapping[str, Any]


@dataclass(frozen=True, eq=False)
class StoredDataset:
    """The content of a NetCDF file, as it is stored.

    Attributes
    ----------
    variables : mapping of str to StoredVariable
    attrs : mapping of str to number, text or array
    """

    variables: Mapping[str, StoredVariable]
    attrs: Mapping[str, Any]


def write_dataset(path: str | Path, dataset: xr.Dataset) -> None:
    """Write a dataset. An error leaves no partial file.

    The content is made in memory first, because HDF5 ends the process when a disk is full.

    Parameters
    ----------
    path : str or Path
    dataset : xarray.Dataset
    """
    content = dataset_content(dataset)
    with whole_file(path) as temporary:
        temporary.write_bytes(content)


def dataset_content(dataset: xr.Dataset) -> bytes:
    """The content of the file of a dataset."""
    # No marks of gaps: what is stored is what was given.
    plain = {str(name): {"_FillValue": None} for name in dataset.variables}
    return bytes(dataset.to_netcdf(engine="h5netcdf", encoding=plain))


def read_dataset(file: SourceFile) -> StoredDataset:
    """Read a dataset as it is stored: values without scale factors, dates or marks of gaps.

    Raises
    ------
    InputError
        No NetCDF 4 file; a damaged one; one that declares more values than it can contain.

    Notes
    -----
    A process of its own reads the file, with limits of memory and time: damaged files make the
    HDF5 library run without end (a wild number of dimension scales) and crash.
    """
    try:
        code, answer = run_worker(file.content)
    except subprocess.TimeoutExpired:
        raise file.error(f"{_REFUSED} (reading it does not end)") from None
    found = _header(answer)
    if found is None:
        how = f"signal {-code}" if code < 0 else "it gave no content"
        raise file.error(f"{_REFUSED} (the HDF5 library fails on it: {how})")
    header, buffers = found
    if "error" in header:
        raise file.error(f"{_REFUSED} ({header['error']})")
    return restored_dataset(header, buffers)


def run_worker(content: bytes) -> tuple[int, bytes]:
    """Return code and answer of the process that reads a file.

    Raises
    ------
    subprocess.TimeoutExpired
        It takes far longer than reading does, without using its processor time.
    """
    command = [
        sys.executable,
        "-I",  # modules in the current folder are not imported
        str(Path(netcdf_worker.__file__).resolve()),
        json.dumps(module_folders()),
        str(largest_content(content)),
    ]
    worker = subprocess.run(
        command,
        input=content,
        capture_output=True,
        timeout=_SECONDS + len(content) / _BYTES_A_SECOND,
        check=False,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},  # each thread reserves memory
    )
    return worker.returncode, worker.stdout


def largest_content(content: bytes) -> int:
    """Largest size of all arrays together that a file of this size may declare. [bytes]"""
    return max(LARGEST_CONTENT, len(content))


_REFUSED = "this is not a NetCDF file that can be read; it is of another kind, or damaged"


def _header(answer: bytes) -> tuple[dict[str, Any], memoryview] | None:
    length = int.from_bytes(answer[:8], "little")
    if len(answer) < 8 + length or not length:
        return None
    return json.loads(answer[8 : 8 + length]), memoryview(answer)[8 + length :]


def restored_dataset(header: Mapping[str, Any], buffers: memoryview) -> StoredDataset:
    """The content from what the process of its own wrote.

    Parameters
    ----------
    header : mapping
        Of JSON.
    buffers : memoryview
        The arrays, one after the other in the order of the header.
    """
    start = 0

    def array(described: Mapping[str, Any]) -> npt.NDArray[Any]:
        nonlocal start
        shape = tuple(described["shape"])
        if "texts" in described:
            return np.array(described["texts"], dtype=object).reshape(shape)
        kind = np.dtype(described["type"])
        end = start + math.prod(shape) * kind.itemsize
        values = np.frombuffer(buffers[start:end], dtype=kind).reshape(shape)
        start = end
        return values

    def attributes(described: Mapping[str, Any]) -> dict[str, Any]:
        arrays = {name: array(value) for name, value in described.items()}
        return {name: value if value.ndim else value.item() for name, value in arrays.items()}

    variables = {}
    for each in header["variables"]:
        values = array(each["values"])
        variables[each["name"]] = StoredVariable(
            tuple(each["axes"]), values, attributes(each["attributes"])
        )
    return StoredDataset(variables, attributes(header["attributes"]))
