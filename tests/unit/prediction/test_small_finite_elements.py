"""Elements, faces and loads of a small block against integrals of polynomials."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import permutations, product

import numpy as np
import pytest

from pretravel.base.arrays import FloatArray, IntArray
from pretravel.prediction.description import Probe
from pretravel.prediction.fem import interface_loads as loads
from pretravel.prediction.fem.elasticity import (
    _seat_regions,
    element_stiffness,
    lame,
    rigid_motions,
    upper_stiffness,
    von_mises,
)
from pretravel.prediction.fem.finite_element_mesh import (
    FiniteElementMesh,
    element_unknowns,
    mesh_quality,
)
from pretravel.prediction.fem.quadrature import face_quadrature, quadrature, triangle_shapes
from pretravel.prediction.fem.regions import SPRING, TIP, seat_face
from pretravel.prediction.materials import Material, material
from pretravel.prediction.seat_frame import seat_frame

EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
STEEL, CARBIDE = material("steel"), material("tungsten carbide")
MATERIALS = {"low": STEEL, TIP: CARBIDE}
SIDE = 2.0  # mm


def _tetrahedra_of_cubes(count: int) -> tuple[FloatArray, IntArray]:
    """Corners of count³ cubes, and six tetrahedra in each, all of one sense."""
    axis = np.arange(count + 1)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    number = {tuple(p): k for k, p in enumerate(points.tolist())}
    tetrahedra = []
    for corner in product(range(count), repeat=3):
        for order in permutations(range(3)):
            at = np.array(corner)
            own = [number[tuple(at.tolist())]]
            for step in order:
                at = at + np.eye(3, dtype=int)[step]
                own.append(number[tuple(at.tolist())])
            a, b, c, d = points[own]
            if np.linalg.det([b - a, c - a, d - a]) < 0.0:
                own[2], own[3] = own[3], own[2]
            tetrahedra.append(own)
    return points * (SIDE / count), np.array(tetrahedra)


def _block(count: int = 2) -> FiniteElementMesh:
    """A cube on the plane z = 0, its axis on the z axis; the upper half is the tip.

    The face `spring` is the upper side, `seat A-left` the lower one. An affine change makes the
    tetrahedra uneven in volume and shape nowhere on those faces.
    """
    corners, tetrahedra = _tetrahedra_of_cubes(count)
    corners = corners - [0.5 * SIDE, 0.5 * SIDE, 0.0]
    ends = sorted({tuple(sorted((t[a], t[b]))) for t in tetrahedra.tolist() for a, b in EDGES})
    middle = {pair: len(corners) + k for k, pair in enumerate(ends)}

    def between(a: int, b: int) -> int:
        return middle[(min(a, b), max(a, b))]

    elements = [[*t, *(between(t[a], t[b]) for a, b in EDGES)] for t in tetrahedra.tolist()]
    points = np.concatenate([corners, [0.5 * (corners[a] + corners[b]) for a, b in ends]])

    def side(height: float) -> IntArray:
        found = []
        for t in tetrahedra.tolist():
            own = [k for k in t if abs(corners[k, 2] - height) < 1e-9]
            if len(own) == 3:
                a, b, c = own
                found.append([a, b, c, between(a, b), between(b, c), between(a, c)])
        return np.array(found)

    high = corners[tetrahedra].mean(axis=1)[:, 2] > 0.5 * SIDE
    return FiniteElementMesh(
        points=points,
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


def _volumes(mesh: FiniteElementMesh) -> FloatArray:
    a, b, c, d = np.moveaxis(mesh.points[mesh.elements[:, :4]], 1, 0)
    return np.asarray(np.linalg.det(np.stack([b - a, c - a, d - a], axis=1)) / 6.0)


def test_quadrature_differentiates_and_integrates(slanted: FiniteElementMesh) -> None:
    """Second-degree functions have their slopes at each point; volumes are exact."""
    found = quadrature(slanted)
    assert found.weights.sum(axis=1) == pytest.approx(_volumes(slanted), rel=1e-12)
    nodal = _monomials(slanted.points[slanted.elements])
    slopes = np.einsum("eqaj,eam->eqmj", found.gradients, nodal)
    # Of x the slope is 1, of y 0; of x y it is y, whose mean is that of the corners.
    mean = np.einsum("eq,eqmj->emj", found.weights, slopes) / _volumes(slanted)[:, None, None]
    centre = slanted.points[slanted.elements[:, :4]].mean(axis=1)
    assert mean == pytest.approx(_slopes(centre), abs=1e-9)
    # Turned inside out, a volume is negative.
    mirrored = replace(slanted, points=slanted.points * [1.0, 1.0, -1.0])
    assert quadrature(mirrored).weights == pytest.approx(-found.weights, rel=1e-12)


def test_stiffness_is_the_energy_of_second_degree_displacements(
    slanted: FiniteElementMesh,
) -> None:
    """Their strains are linear: with corner values f and g of a tetrahedron of volume V,
    ∫ f g = V (Σf Σg + Σ f g) / 20. Thirty displacements determine each matrix."""
    stiffness = element_stiffness(slanted, MATERIALS)
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
        volume = _volumes(slanted)[element]
        sums = np.einsum("ijm,ijn->mn", stress.sum(axis=0), strain.sum(axis=0))
        expected = volume / 20.0 * (sums + np.einsum("cijm,cijn->mn", stress, strain))
        assert found == pytest.approx(expected, rel=1e-9, abs=1e-9 * np.abs(expected).max())


def test_the_upper_triangle_is_that_of_the_sum_of_elements(slanted: FiniteElementMesh) -> None:
    stiffness = element_stiffness(slanted, MATERIALS)
    whole = np.zeros((slanted.unknowns, slanted.unknowns))
    for own, matrix in zip(element_unknowns(slanted), stiffness, strict=True):
        whole[np.ix_(own, own)] += matrix
    assert slanted.unknowns == 3 * len(slanted.points)
    assert slanted.corners == 27
    found = upper_stiffness(slanted, stiffness).toarray()
    assert found == pytest.approx(np.triu(whole), abs=1e-9 * np.abs(whole).max())
    # Its rigid motions: three translations, and turns about the axes.
    motions = rigid_motions(slanted.points)
    assert np.abs(whole @ motions).max() < 1e-8 * np.abs(whole).max()
    x, y, z = slanted.points.T
    assert motions[:, 3].reshape(-1, 3) == pytest.approx(np.stack([0 * x, -z, y], axis=1))
    assert motions[:, 4].reshape(-1, 3) == pytest.approx(np.stack([z, 0 * x, -x], axis=1))
    assert motions[:, 5].reshape(-1, 3) == pytest.approx(np.stack([-y, x, 0 * x], axis=1))


def test_lames_constants_have_modulus_and_ratio(block: FiniteElementMesh) -> None:
    first, second = lame(MATERIALS, block)
    for region, own in enumerate((STEEL, CARBIDE)):
        a, b = first[block.regions == region], second[block.regions == region]
        assert b * (3.0 * a + 2.0 * b) / (a + b) == pytest.approx(own.youngs_modulus, rel=1e-12)
        assert a / (2.0 * (a + b)) == pytest.approx(own.poissons_ratio, rel=1e-12)


def test_von_mises_stress_of_simple_states(slanted: FiniteElementMesh) -> None:
    """E times the strain of a pulled bar, root of three times a shear stress, none of pressure;
    of a strain that grows along x the mean over an element where it has one sign."""
    young = np.array([STEEL.youngs_modulus, CARBIDE.youngs_modulus])[slanted.regions]
    ratio = np.array([STEEL.poissons_ratio, CARBIDE.poissons_ratio])[slanted.regions]
    points = slanted.points
    for name in (0, 1):
        own = (STEEL, CARBIDE)[name].poissons_ratio
        here = slanted.regions == name
        pulled = von_mises(slanted, MATERIALS, 1e-3 * points * [-own, 1.0, -own])
        assert pulled[here] == pytest.approx(1e-3 * young[here], rel=1e-9)
    sheared = von_mises(slanted, MATERIALS, 1e-3 * points[:, [1, 0, 2]] * [1.0, 0.0, 0.0])
    shear = 1e-3 * young / (2.0 * (1.0 + ratio))
    assert sheared == pytest.approx(math.sqrt(3.0) * shear, rel=1e-9)
    assert von_mises(slanted, MATERIALS, 1e-3 * points).max() < 1e-6
    # u = y²/2 along x: the shear strain is y.
    far = replace(slanted, points=points + 10.0 * np.eye(3)[1])
    bent = np.zeros_like(points)
    bent[:, 0] = 0.5 * far.points[:, 1] ** 2
    mean = far.points[far.elements[:, :4], 1].mean(axis=1)
    assert von_mises(far, MATERIALS, bent) == pytest.approx(1e3 * math.sqrt(3.0) * shear * mean)


def test_quality_of_tetrahedra() -> None:
    """Regular: one. The corner of a cube: inner radius 1 / (3 + √3), outer one √3 / 2."""
    regular = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
    corner = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    flat = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], dtype=float)
    found = mesh_quality(np.stack([7.0 * regular, corner - 3.0, flat]))
    expected = [1.0, 3.0 / (3.0 + math.sqrt(3.0)) / (0.5 * math.sqrt(3.0)), 0.0]
    assert found == pytest.approx(expected, abs=1e-12)
    # Of any shape: by the equations of both spheres.
    points = np.random.default_rng(4).standard_normal((4, 3))
    apart = points[1:] - points[0]
    centre = np.linalg.solve(2.0 * apart, np.sum(apart**2, axis=1))
    area = sum(
        0.5 * np.linalg.norm(np.cross(points[j] - points[i], points[k] - points[i]))
        for i, j, k in ((0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3))
    )
    inner = 3.0 * abs(np.linalg.det(apart)) / 6.0 / area
    assert mesh_quality(points[None])[0] == pytest.approx(3.0 * inner / np.linalg.norm(centre))


def test_shape_functions_of_a_triangle() -> None:
    """One at their own node and zero at the others; slopes by differences; six monomials."""
    b, c = np.array([0, 1, 0, 0.5, 0.5, 0]), np.array([0, 0, 1, 0, 0.5, 0.5])
    assert triangle_shapes(b, c)[0] == pytest.approx(np.eye(6), abs=1e-15)
    rng = np.random.default_rng(0)
    b, c = 0.5 * rng.random(20), 0.5 * rng.random(20)
    values, by_b, by_c = triangle_shapes(b, c)
    h = 1e-6
    ahead, behind = triangle_shapes(b + h, c)[0], triangle_shapes(b - h, c)[0]
    assert by_b == pytest.approx((ahead - behind) / (2 * h), abs=1e-8)
    ahead, behind = triangle_shapes(b, c + h)[0], triangle_shapes(b, c - h)[0]
    assert by_c == pytest.approx((ahead - behind) / (2 * h), abs=1e-8)
    assert values.sum(axis=1) == pytest.approx(np.ones(20))


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
        nodal = np.einsum(
            "qa,ka->kq", points.shapes, _monomials(block.points)[points.nodes][..., 7]
        )
        assert nodal == pytest.approx(x * y, abs=1e-12)


def test_parts_under_the_seats_are_found(block: FiniteElementMesh) -> None:
    assert _seat_regions(block) == ["low"]
    # A face that the seats do not push on does not count.
    upper = {SPRING: block.faces[seat_face(0)], seat_face(3): block.faces[SPRING]}
    assert _seat_regions(replace(block, faces=upper)) == [TIP]
    both = {**block.faces, seat_face(5): block.faces[SPRING]}
    assert _seat_regions(replace(block, faces=both)) == ["low", TIP]


@pytest.mark.parametrize(("radius", "off"), [(0.9, 0.0), (0.7, 0.15)])
def test_hertz_pressure_is_one_newton_through_the_contact(radius: float, off: float) -> None:
    """Over a circle of radius a: the mean of r² is 2 a² / 5. Triangles that the circle cuts leave
    errors of some per cent of it."""
    mesh = _block(6)
    contact = np.array([off, -off, 0.0])
    nodal = loads.hertz_pressure(mesh, seat_face(0), contact, (np.eye(3)[0], np.eye(3)[1]), radius)
    assert nodal.sum() == pytest.approx(1.0, rel=1e-12)
    assert nodal @ mesh.points == pytest.approx(contact, abs=1e-12)
    away = mesh.points - contact
    assert nodal @ np.sum(away**2, axis=1) == pytest.approx(0.4 * radius**2, rel=0.03)
    for axis in (0, 1):
        assert nodal @ away[:, axis] ** 2 == pytest.approx(0.2 * radius**2, rel=0.03)
    beyond = np.linalg.norm(away, axis=1) > radius + 0.5
    assert np.abs(nodal[beyond]).max() < 1e-12


def test_forces_are_made_exact() -> None:
    """Of an uneven density: one newton, no moment about two places, near what was wanted."""
    rng = np.random.default_rng(3)
    density, measure = rng.random((5, 4)), rng.random((5, 4))
    arms = 100.0 * rng.standard_normal((2, 5, 4))
    forces = loads._exact(density, measure, arms)
    assert forces.sum() == pytest.approx(1.0, rel=1e-12)
    assert np.sum(forces * arms, axis=(1, 2)) == pytest.approx([0.0, 0.0], abs=1e-9)
    # The factor on the wanted force is linear in the arms.
    factor = (forces / (density * measure)).ravel()
    columns = np.stack([np.ones(20), *arms.reshape(2, 20)], axis=1)
    rest = factor - columns @ np.linalg.lstsq(columns, factor, rcond=None)[0]
    assert np.abs(rest).max() < 1e-9
    even = loads._exact(density, measure, np.zeros((0, 5, 4)))
    assert even == pytest.approx(density * measure / np.sum(density * measure), rel=1e-12)


def test_pressure_of_the_spring_and_force_on_the_tip_are_even(block: FiniteElementMesh) -> None:
    """Over the square of side 2 and the half cube: means of squares are s²/12."""
    spring = loads._spring_weights(block, sixth=False)
    assert spring.sum() == pytest.approx(1.0, rel=1e-12)
    assert spring @ block.points == pytest.approx([0.0, 0.0, SIDE], abs=1e-12)
    assert spring @ block.points**2 == pytest.approx([SIDE**2 / 12.0, SIDE**2 / 12.0, SIDE**2])
    centre = np.array([0.0, 0.0, 0.75 * SIDE])
    tip = loads._tip_weights(block, centre, sixth=False)
    assert tip.sum() == pytest.approx(1.0, rel=1e-12)
    assert tip @ block.points == pytest.approx(centre, abs=1e-12)
    square = [SIDE**2 / 12.0, SIDE**2 / 12.0, SIDE**2 / 48.0]
    assert tip @ (block.points - centre) ** 2 == pytest.approx(square, rel=1e-9)
    below = block.points[:, 2] < 0.49 * SIDE
    assert np.abs(tip[below]).max() == 0.0
    # Beside the middle of the volume the force still acts through the given place.
    beside = centre + np.array([0.02, -0.01, 0.015])
    moved = loads._tip_weights(block, beside, sixth=False)
    assert moved @ block.points == pytest.approx(beside, abs=1e-12)
    # A sixth of each on a sixth of the body; across the axis its images cancel the moments.
    for whole, part in (
        (spring, loads._spring_weights(block, sixth=True)),
        (tip, loads._tip_weights(block, beside, sixth=True)),
    ):
        assert part.sum() == pytest.approx(1.0 / 6.0, rel=1e-12)
        height = beside[2] if whole is tip else SIDE
        assert 6.0 * part @ block.points == pytest.approx([0.0, 0.0, height], abs=1e-12)


def test_loads_of_a_sixth_are_those_of_its_seat(block: FiniteElementMesh, omp40: Probe) -> None:
    """Columns: the first seat's normal and both tangents, tip and spring; the other seats none."""
    assert loads.INTERFACE[:3] == ("seat A-left", "seat A-right", "seat B-left")
    assert loads.INTERFACE[6:12] == (
        "tip x", "tip y", "tip z", "spring", "along A-left", "around A-left",
    )  # fmt: skip
    assert len(loads.INTERFACE) == 22
    frame = seat_frame(omp40)
    contact = frame.contacts(omp40.tripod.rod_radius)[0]
    # The lower side is laid where the first seat touches, with its normal.
    axes = np.stack([frame.along[0], frame.around[0], frame.normals[0]])
    tip = np.array([0.0, 0.0, -omp40.lever])
    placed = block.points @ axes + contact
    placed = np.where((block.points[:, 2] > 0.4 * SIDE)[:, None], block.points + tip, placed)
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


def test_half_space_under_hertz_pressure() -> None:
    """The mean of Hertz's displacement π p₀ (2 a² - r²) (1 - ν²) / (4 a E), weighted by the
    pressure: r² has the mean 2 a² / 5, and p₀ is 3 / (2 π a²) for a newton."""
    radius = 0.3
    own = Material("test", youngs_modulus=1e5, poissons_ratio=0.25, density=1e-6)
    peak = 1.5 / (math.pi * radius**2)
    mean = math.pi * peak * 1.6 * radius**2 / (4.0 * radius) * (1.0 - 0.25**2) / 1e5
    assert loads.half_space_compliance(own, radius) == pytest.approx(mean, rel=1e-12)
