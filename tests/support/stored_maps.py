"""Map files in memory, read in this process: without a process for each of many files."""

from __future__ import annotations

import io
import json
from functools import cache

import h5netcdf
import numpy as np

from pretravel.files import netcdf_worker
from pretravel.files.map_dataset import map_dataset, map_from_dataset
from pretravel.files.netcdf import (
    StoredDataset,
    content_digest,
    dataset_content,
    restored_dataset,
)
from pretravel.files.source_file import SourceFile
from pretravel.maps.kinds.averaged import averaged_map
from pretravel.maps.pretravel_map import PretravelMap
from tests.support.example_maps import example_map


def stored(pretravel_map: PretravelMap) -> bytes:
    """The content of the file of a map, with the columns of a prediction."""
    table = {"polar_deg": np.array([0.0, 90.0]), "seat": np.array([1, 2])}
    return dataset_content(map_dataset(pretravel_map, table))


def dataset_of(content: bytes) -> StoredDataset:
    """As `pretravel.files.netcdf.read_dataset`, in this process."""
    try:
        with h5netcdf.File(io.BytesIO(content), "r") as file:
            header, buffers = netcdf_worker.content(file, 10**9)
    except Exception as error:
        raise SourceFile("map.nc", content).error(f"not read: {error}") from error
    return restored_dataset(json.loads(json.dumps(header)), memoryview(b"".join(buffers)))


def map_of(content: bytes) -> PretravelMap:
    return map_from_dataset(dataset_of(content))


def everything(pretravel_map: PretravelMap) -> str:
    """The same for two maps that are equal in all that they contain."""
    return content_digest(map_dataset(pretravel_map), without="content_sha256")


@cache
def averaged_example() -> PretravelMap:
    from dataclasses import replace

    maps = [example_map("harmonic"), example_map("mean")]
    basis, coefficients, covariance = averaged_map(maps, [np.zeros(3)] * 2, [0.7, 0.3])
    return replace(maps[0], basis=basis, coefficients=coefficients, covariance=covariance)
