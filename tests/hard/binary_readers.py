"""The readers of binary files, with samples of their files."""

from __future__ import annotations

import io
import os
import signal
import sqlite3
import tempfile
import warnings
from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

import numpy as np

from pretravel.compensation.points import Points
from pretravel.directions import sphere_pattern_25
from pretravel.formats import netcdf, netcdf_worker
from pretravel.formats.file_format import ReadingOptions
from pretravel.formats.history_drift import drift_of_history
from pretravel.formats.map_dataset import map_dataset
from pretravel.formats.map_file import read_map
from pretravel.formats.netcdf import dataset_content
from pretravel.formats.point_tables import points_dataset, points_table
from pretravel.formats.points_reading import read_points
from pretravel.formats.probe_history import read_history
from pretravel.formats.readings import read_readings
from pretravel.formats.source_file import SourceFile
from pretravel.report.history_report import history_columns, history_document
from tests.support.mutated_files import Reader, at_a_path
from tests.support.stored_maps import map_of

MAPS = Path(__file__).parents[1] / "unit" / "formats" / "data" / "maps_version_1"


def _maps() -> tuple[bytes, ...]:
    """Of both formats; all kinds that differ in what they store."""
    names = ("harmonic_with_delay", "mean", "physical_with_delay", "tabulated", "wozniak")
    earlier = [(MAPS / f"{name}.nc").read_bytes() for name in names]
    return (*earlier, *(dataset_content(map_dataset(map_of(content))) for content in earlier))


def _read_map(path: Path) -> object:
    """The map is used too: whatever was read has values and an uncertainty."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of format 1
        found = read_map(path)
    return found.pretravel_and_uncertainty(found.support.nodes @ found.rotation.T)


def _points() -> Points:
    normals = sphere_pattern_25()[:8]
    return Points(
        positions=15.0 * normals,
        normals=normals,
        pretravel=np.full(8, 0.01),
        deviation=None,
        covariance=1e-6 * np.tile(np.eye(3), (8, 1, 1)),
        labels=tuple(f"p{i}" for i in range(8)),
        shared={"tip radius": np.full(8, 1e-4)},
    )


def _parquet(columns: dict[str, object]) -> bytes:
    import pyarrow as pa
    from pyarrow import parquet

    stream = io.BytesIO()
    parquet.write_table(pa.table(columns), stream)
    return stream.getvalue()


def _tables() -> tuple[bytes, ...]:
    """Touches with labels, and with the columns that other programs write."""
    n = sphere_pattern_25()[:8]
    names = ("x_mm", "y_mm", "z_mm", "nx", "ny", "nz")
    touches = dict(zip(names, np.hstack([15.0 * n, n]).T, strict=True))
    import pyarrow as pa

    others = {
        "label": pa.array([f"p{i}" for i in range(8)]).dictionary_encode(),
        "time": pa.array(range(8), pa.timestamp("us", "Europe/Berlin")),
        "day": pa.array(range(8), pa.date32()),
        "raw": pa.array([b"\xff\x00"] * 8),
        "gap": pa.array([None] * 8, pa.float32()),
    }
    return _parquet(touches), _parquet(touches | others)


def _read_table(content: bytes) -> object:
    return read_readings(SourceFile("t.parquet", content), ReadingOptions())


def _history() -> tuple[bytes, ...]:
    """Also one with all columns empty, and one page larger."""
    earlier = (MAPS / "history.sqlite").read_bytes()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "h.sqlite"
        path.write_bytes(earlier)
        connection = sqlite3.connect(path)
        connection.execute("UPDATE verification SET size_um = NULL, u_size_um = NULL")
        connection.commit()
        connection.close()
        return earlier, path.read_bytes()


def _read_history(path: Path) -> object:
    """And what is made of one: its drift, report and table."""
    entries = read_history(path)
    history_document(entries)
    return drift_of_history(entries), history_columns(entries)


def _forked(content: bytes) -> tuple[int, bytes]:
    """As `pretravel.formats.netcdf.run_worker`, ten times as fast: nothing is imported anew."""
    ours, theirs = os.pipe()
    child = os.fork()
    if child == 0:
        os.close(ours)
        try:
            with os.fdopen(theirs, "wb") as out:
                out.writelines(netcdf_worker.answer(content, netcdf.largest_content(content)))
        finally:
            os._exit(0)
    os.close(theirs)
    try:
        with os.fdopen(ours, "rb") as answer:
            found = answer.read()
    except BaseException:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
        raise
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), found


def _quickly(read: Callable[[bytes], object]) -> Callable[[bytes], object]:
    def read_content(content: bytes) -> object:
        with patch.object(netcdf, "run_worker", _forked):
            return read(content)

    return read_content


BINARY_READERS: tuple[Reader, ...] = (
    Reader("map", _quickly(at_a_path(_read_map, "map.nc")), _maps(), binary=True),
    Reader(
        "points_netcdf",
        _quickly(lambda content: read_points(SourceFile("points.nc", content))),
        (dataset_content(points_dataset(_points())),),
        binary=True,
    ),
    Reader(
        "points_parquet",
        lambda content: read_points(SourceFile("points.parquet", content)),
        (_parquet(dict(points_table(_points()))),),
        binary=True,
    ),
    Reader("parquet", _read_table, _tables(), binary=True),
    Reader("history", at_a_path(_read_history, "h.sqlite"), _history(), binary=True),
)
