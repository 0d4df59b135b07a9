"""One sixth of a symmetric probe against its whole: group theory, mesh, condensed model."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pretravel.base.arrays import FloatArray
from pretravel.base.directions import from_angles
from pretravel.base.errors import MeshError
from pretravel.design.fem import mesh as fem_mesh
from pretravel.design.fem.compliance import FiniteElements
from pretravel.design.fem.condensation import ElasticField, condense
from pretravel.design.fem.elastic_field import field_at_trigger
from pretravel.design.fem.elasticity import FiniteElementModel, finite_element_model
from pretravel.design.fem.finite_element_mesh import FiniteElementMesh
from pretravel.design.fem.geometry import ProbeSolids, probe_body
from pretravel.design.fem.interface_loads import INTERFACE, SEATS, SPRING_FORCE, TIP_FORCE
from pretravel.design.fem.mesh import MeshSettings, mesh_solids
from pretravel.design.fem.quadrature import quadrature
from pretravel.design.fem.regions import SPRING, seat_face
from pretravel.design.fem.symmetry import ThreefoldSymmetry, adapted, threefold_symmetry
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.description import Probe
from pretravel.prediction.trigger import predict
from tests.support.coarse_models import COARSE, coarse_reduced, coarse_reduced_sixth, coarse_sixth

pytestmark = pytest.mark.long  # meshes of whole probes

COARSER = MeshSettings(refinement=0.2, grading=1.0)


def with_rods(probe: Probe, *degrees: float) -> Probe:
    azimuths = tuple(np.radians(degrees))
    return replace(probe, tripod=replace(probe.tripod, rod_azimuths=azimuths))


def sixth_solids(probe: Probe, settings: MeshSettings) -> ProbeSolids:
    return probe_body(probe, settings.patch_radius * probe.tripod.rod_radius)


def symmetry_of(probe: Probe) -> ThreefoldSymmetry:
    found = threefold_symmetry(probe)
    assert found is not None
    return found


@cache
def sixth_of_the_omp40() -> ProbeSolids:
    return sixth_solids(load_probe("omp40-2"), COARSE)


def whole_model(probe: Probe, solids: ProbeSolids, field: ElasticField) -> FiniteElementModel:
    """The images of the sixth as one mesh, assembled and loaded without any symmetry."""
    return finite_element_model(probe, replace(solids, symmetry=None), field.mesh)


@pytest.mark.parametrize(
    "degrees",
    [
        (10.0, 250.0, 130.0),  # turned, and in the other order
        pytest.param((0.0, 120.0, 240.0), marks=pytest.mark.slow),
        pytest.param((-37.0, 83.0, 203.0), marks=pytest.mark.slow),
    ],
)
def test_the_sixth_is_condensed_as_the_whole_of_its_images(
    omp40: Probe, degrees: tuple[float, ...]
) -> None:
    """The same mesh by the general path: the factorisations' rounding remains, 1e-16 times the
    condition number of bending against compression, 1e5."""
    probe = with_rods(omp40, *degrees)
    solids = sixth_solids(probe, COARSER)
    sixth = finite_element_model(probe, solids, mesh_solids(solids, COARSER))
    assert sixth.symmetry is not None
    reduced = condense(sixth)
    field = reduced.elastic_field
    whole = condense(whole_model(probe, solids, field))
    for name, part in whole.flexibility_by_region.items():
        size = np.abs(part).max()
        assert reduced.flexibility_by_region[name] == pytest.approx(part, abs=1e-7 * size)
    size = np.abs(whole.flexibility).max()
    assert reduced.flexibility == pytest.approx(whole.flexibility, abs=1e-9 * size)
    assert reduced.resultants == pytest.approx(whole.resultants, abs=1e-9)
    size = np.abs(field.modes).max()
    # A million numbers: pytest.approx compares each by itself, in seconds.
    assert_allclose(field.modes, whole.elastic_field.modes, rtol=0.0, atol=1e-9 * size)
    assert reduced.summary["unknowns"] == whole.summary["unknowns"]


def test_the_whole_mesh_is_closed_and_everywhere_once() -> None:
    """No two nodes coincide, each inner triangle belongs to two elements, none is inverted, and
    the outer triangles are those of a closed surface: their normals add up to zero."""
    sixth, whole = coarse_sixth().mesh, coarse_reduced_sixth().elastic_field.mesh
    weights = quadrature(whole).weights
    assert weights.min() > 0.0
    assert weights.sum() == pytest.approx(6.0 * quadrature(sixth).weights.sum(), rel=1e-12)
    assert len(np.unique(whole.points.round(6), axis=0)) == len(whole.points)
    corners = whole.elements[:, :4]
    triangles = np.concatenate([np.delete(corners, k, axis=1) for k in range(4)])
    _, shared = np.unique(np.sort(triangles, axis=1), axis=0, return_counts=True)
    assert set(shared) == {1, 2}
    assert np.sum(shared == 1) == len(whole.boundary)
    edges = np.concatenate([whole.boundary[:, [0, 1]], whole.boundary[:, [1, 2]],
                            whole.boundary[:, [0, 2]]])  # fmt: skip
    _, meeting = np.unique(np.sort(edges, axis=1), axis=0, return_counts=True)
    assert set(meeting) == {2}
    middles = whole.points[whole.boundary[:, 3]]
    ends = whole.points[whole.boundary[:, :2]]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    assert np.all(np.linalg.norm(middles - ends.mean(axis=1), axis=1) < 0.2 * lengths)


def test_every_seat_and_the_spring_have_their_face(omp40: Probe) -> None:
    """The middles of the patches are the contacts; the spring's face is the disc's top."""
    from pretravel.prediction.seats import seat_frame

    mesh = coarse_reduced_sixth().elastic_field.mesh
    contacts = seat_frame(omp40).contacts(omp40.tripod.rod_radius)
    patch = COARSE.patch_radius * omp40.tripod.rod_radius
    for seat in range(6):
        nodes = mesh.points[np.unique(mesh.faces[seat_face(seat)])]
        assert np.linalg.norm(nodes - contacts[seat], axis=1).max() < 1.1 * patch
    top = mesh.points[np.unique(mesh.faces[SPRING])]
    assert omp40.hub is not None
    assert top[:, 2] == pytest.approx(0.5 * omp40.hub.height, abs=1e-9)
    assert np.hypot(top[:, 0], top[:, 1]).max() == pytest.approx(omp40.hub.radius, rel=1e-9)


def test_predictions_have_the_symmetry_of_the_probe(omp40: Probe) -> None:
    """Rotated by 120° and mirrored at a rod: the same to rounding, which trigger forces of two
    seats that open together amplify."""
    model = FiniteElements(coarse_reduced_sixth())
    azimuth = np.radians(np.arange(1.0, 60.0, 7.0))

    def distance(azimuths: FloatArray) -> FloatArray:
        directions = from_angles(np.radians(75.0), azimuths)
        return predict(omp40, directions, model).sensing_distance

    first = distance(azimuth)
    for turn in (0.0, 2.0 * np.pi / 3.0, 4.0 * np.pi / 3.0):
        assert distance(turn + azimuth) == pytest.approx(first, rel=1e-10)
        assert distance(turn - azimuth) == pytest.approx(first, rel=1e-10)


def test_the_compliance_matrix_is_permuted_by_every_motion(omp40: Probe) -> None:
    flexibility, action = coarse_reduced_sixth().flexibility, symmetry_of(omp40).interface
    moved = np.einsum("gab,bc,gdc->gad", action, flexibility, action)
    size = np.abs(flexibility).max()
    assert np.abs(moved - flexibility).max() < 1e-14 * size
    # The elements of a mesh without symmetry differ.
    uneven = coarse_reduced().flexibility
    moved = np.einsum("gab,bc,gdc->gad", action, uneven, action)
    assert np.abs(moved - uneven).max() > 1e-6 * size


def test_the_sixth_agrees_with_a_whole_mesh_of_its_own(omp40: Probe) -> None:
    """Other elements of the same sizes: within the error of this coarse mesh, 1 %."""
    directions = from_angles(np.radians([90.0, 90.0, 50.0]), np.radians([0.0, 60.0, 200.0]))
    ours, theirs = (
        predict(omp40, directions, FiniteElements(reduced)).sensing_distance
        for reduced in (coarse_reduced_sixth(), coarse_reduced())
    )
    assert ours == pytest.approx(theirs, rel=5e-3)


def test_the_field_at_the_trigger_is_the_prediction(omp40: Probe) -> None:
    """The mean displacement of the tip, of all six images, is that of `predict`."""
    direction = from_angles(np.radians(80.0), np.radians(200.0))
    reduced = coarse_reduced_sixth()
    field = field_at_trigger(omp40, direction[0], reduced)
    trigger = predict(omp40, direction, FiniteElements(reduced))
    whole = whole_model(omp40, sixth_of_the_omp40(), field.elastic)
    tip = whole.loads[:, TIP_FORCE].T @ field.displacement.ravel()
    assert tip == pytest.approx(trigger.deflection[0], rel=1e-9, abs=1e-12)


def test_motions_form_a_group_that_permutes_the_loads(omp40: Probe) -> None:
    symmetry = symmetry_of(omp40)
    for matrices in (symmetry.motions, symmetry.interface, symmetry.rigid):
        products = np.einsum("gij,hjk->ghik", matrices, matrices)
        away = np.abs(products[:, :, None] - matrices).max(axis=(3, 4))
        assert np.all(away.min(axis=2) < 1e-12)
    wrenches = coarse_reduced().resultants
    for rigid, action in zip(symmetry.rigid, symmetry.interface, strict=True):
        # Moments in N mm; the patches' nodes lie within some nanometres of the rods' surface.
        assert rigid @ wrenches == pytest.approx(wrenches @ action, abs=1e-5)
    assert np.all(symmetry.interface[:, SPRING_FORCE, SPRING_FORCE] == 1.0)
    assert np.all(symmetry.interface[:, SEATS, SEATS].sum(axis=2) == 1.0)


def test_adapted_tuples_are_complete_and_transform_as_stated(omp40: Probe) -> None:
    """22 loads: the seats' three directions are three regular representations (A1 + A2 + 2 E
    each), the tip is A1 + E, the spring A1. Six rigid motions: A1 + A2 + 2 E."""
    symmetry = symmetry_of(omp40)
    for action, counts in ((symmetry.interface, (5, 3, 7)), (symmetry.rigid, (1, 1, 2))):
        everything = []
        for matrices, count in zip(symmetry.representations, counts, strict=True):
            tuples = adapted(action, matrices)
            assert tuples.shape == (action.shape[1], matrices.shape[1], count)
            moved = np.einsum("gab,bjm->gajm", action, tuples)
            assert moved == pytest.approx(np.einsum("aim,gij->gajm", tuples, matrices), abs=1e-12)
            everything.append(tuples.reshape(len(tuples), -1))
        basis = np.concatenate(everything, axis=1)
        assert basis.T @ basis == pytest.approx(np.eye(action.shape[1]), abs=1e-12)


def test_uneven_rods_and_wide_patches_are_meshed_whole(omp40: Probe) -> None:
    assert threefold_symmetry(with_rods(omp40, 0.0, 120.0, 240.001)) is None
    assert threefold_symmetry(with_rods(omp40, 5.0, 125.0, 245.0)) is not None
    steep = replace(omp40, seats=replace(omp40.seats, support_angle=np.radians(80.0)))
    assert probe_body(steep).symmetry is not None
    assert probe_body(steep, 0.16 * omp40.tripod.rod_radius).symmetry is None


def test_a_sixth_that_cannot_be_meshed_is_replaced_by_the_whole(
    omp40: Probe, monkeypatch: pytest.MonkeyPatch
) -> None:
    tried = []

    def no_sixths(solids: ProbeSolids, settings: MeshSettings) -> FiniteElementMesh:
        tried.append(solids.symmetry)
        if solids.symmetry is not None:
            raise MeshError("a sliver")
        return coarse_sixth().mesh

    monkeypatch.setattr(fem_mesh, "mesh_solids", no_sixths)
    monkeypatch.setattr(fem_mesh, "probe_body", lambda *_: sixth_of_the_omp40())
    solids, _ = fem_mesh.mesh_probe(omp40, COARSE)
    assert [symmetry is None for symmetry in tried] == [False, True]
    assert solids.symmetry is None
    assert len(solids.seats) == 6
    monkeypatch.setattr(fem_mesh, "probe_solids", lambda *_: sixth_of_the_omp40())
    with pytest.raises(MeshError, match="a sliver"):
        fem_mesh.mesh_probe(omp40, COARSE)


@pytest.mark.slow
def test_sensing_distance_converges(omp40: Probe) -> None:
    """As that of whole meshes; the extrapolated error of the default is below 0.5 %."""
    values = []
    for refinement in (0.5, 1.0, 2.0):
        settings = MeshSettings(refinement=refinement)
        solids = sixth_solids(omp40, settings)
        reduced = condense(finite_element_model(omp40, solids, mesh_solids(solids, settings)))
        walls = from_angles(np.radians([90.0, 90.0]), np.radians([0.0, 60.0]))
        values.append(predict(omp40, walls, FiniteElements(reduced)).sensing_distance)
    coarse, middle, fine = values
    assert np.all((coarse < middle) & (middle < fine))
    rate = np.log2((middle - coarse) / (fine - middle))
    assert np.all(rate > 0.5)
    limit = fine + (fine - middle) / (2.0**rate - 1.0)
    assert np.all(np.abs(limit - middle) / limit < 0.005)


def test_loads_of_every_entry_are_told(omp40: Probe) -> None:
    """The sixth carries one seat, and a sixth of tip and spring."""
    loads = coarse_sixth().loads.reshape(-1, 3, len(INTERFACE))
    carried = np.flatnonzero(np.abs(loads).max(axis=(0, 1)) > 0.0)
    assert [INTERFACE[entry] for entry in carried] == [
        "seat A-left", "tip x", "tip y", "tip z", "spring", "along A-left", "around A-left",
    ]  # fmt: skip
    assert loads[:, 2, SPRING_FORCE].sum() == pytest.approx(-1.0 / 6.0)
    assert loads[:, 0, 6].sum() == pytest.approx(1.0 / 6.0)
