"""Refusals of meshes, their fallbacks, and the sizes that netgen is given."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import netgen.occ
import numpy as np
import pytest
from netgen.meshing import NgException
from netgen.occ import Box, Glue

from pretravel.base.errors import DescriptionError, MeshError, PretravelError
from pretravel.design.fem import mesh as meshes
from pretravel.design.fem.finite_element_mesh import FiniteElementMesh, mesh_quality
from pretravel.design.fem.geometry import ProbeSolids
from pretravel.design.fem.mesh import MeshSettings, mesh_probe, mesh_solids, numbered
from pretravel.design.fem.seat_ball import CONTACT, ball_mesh
from pretravel.prediction.description import Probe
from pretravel.prediction.materials import material

NAMES = ("refinement", "body", "interface", "patch", "patch_radius", "grading")


@pytest.mark.parametrize("name", NAMES)
def test_every_setting_is_positive(name: str) -> None:
    for value in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(PretravelError, match=f"the mesh setting {name}"):
            MeshSettings(**{name: value})
    assert getattr(MeshSettings(**{name: 1e-9}), name) == 1e-9


def two_tetrahedra(**changes: Any) -> FiniteElementMesh:
    """Two with a common side, each of one region, their middle nodes in the middle."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], dtype=float)
    ends = sorted(
        {(a, b) for own in ((0, 1, 2, 3), (1, 2, 3, 4)) for a in own for b in own if a < b}
    )
    elements = [
        [*own, *(5 + ends.index(tuple(sorted((own[a], own[b])))) for a, b in meshes._EDGES)]
        for own in ((0, 1, 2, 3), (1, 2, 3, 4))
    ]  # fmt: skip
    made = FiniteElementMesh(
        points=np.concatenate([corners, [0.5 * (corners[a] + corners[b]) for a, b in ends]]),
        elements=np.array(elements),
        regions=np.array([0, 1]),
        region_names=("left", "right"),
        faces={"one": np.zeros((1, 6), dtype=int), "other": np.zeros((2, 6), dtype=int)},
        boundary=np.zeros((0, 6), dtype=int),
        quality=np.ones(2),
    )
    return replace(made, **changes)


def test_inverted_elements_are_refused_with_their_part_and_place() -> None:
    good = two_tetrahedra()
    meshes._check_elements(good)
    for row, part, place in (
        (0, "left", r"\(0\.25, 0\.25, 0\.25\)"),
        (1, "right", r"\(0\.50, 0\.50, 0\.50\)"),
    ):
        elements = good.elements.copy()
        # Exchanged corners 0 and 1, with the middles of their edges: another sense.
        elements[row] = elements[row][[1, 0, 2, 3, 4, 6, 5, 8, 7, 9]]
        with pytest.raises(
            MeshError, match=f"inverts 1 elements, the first in '{part}' near {place}"
        ):
            meshes._check_elements(replace(good, elements=elements))
    # The last corner in the plane of the second one's others: 1/3, 1/3, 1/3.
    flat = good.points.copy()
    flat[4] = 1.0 / 3.0
    middles = good.elements[1, [7, 8, 9]]
    flat[middles] = 0.5 * (flat[4] + flat[[1, 2, 3]])
    quality = mesh_quality(flat[good.elements[:, :4]])
    with pytest.raises(MeshError, match="inverts 1 elements, the first in 'right'"):
        meshes._check_elements(replace(good, points=flat, quality=np.round(quality, 9)))


@pytest.mark.parametrize("name", ["one", "other"])
def test_a_face_without_elements_is_refused(name: str) -> None:
    good = two_tetrahedra()
    empty = {**good.faces, name: np.zeros((0, 6), dtype=int)}
    with pytest.raises(MeshError, match=f"the face '{name}' has no element"):
        meshes._check_elements(replace(good, faces=empty))


def test_a_mesh_without_elements_is_refused() -> None:
    none = SimpleNamespace(NumPy=lambda: np.zeros(0))
    mesh = SimpleNamespace(
        Coordinates=lambda: np.zeros((0, 3)), Elements3D=lambda: none, Elements2D=lambda: none
    )
    with pytest.raises(MeshError, match="no element: are the solids closed"):
        numbered(mesh, [])


def a_block(thickness: float, **changes: Any) -> ProbeSolids:
    """1 x 2 x 4 mm of steel, named hub."""
    box = Box((0, 0, 0), (1, 2, 4))
    box.solids.name = "hub"
    made = ProbeSolids(Glue([box]), {"hub": material("steel")}, {"hub": thickness}, [], 0.1)
    return replace(made, **changes)


class Kernel:
    """Stands for netgen: keeps how it is asked, and gives tokens."""

    asked: list[dict[str, Any]]
    error: Exception | None = None

    def __init__(self, patch: pytest.MonkeyPatch, failures: int) -> None:
        self.asked, self.left = [], failures
        patch.setattr(netgen.occ, "OCCGeometry", lambda _: self)
        patch.setattr(meshes, "numbered", self.numbered)

    def GenerateMesh(self, **asked: Any) -> Any:
        if self.error is not None:
            raise self.error
        self.asked.append(asked)
        return SimpleNamespace(SecondOrder=lambda: None)

    def numbered(self, _: Any, faces: list[str], notes: tuple[str, ...]) -> Any:
        self.left -= 1
        if self.left >= 0:
            raise MeshError("inverted")
        return faces, notes


@pytest.mark.parametrize("failures", [0, 1, 2])
@pytest.mark.parametrize(
    ("symmetry", "factor", "seats"), [(None, 1.0, 6), (object(), meshes._SIXTH_GRADING, 1)]
)
def test_inverted_elements_are_graded_slower(
    monkeypatch: pytest.MonkeyPatch, failures: int, symmetry: Any, factor: float, seats: int
) -> None:
    """By 1, 0.7 and 0.5 of what is asked; notes say which did not succeed."""
    kernel = Kernel(monkeypatch, failures)
    settings = MeshSettings(grading=0.4, body=0.5, refinement=2.0)
    faces, notes = mesh_solids(a_block(3.0, symmetry=symmetry), settings)  # type: ignore[misc]
    tried = [0.4 * factor * part for part in (1.0, 0.7, 0.5)]
    assert [some["grading"] for some in kernel.asked] == pytest.approx(tried[: failures + 1])
    assert {some["maxh"] for some in kernel.asked} == {0.75}
    assert not any(some["parallel_meshing"] for some in kernel.asked)
    said = [note for note in notes if "graded slower" in note]
    assert said == [
        f"graded slower than {part:.2g}: elements were inverted" for part in tried[:failures]
    ]
    assert len(faces) == 1 + seats


def test_elements_that_stay_inverted_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    kernel = Kernel(monkeypatch, 3)
    with pytest.raises(MeshError, match="inverted"):
        mesh_solids(a_block(3.0))
    assert len(kernel.asked) == 3
    kernel.error = NgException("Stop meshing")
    with pytest.raises(MeshError, match=r"no mesh could be made of hub: .*Stop meshing"):
        mesh_solids(a_block(3.0))


@pytest.mark.parametrize("refinement", [1.0, 3.0])
@pytest.mark.parametrize("names", ["a", "abc"])
def test_elements_are_counted_before_they_are_made(refinement: float, names: str) -> None:
    """Eight to the cube of their size, of all parts together: two million in 8 mm³ are of
    0.0317 mm."""
    parts = [Box((x, 0, 0), (x + 1, 2, 4)) for x in range(len(names))]
    for part, name in zip(parts, names, strict=True):
        part.solids.name = name
    size = (len(names) * 8.0 * 8.0 / meshes.MOST_ELEMENTS) ** (1.0 / 3.0)
    settings = MeshSettings(refinement=refinement)

    def largest(factor: float) -> float:
        thickness = dict.fromkeys(names, factor * size * refinement / settings.body)
        steel = dict.fromkeys(names, material("steel"))
        return meshes._set_sizes(ProbeSolids(Glue(parts), steel, thickness, [], 0.1), settings)[0]

    assert largest(1.001) == pytest.approx(1.001 * size)
    with pytest.raises(MeshError, match=r"more than 2e\+06: lower the refinement"):
        largest(0.999)


def test_notes_state_the_sizes() -> None:
    """A part of 2 mm at 0.35 / 2 of it, edges of 0.8 mm and more at 0.035 / 2, patches of 0.1 mm
    at 0.8 / 2."""
    solids = a_block(2.0)
    edges = SimpleNamespace(maxh=0.0), SimpleNamespace(maxh=0.0)
    solids = replace(solids, refined=[(edges[0], 4.0), (edges[1], 0.8)])
    for face in solids.shape.faces:
        face.name = "side"
    named = list(solids.shape.faces)[2]
    named.name = "seat A-left"
    largest, notes = meshes._set_sizes(solids, MeshSettings(refinement=2.0))
    assert largest == pytest.approx(0.35)
    assert [edge.maxh for edge in edges] == pytest.approx([0.07, 0.014])
    assert "hub (steel): elements up to 0.35 mm, 0.17 of thickness" in notes[0]
    assert "0.018 of the diameter, from 0.01 mm" in notes[1]
    assert notes[2] == "seats: 0.040 mm on patches of 0.100 mm radius"


class TestOfAProbe:
    """One sixth of a symmetric probe is meshed; if that fails, the whole."""

    @pytest.fixture
    def failing(self, monkeypatch: pytest.MonkeyPatch) -> list[tuple[str, float]]:
        asked: list[tuple[str, float]] = []

        def sixth(_: Probe, patch: float) -> None:
            asked.append(("sixth", patch))
            raise DescriptionError("slivers")

        def whole(_: Probe, patch: float) -> str:
            asked.append(("whole", patch))
            return "solids"

        monkeypatch.setattr(meshes, "probe_body", sixth)
        monkeypatch.setattr(meshes, "probe_solids", whole)
        monkeypatch.setattr(meshes, "mesh_solids", lambda solids, settings: (solids, settings))
        return asked

    def test_the_whole_takes_the_place_of_a_sixth(
        self, omp40: Probe, failing: list[tuple[str, float]]
    ) -> None:
        settings = MeshSettings(patch_radius=0.2)
        found = mesh_probe(omp40, settings)
        assert found == ("solids", ("solids", settings))  # type: ignore[comparison-overlap]
        patch = pytest.approx(0.2 * omp40.tripod.rod_radius)
        assert failing == [("sixth", patch), ("whole", patch)]

    def test_another_probe_is_refused_at_once(
        self, omp40: Probe, failing: list[tuple[str, float]]
    ) -> None:
        azimuths = tuple(np.radians([3.0, 118.0, 246.0]))
        uneven = replace(omp40, tripod=replace(omp40.tripod, rod_azimuths=azimuths))
        with pytest.raises(DescriptionError, match="slivers"):
            mesh_probe(uneven)
        assert [what for what, _ in failing] == ["sixth"]


@pytest.mark.parametrize("element", [0.12, 0.06])
def test_elements_of_a_ball_are_small_on_its_contact_face_alone(element: float) -> None:
    """Their edges there have the size that was asked for, within a quarter; elsewhere they grow
    towards 0.3 of the radius."""
    mesh = ball_mesh(2.0, 0.25, element)

    def edges(triangles: np.ndarray) -> np.ndarray:
        corners = mesh.points[triangles[:, :3]]
        return np.asarray(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2))

    near = np.linalg.norm(mesh.points[mesh.faces[CONTACT]], axis=2)
    assert near.max() == pytest.approx(math.hypot(0.25, 2.0 - math.sqrt(4.0 - 0.0625)), rel=1e-6)
    assert edges(mesh.faces[CONTACT]).mean() == pytest.approx(element, rel=0.25)
    boundary = np.asarray(mesh.boundary)
    below = np.all(mesh.points[boundary[:, :3], 2] < -2.0, axis=1)
    assert 0.3 < edges(boundary[below]).mean() < 0.7


def test_arrays_of_a_mesh_cannot_be_changed() -> None:
    mesh = ball_mesh(2.0, 0.25, 0.2)
    arrays = [mesh.points, mesh.elements, mesh.regions, mesh.boundary, *mesh.faces.values()]
    assert not any(array.flags.writeable for array in arrays)
