"""Input file of CalculiX for a probe with six balls: full nonlinear contact in two steps."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import numpy as np

from pretravel.design.fem.elasticity import FiniteElementModel
from pretravel.design.fem.finite_element_mesh import FiniteElementMesh
from pretravel.design.fem.interface_loads import SPRING_FORCE
from pretravel.design.fem.regions import seat_face
from pretravel.design.fem.seat_ball import CONTACT, ball_held
from pretravel.prediction.description import Probe
from pretravel.six_seats.seat_frames import seat_frame

# Corners of the faces S1 to S4 of a tetrahedron: the numbers of CalculiX minus one.
_FACES = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))
STIFFNESS = 1e9
"""Stiffness of the contact's penalty, N/mm³: at 2000 MPa rods and balls overlap by 2 nm."""
OVERLAP = 1e-4
"""Displacement of all balls towards the rods, mm, which closes the contacts at the start.

It lifts the whole tripod by the same amount in both steps."""


def _rows(values: Iterable[object], per_line: int = 8) -> str:
    texts = [str(value) for value in values]
    return "".join(
        ", ".join(texts[i : i + per_line]) + ",\n" for i in range(0, len(texts), per_line)
    )


def _surface(mesh: FiniteElementMesh, face: str, offset: int) -> str:
    wanted = {tuple(row) for row in np.sort(mesh.faces[face][:, :3], axis=1).tolist()}
    touching = np.flatnonzero(np.isin(mesh.elements[:, :4], mesh.faces[face][:, :3]).sum(1) >= 3)
    lines = []
    for element in touching:
        corners = mesh.elements[element, :4]
        for number, face_corners in enumerate(_FACES, start=1):
            if tuple(sorted(corners[list(face_corners)].tolist())) in wanted:
                lines.append(f"{element + 1 + offset}, S{number}\n")
    assert len(lines) == len(wanted)
    return "".join(lines)


def write_deck(
    path: Path, probe: Probe, model: FiniteElementModel, ball: FiniteElementMesh, force: np.ndarray
) -> None:
    """Write the input file: step 1 applies the preload, step 2 adds the force on the tip.

    CalculiX prints the displacements of the nodes of the tip and the reactions of each ball.
    """
    mesh, frame = model.mesh, seat_frame(probe)
    contacts = frame.contacts(probe.tripod.rod_radius)
    node_count, element_count = len(mesh.points), len(mesh.elements)
    with path.open("w", encoding="ascii") as out:
        out.write("*NODE, NSET=ALL\n")
        for number, (x, y, z) in enumerate(mesh.points, start=1):
            out.write(f"{number}, {x:.12e}, {y:.12e}, {z:.12e}\n")
        for seat in range(6):
            axes = np.stack([frame.along[seat], frame.around[seat], frame.normals[seat]])
            moved = contacts[seat] + OVERLAP * frame.normals[seat] + ball.points @ axes
            first = node_count + seat * len(ball.points) + 1
            for number, (x, y, z) in enumerate(moved, start=first):
                out.write(f"{number}, {x:.12e}, {y:.12e}, {z:.12e}\n")
        for index, region in enumerate(mesh.region_names):
            out.write(f"*ELEMENT, TYPE=C3D10, ELSET=R{index}\n")
            for element in np.flatnonzero(mesh.regions == index):
                out.write(_rows([element + 1, *(mesh.elements[element] + 1)], 16))
            material = model.materials[region]
            out.write(f"*MATERIAL, NAME=M{index}\n*ELASTIC\n")
            out.write(f"{material.youngs_modulus!r}, {material.poissons_ratio!r}\n")
            out.write(f"*SOLID SECTION, ELSET=R{index}, MATERIAL=M{index}\n")
        out.write("*ELEMENT, TYPE=C3D10, ELSET=BALLS\n")
        for seat in range(6):
            nodes = node_count + seat * len(ball.points) + 1
            elements = element_count + seat * len(ball.elements) + 1
            for element in range(len(ball.elements)):
                out.write(_rows([elements + element, *(ball.elements[element] + nodes)], 16))
        material = probe.seats.material
        out.write("*MATERIAL, NAME=BALL\n*ELASTIC\n")
        out.write(f"{material.youngs_modulus!r}, {material.poissons_ratio!r}\n")
        out.write("*SOLID SECTION, ELSET=BALLS, MATERIAL=BALL\n")
        held = ball_held(probe.seats.ball_radius, ball)
        out.write("*SURFACE INTERACTION, NAME=SEAT\n")
        out.write("*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR\n")
        out.write(f"{STIFFNESS:e}\n")
        for seat in range(6):
            nodes = node_count + seat * len(ball.points) + 1
            out.write(f"*NSET, NSET=HELD{seat}\n" + _rows(held + nodes))
            out.write(f"*BOUNDARY\nHELD{seat}, 1, 3\n")
            out.write(f"*SURFACE, NAME=ROD{seat}, TYPE=ELEMENT\n")
            out.write(_surface(mesh, seat_face(seat), 0))
            out.write(f"*SURFACE, NAME=BALL{seat}, TYPE=ELEMENT\n")
            out.write(_surface(ball, CONTACT, element_count + seat * len(ball.elements)))
            out.write("*CONTACT PAIR, INTERACTION=SEAT, TYPE=SURFACE TO SURFACE\n")
            out.write(f"ROD{seat}, BALL{seat}\n")
        tip = np.flatnonzero(model.loads[0::3, 6])
        out.write("*NSET, NSET=TIP\n" + _rows(tip + 1))
        spring = model.loads[2::3, SPRING_FORCE]
        printed = "*NODE PRINT, NSET=TIP\nU\n" + "".join(
            f"*NODE PRINT, NSET=HELD{seat}, TOTALS=ONLY\nRF\n" for seat in range(6)
        )
        out.write("*STEP, INC=200\n*STATIC\n1., 1.\n*CLOAD\n")
        for node in np.flatnonzero(spring):
            out.write(f"{node + 1}, 3, {probe.preload * spring[node]:.12e}\n")
        out.write(printed + "*END STEP\n*STEP, INC=200\n*STATIC\n1., 1.\n*CLOAD\n")
        weights = model.loads[0::3, 6]
        for node in tip:
            for axis in range(3):
                out.write(f"{node + 1}, {axis + 1}, {force[axis] * weights[node]:.12e}\n")
        out.write(printed + "*END STEP\n")
