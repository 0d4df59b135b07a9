"""A probe at the trigger as a VTU file for ParaView, written by meshio."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pretravel.base import MICROMETRE, needed, whole_file
from pretravel.design.fem.elastic_field import TriggerField


def write_vtu(path: str | Path, field: TriggerField) -> None:
    """Write the mesh, displacements, stresses and interface forces.

    Notes
    -----
    Point data: ``displacement_um`` (from rest to trigger) and ``force_N`` (on eight additional
    points: seats, tip, spring). Cell data: ``von_mises_MPa`` at the trigger and
    ``von_mises_rest_MPa`` at rest, ``region`` (index in the order of the mesh), ``quality``.
    Coordinates are in mm.
    """
    needed("meshio", "fem")
    import meshio

    mesh = field.elastic.mesh
    count, extra = len(mesh.points), len(field.points)
    displacement = np.concatenate([field.displacement / MICROMETRE, np.zeros((extra, 3))])
    force = np.concatenate([np.zeros((count, 3)), field.forces])
    marks = np.zeros(extra)
    content = meshio.Mesh(
        np.concatenate([mesh.points, field.points]),
        [("tetra10", mesh.elements), ("vertex", count + np.arange(extra)[:, None])],
        point_data={"displacement_um": displacement, "force_N": force},
        cell_data={
            "von_mises_MPa": [field.stress, marks],
            "von_mises_rest_MPa": [field.rest_stress, marks],
            "region": [mesh.regions.astype(np.int32), np.full(extra, -1, dtype=np.int32)],
            "quality": [mesh.quality, marks],
        },
    )
    with whole_file(path) as temporary:
        content.write(temporary, file_format="vtu")
