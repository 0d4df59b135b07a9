"""The readers of binary files, with samples of their files."""

from __future__ import annotations

import io
import tempfile
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from unittest.mock import patch

import numpy as np

from pretravel.app.project import Project, StoredFile
from pretravel.app.project_file import project_bytes, project_of
from pretravel.base.directions import sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.design.fem import reduction_cache
from pretravel.design.fem.condensation import ElasticField, ReducedModel
from pretravel.design.fem.finite_element_mesh import FiniteElementMesh
from pretravel.design.fem.interface_loads import INTERFACE
from pretravel.files import netcdf
from pretravel.files.file_format import ReadingOptions
from pretravel.files.netcdf import dataset_content
from pretravel.files.points_reading import read_points
from pretravel.files.points_writing import points_dataset, points_table
from pretravel.files.readings import read_readings
from pretravel.files.source_file import SourceFile
from pretravel.measurement.points import Points
from pretravel.prediction.materials import material
from pretravel.surface.cad.kernel_process import CadContent, understood
from pretravel.surface.cad.part_file import read_part
from pretravel.surface.cad.step_part import part_from_content
from tests.support.examples import EXAMPLES
from tests.support.forked_processes import forked_worker
from tests.support.mutated_files import Reader, at_a_path

_SAMPLES = Path(__file__).parent / "samples"
BREP = _SAMPLES / "part.brep"
"""What the CAD kernel writes of examples/data/part.step."""
ASSEMBLY = _SAMPLES / "assembly.step"
"""Two roots, one of them an assembly of two levels with instances (`tests.support.step_files`).
What the kernel writes of it, with placements composed of several, ends with .brep."""


_composed, _STEP = ASSEMBLY.with_suffix(".brep"), EXAMPLES / "part.step"


def _project() -> bytes:
    project = Project("Probe 7", "0123456789abcdef")
    project.screen("engineer").settings.update({"diameter": 25.0, "excluded": [1, 2]})
    for purpose, name in (("touches", "a.csv"), ("touches_before", "b.csv")):
        project.screen("engineer").files[purpose] = (StoredFile(name, b"x_mm,y_mm\n1,2\n" * 20),)
    return project_bytes(project)


def _project_json() -> bytes:
    with zipfile.ZipFile(io.BytesIO(_project())) as archive:
        return archive.read("project.json")


def _read_project_json(content: bytes) -> object:
    """In an archive with the files of the sample."""
    target = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(_project())) as whole, zipfile.ZipFile(target, "w") as changed:
        for name in whole.namelist():
            changed.writestr(name, content if name == "project.json" else whole.read(name))
    return project_of(target.getvalue())


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


def _quickly(read: Callable[[bytes], object]) -> Callable[[bytes], object]:
    def read_content(content: bytes) -> object:
        with patch.object(netcdf, "run_worker", forked_worker):
            return read(content)

    return read_content


def _kept_model() -> tuple[bytes, ...]:
    """A reduced model of one tetrahedron."""
    size = len(INTERFACE)
    mesh = FiniteElementMesh(
        points=np.eye(10, 3),
        elements=np.arange(10)[None, :],
        regions=np.zeros(1, dtype=np.int64),
        region_names=("tip",),
        faces={"tip": np.arange(3)},
        boundary=np.arange(6)[None, :],
        quality=np.ones(1),
        notes=(),
    )
    field = ElasticField(mesh, {"tip": material("steel")}, np.zeros((size, 10, 3)))
    model = ReducedModel(
        flexibility=np.eye(size),
        flexibility_by_region={"tip": np.eye(size)},
        resultants=np.ones((6, size)),
        patch_compliance=1e-5,
        ball_correction=1e-6,
        seat_part="tripod",
        summary={"nodes": 10.0},
        load_field=lambda: field,
    )
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "reduced.npz"
        reduction_cache._write(path, model, "key")
        return (path.read_bytes(),)


def _read_kept_model(path: Path) -> object:
    def made_anew() -> ReducedModel:
        raise PretravelError("recomputed")

    path.chmod(0o600)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # of damage
        found = reduction_cache._read(path, "key", made_anew)
    return found and found.elastic_field


def _read_brep(content: bytes) -> object:
    """What the CAD kernel wrote: the part that the package computes from it."""
    path = Path("part.step")
    return part_from_content(
        CadContent(understood(content.decode("ascii", "replace"), path), ()), path
    )


BINARY_READERS: tuple[Reader, ...] = (
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
    Reader("kept_model", at_a_path(_read_kept_model, "reduced.npz"), _kept_model(), binary=True),
    Reader("project", project_of, (_project(),), binary=True),
    Reader("project_json", _read_project_json, (_project_json(),)),
    Reader("brep", _read_brep, (BREP.read_bytes(), _composed.read_bytes())),
    Reader("step", at_a_path(read_part, "part.step"), (_STEP.read_bytes(), ASSEMBLY.read_bytes())),
)
