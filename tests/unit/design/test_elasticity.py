"""Elements, faces and loads of a small block against integrals of polynomials."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from skfem import MeshTet

from pretravel.base.arrays import FloatArray, IntArray
from pretravel.design.fem import interface_loads as loads
from pretravel.design.fem.elasticity import (
    _seat_regions,
    element_stiffness,
    rigid_motions,
    stress_of,
    upper_stiffness,
)
from pretravel.design.fem.finite_element_mesh import (
    FiniteElementMesh,
    element_unknowns,
    mesh_quality,
)
from pretravel.design.fem.quadrature import face_quadrature, quadrature
from pretravel.design.fem.regions import SPRING, TIP, seat_face
from pretravel.prediction.description import Probe
from pretravel.prediction.materials import material
from pretravel.prediction.seats import seat_frame

EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
STEEL, CARBIDE = material("steel"), material("tungsten carbide")
MATERIALS = {"low": STEEL, TIP: CARBIDE}
SIDE = 2.0  # mm


def _sixfold_volumes(corners: FloatArray) -> FloatArray:
    """Of tetrahedra, (m, 4, 3); negative for those of the other sense."""
    return np.asarray(np.linalg.det(corners[:, 1:] - corners[:, :1]))


def _block(count: int = 2) -> FiniteElementMesh:
    """A cube on the plane z = 0, its axis on the z axis; the upper half is the tip.

    The face `spring` is the upper side, `seat A-left` the lower one.
    """
    axis = np.linspace(0.0, SIDE, count + 1)
    grid = MeshTet.init_tensor(axis, axis, axis)
    corners, tetrahedra = grid.p.T - [0.5 * SIDE, 0.5 * SIDE, 0.0], grid.t.T.copy()
    turned = _sixfold_volumes(corners[tetrahedra]) < 0.0
    tetrahedra[turned] = tetrahedra[turned][:, [0, 1, 3, 2]]
    ends = sorted({tuple(sorted((t[a], t[b]))) for t in tetrahedra.tolist() for a, b in EDGES})
    middle = {pair: len(corners) + k for k, pair in enumerate(ends)}

    def between(a: int, b: int) -> int:
        return middle[(min(a, b), max(a, b))]

    def side(height: float) -> IntArray:
        found = []
        for t in tetrahedra.tolist():
            own = [k for k in t if abs(corners[k, 2] - height) < 1e-9]
            if len(own) == 3:
                a, b, c = own
                found.append([a, b, c, between(a, b), between(b, c), between(a, c)])
        return np.array(found)

    elements = [[*t, *(between(t[a], t[b]) for a, b in EDGES)] for t in tetrahedra.tolist()]
    high = corners[tetrahedra].mean(axis=1)[:, 2] > 0.5 * SIDE
    return FiniteElementMesh(
        points=np.concatenate([corners, [0.5 * (corners[a] + corners[b]) for a, b in ends]]),
        elements=np.array(elements),
        regions=high.astype(int),
        region_names=("low", TIP),
        faces={SPRING: side(SIDE), seat_face(0): side(0.0)},
        boundary=np.zeros((0, 6), dtype=int),
        quality=np.ones(len(elements)),
    )


@pytest.fixture(scope="module")
def block() -> FiniteElementMesh:
    return _block()


@pytest.fixture(scope="module")
def slanted(block: FiniteElementMesh) -> FiniteElementMesh:
    """The block after an affine change: uneven tetrahedra, still with straight edges."""
    change = np.array([[1.0, 0.3, -0.2], [0.1, 0.8, 0.4], [0.0, -0.3, 1.2]])
    return replace(block, points=block.points @ change.T + [0.3, -0.2, 5.0])


def _monomials(points: FloatArray) -> FloatArray:
    """1, x, y, z and their products, (..., 10)."""
    x, y, z = np.moveaxis(points, -1, 0)
    return np.stack([x**0, x, y, z, x * x, y * y, z * z, x * y, y * z, x * z], axis=-1)


def _slopes(points: FloatArray) -> FloatArray:
    """Of the monomials, (..., 10, 3)."""
    x, y, z = np.moveaxis(points, -1, 0)
    o, e = 0.0 * x, x**0
    along_x = np.stack([o, e, o, o, 2 * x, o, o, y, o, z], axis=-1)
    along_y = np.stack([o, o, e, o, o, 2 * y, o, x, z, o], axis=-1)
    along_z = np.stack([o, o, o, e, o, o, 2 * z, o, y, x], axis=-1)
    return np.stack([along_x, along_y, along_z], axis=-1)


def test_volumes_of_elements_turned_inside_out_are_negative(slanted: FiniteElementMesh) -> None:
    volumes = _sixfold_volumes(slanted.points[slanted.elements[:, :4]]) / 6.0
    for sign in (1.0, -1.0):
        mesh = replace(slanted, points=slanted.points * [1.0, 1.0, sign])
        assert quadrature(mesh).weights.sum(axis=1) == pytest.approx(sign * volumes, rel=1e-12)


def test_stiffness_is_the_energy_of_second_degree_displacements(
    slanted: FiniteElementMesh,
) -> None:
    """Their strains are linear: with corner values f and g of a tetrahedron of volume V,
    ∫ f g = V (Σf Σg + Σ f g) / 20. Thirty displacements determine each matrix."""
    stiffness = element_stiffness(slanted, MATERIALS)
    volumes = _sixfold_volumes(slanted.points[slanted.elements[:, :4]]) / 6.0
    for element in (0, 7, len(stiffness) - 1):
        nodes = slanted.points[slanted.elements[element]]
        moved = np.einsum("am,ij->aimj", _monomials(nodes), np.eye(3)).reshape(30, 30)
        found = moved.T @ stiffness[element] @ moved
        gradient = np.einsum("cmj,ik->cijmk", _slopes(nodes[:4]), np.eye(3)).reshape(4, 3, 3, 30)
        strain = 0.5 * (gradient + gradient.transpose(0, 2, 1, 3))
        own = MATERIALS[slanted.region_names[slanted.regions[element]]]
        e, nu = own.youngs_modulus, own.poissons_ratio
        trace = np.einsum("ciim->cm", strain)
        # Hooke's law with modulus and ratio.
        stress = strain + nu / (1.0 - 2.0 * nu) * np.einsum("cm,ij->cijm", trace, np.eye(3))
        stress *= e / (1.0 + nu)
        sums = np.einsum("ijm,ijn->mn", stress.sum(axis=0), strain.sum(axis=0))
        sums += np.einsum("cijm,cijn->mn", stress, strain)
        expected = volumes[element] / 20.0 * sums
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())


def test_the_upper_triangle_is_that_of_the_sum_of_elements(slanted: FiniteElementMesh) -> None:
    """Its rigid motions cost nothing: three translations, and turns about the axes."""
    stiffness = element_stiffness(slanted, MATERIALS)
    whole = np.zeros((slanted.unknowns, slanted.unknowns))
    for own, matrix in zip(element_unknowns(slanted), stiffness, strict=True):
        whole[np.ix_(own, own)] += matrix
    assert slanted.corners == 27
    found = upper_stiffness(slanted, stiffness).toarray()
    assert np.abs(found - np.triu(whole)).max() < 1e-9 * np.abs(whole).max()
    motions = rigid_motions(slanted.points)
    assert np.abs(whole @ motions).max() < 1e-8 * np.abs(whole).max()
    moved = motions.reshape(-1, 3, 6)
    x, y, z = slanted.points.T
    for column, turned in enumerate(([0 * x, -z, y], [z, 0 * x, -x], [-y, x, 0 * x])):
        assert moved[:, :, column] == pytest.approx(np.tile(np.eye(3)[column], (len(x), 1)))
        assert moved[:, :, 3 + column] == pytest.approx(np.stack(turned, axis=1))


def test_von_mises_stress_of_simple_states(slanted: FiniteElementMesh) -> None:
    """E times the strain of a pulled bar, root of three times a shear stress, none of pressure;
    of a strain that grows along x the mean over an element where it has one sign."""
    young = np.array([STEEL.youngs_modulus, CARBIDE.youngs_modulus])[slanted.regions]
    ratio = np.array([STEEL.poissons_ratio, CARBIDE.poissons_ratio])[slanted.regions]
    points = slanted.points
    for name in (0, 1):
        own = (STEEL, CARBIDE)[name].poissons_ratio
        here = slanted.regions == name
        pulled = stress_of(slanted, MATERIALS)(1e-3 * points * [-own, 1.0, -own])
        assert pulled[here] == pytest.approx(1e-3 * young[here], rel=1e-9)
    sheared = stress_of(slanted, MATERIALS)(1e-3 * points[:, [1, 0, 2]] * [1.0, 0.0, 0.0])
    shear = 1e-3 * young / (2.0 * (1.0 + ratio))
    assert sheared == pytest.approx(math.sqrt(3.0) * shear, rel=1e-9)
    assert stress_of(slanted, MATERIALS)(1e-3 * points).max() < 1e-6
    # u = y²/2 along x: the shear strain is y.
    far = replace(slanted, points=points + 10.0 * np.eye(3)[1])
    bent = np.zeros_like(points)
    bent[:, 0] = 0.5 * far.points[:, 1] ** 2
    mean = far.points[far.elements[:, :4], 1].mean(axis=1)
    assert stress_of(far, MATERIALS)(bent) == pytest.approx(1e3 * math.sqrt(3.0) * shear * mean)


def test_quality_of_tetrahedra() -> None:
    """Of any shape by the equations of the inner and the outer sphere; none of a flat one."""
    flat = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], dtype=float)
    points = np.random.default_rng(4).standard_normal((4, 3))
    apart = points[1:] - points[0]
    centre = np.linalg.solve(2.0 * apart, np.sum(apart**2, axis=1))
    area = sum(
        0.5 * np.linalg.norm(np.cross(points[j] - points[i], points[k] - points[i]))
        for i, j, k in ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))
    )
    inner = 3.0 * abs(np.linalg.det(apart)) / 6.0 / area
    expected = [3.0 * inner / np.linalg.norm(centre), 0.0]
    assert mesh_quality(np.stack([points, flat])) == pytest.approx(expected, abs=1e-12)


def test_faces_are_integrated_to_the_sixth_degree(block: FiniteElementMesh) -> None:
    """x⁴ y² over a square of side 2 about the axis: (2/5) (2/3); normals along the axis."""
    for name, height in ((SPRING, SIDE), (seat_face(0), 0.0)):
        points = face_quadrature(block, name)
        assert points.areas.sum() == pytest.approx(SIDE**2, rel=1e-12)
        x, y, z = np.moveaxis(points.positions, -1, 0)
        assert z == pytest.approx(np.full(z.shape, height), abs=1e-12)
        assert np.sum(x**4 * y**2 * points.areas) == pytest.approx(4.0 / 15.0, rel=1e-12)
        assert np.abs(points.normals[..., 2]) == pytest.approx(points.areas, rel=1e-12)
        assert points.nodes.tolist() == block.faces[name].tolist()
        nodal = _monomials(block.points)[points.nodes][..., 7]
        assert nodal @ points.shapes.T == pytest.approx(x * y, abs=1e-12)


def test_parts_under_the_seats_are_found(block: FiniteElementMesh) -> None:
    """A face that the seats do not push on does not count."""
    low, high = block.faces[seat_face(0)], block.faces[SPRING]
    for faces, regions in (
        ({SPRING: high, seat_face(0): low}, ["low"]),
        ({SPRING: low, seat_face(3): high}, [TIP]),
        ({seat_face(0): low, seat_face(5): high}, ["low", TIP]),
    ):
        assert _seat_regions(replace(block, faces=faces)) == regions


def test_hertz_pressure_is_one_newton_through_the_contact() -> None:
    """Over a circle of radius a: the mean of r² is 2 a² / 5. Triangles that the circle cuts leave
    errors of some per cent of it."""
    mesh, radius, contact = _block(6), 0.7, np.array([0.15, -0.15, 0.0])
    nodal = loads.hertz_pressure(mesh, seat_face(0), contact, (np.eye(3)[0], np.eye(3)[1]), radius)
    assert nodal.sum() == pytest.approx(1.0, rel=1e-12)
    assert nodal @ mesh.points == pytest.approx(contact, abs=1e-12)
    away = mesh.points - contact
    for axis in (0, 1):
        assert nodal @ away[:, axis] ** 2 == pytest.approx(0.2 * radius**2, rel=0.03)
    beyond = np.linalg.norm(away, axis=1) > radius + 0.5
    assert np.abs(nodal[beyond]).max() < 1e-12


def test_loads_of_a_sixth_are_those_of_its_seat(block: FiniteElementMesh, omp40: Probe) -> None:
    """Columns: the first seat's normal and both tangents, tip and spring; the other seats none.

    Tip and spring are even over the half cube and the square: means of squares are s²/12. On a
    sixth of the body its images cancel the moments.
    """
    assert loads.INTERFACE[:3] == ("seat A-left", "seat A-right", "seat B-left")
    assert loads.INTERFACE[6:12] == (
        "tip x", "tip y", "tip z", "spring", "along A-left", "around A-left",
    )  # fmt: skip
    assert len(loads.INTERFACE) == 22
    frame = seat_frame(omp40)
    contact = frame.contacts(omp40.tripod.rod_radius)[0]
    # The lower side is laid where the first seat touches, with its normal; the upper half has the
    # middle of the tip.
    axes = np.stack([frame.along[0], frame.around[0], frame.normals[0]])
    tip = np.array([0.0, 0.0, -omp40.lever])
    placed = block.points @ axes + contact
    upper = block.points[:, 2] > 0.4 * SIDE
    placed[upper] = block.points[upper] + tip - [0.0, 0.0, 0.75 * SIDE]
    mesh = replace(block, points=placed)
    found = loads.interface_loads(omp40, mesh, 0.9, sixth=True).reshape(-1, 3, 22)
    total = found.sum(axis=0)
    assert total[:, 0] == pytest.approx(frame.normals[0], abs=1e-12)
    assert total[:, 10] == pytest.approx(frame.along[0], abs=1e-12)
    assert total[:, 11] == pytest.approx(frame.around[0], abs=1e-12)
    assert 6.0 * total[:, loads.TIP_FORCE] == pytest.approx(np.eye(3), abs=1e-9)
    assert 6.0 * total[:, loads.SPRING_FORCE] == pytest.approx([0.0, 0.0, -1.0], abs=1e-12)
    assert np.abs(found[:, :, [1, 2, 3, 4, 5, *range(12, 22)]]).max() == 0.0
    moment = np.cross(mesh.points[:, None, :], found.transpose(0, 2, 1)).sum(axis=0)
    assert moment[0] == pytest.approx(np.cross(contact, frame.normals[0]), abs=1e-9)
    assert moment[11] == pytest.approx(np.cross(contact, frame.around[0]), abs=1e-9)
    even = [SIDE**2 / 12.0, SIDE**2 / 12.0, SIDE**2 / 48.0]
    for axis in range(3):
        weights = 6.0 * found[:, axis, 6 + axis]
        assert weights @ (placed - tip) ** 2 == pytest.approx(even, rel=1e-9)
        assert weights @ placed == pytest.approx(tip, abs=1e-9)
        assert np.abs(weights[~upper]).max() == 0.0
    spring = -6.0 * found[:, 2, loads.SPRING_FORCE]
    assert spring @ placed[:, :2] ** 2 == pytest.approx(even[:2], rel=1e-9)
