"""Geometry, mesh and their errors, which name the part and the remedy."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from netgen.occ import Box, Compound, Glue, OCCGeometry, Pnt

from pretravel.base.directions import from_angles
from pretravel.base.errors import CapacityError, DescriptionError, InputError
from pretravel.design.fem import free_body
from pretravel.design.fem.compliance import FiniteElements
from pretravel.design.fem.condensation import condense
from pretravel.design.fem.elasticity import finite_element_model
from pretravel.design.fem.geometry import ProbeSolids, probe_body, probe_solids, write_step
from pretravel.design.fem.mesh import MeshSettings, mesh_solids
from pretravel.design.fem.regions import seat_face
from pretravel.prediction.catalogue import description_text, parse_probe
from pretravel.prediction.description import Probe, StepGeometry
from pretravel.prediction.materials import material
from pretravel.prediction.trigger import predict
from tests.support.coarse_models import COARSE, coarse_reduced_sixth, coarse_sixth


def hub(probe: Probe, **changes: float) -> Probe:
    assert probe.hub is not None
    return replace(probe, hub=replace(probe.hub, **changes))


def step_solids(probe: Probe, path: Path) -> StepGeometry:
    """The described probe through a STEP file, with the same names of solids."""
    write_step(path, probe)
    return StepGeometry(
        path=path,
        tripod=("hub", "holder", "rods"),
        stylus=("stylus 1", "stylus 2"),
        tip=("tip",),
    )


def volumes(solids: ProbeSolids) -> dict[str, float]:
    """Of each region. [mm³]"""
    found: dict[str, float] = {}
    for solid in solids.shape.solids:
        found[solid.name] = found.get(solid.name, 0.0) + solid.mass
    return found


def test_regions_and_volumes(omp40: Probe) -> None:
    volume = volumes(probe_solids(omp40))
    assert set(volume) == {"hub", "holder", "rods", "stylus 1", "stylus 2", "tip"}
    head, stem = omp40.stylus
    assert volume["stylus 1"] == pytest.approx(np.pi / 4 * head.diameter**2 * head.length, rel=1e-9)
    assert volume["tip"] == pytest.approx(4 / 3 * np.pi * 27.0, rel=1e-9)
    # The stem enters the ball by the height of the ball's cap over its section.
    depth = np.sqrt(9.0 - 0.25 * stem.diameter**2)
    assert volume["stylus 2"] == pytest.approx(
        np.pi / 4 * stem.diameter**2 * (stem.length - depth)
        - np.pi * (3 - depth) ** 2 * (6 + depth) / 3,
        rel=1e-6,
    )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"height": 40.0}, "stylus's root"),
        ({"radius": 15.0}, "reaches the seats"),
        ({"height": 1.0}, "do not fit into a disc"),
        ({"holder_diameter": 30.0}, "wider than the disc"),
    ],
)
def test_impossible_hubs_say_what_to_change(
    omp40: Probe, changes: dict[str, float], words: str
) -> None:
    with pytest.raises(DescriptionError, match=words):
        probe_solids(hub(omp40, **changes))


def test_no_hub_no_finite_elements(omp40: Probe) -> None:
    with pytest.raises(DescriptionError, match="radius_mm, height_mm"):
        probe_solids(replace(omp40, hub=None))


def test_half_a_hub_is_refused() -> None:
    text = description_text("omp40-2").replace("height_mm = ", "# height_mm = ", 1)
    with pytest.raises(DescriptionError, match=r"\[hub\]: height_mm is missing"):
        parse_probe(text)


@pytest.mark.slow
def test_step_file_gives_the_described_probe(omp40: Probe, tmp_path: Path) -> None:
    """Written and read again: the same sensing distance, up to the different mesh."""
    probe = replace(omp40, step=merged_step(omp40, tmp_path))
    directions = from_angles(np.radians([90.0, 40.0]), np.radians([0.0, 75.0]))
    solids = probe_solids(probe)
    reduced = condense(finite_element_model(probe, solids, mesh_solids(solids, COARSE)))
    found = predict(probe, directions, FiniteElements(reduced)).sensing_distance
    described = predict(omp40, directions, FiniteElements(coarse_reduced_sixth())).sensing_distance
    assert found == pytest.approx(described, rel=3e-3)


def merged_step(probe: Probe, folder: Path) -> StepGeometry:
    """As a CAD user draws it: tripod, head, stem and tip, one solid each."""
    from pretravel.design.fem.described_solids import described_solids

    parts = {part.name: part.solid for part in described_solids(probe)}
    tripod = parts["hub"] + parts["holder"] + parts["rods"]
    named = {
        "Tripod": tripod,
        "Head": parts["stylus 1"],
        "Stem": parts["stylus 2"],
        "Ball": parts["tip"],
    }
    for name, solid in named.items():
        solid.solids.name = name
    path = folder / "probe.step"
    Glue(list(named.values())).WriteStep(str(path))
    return StepGeometry(
        path, ("Tripod",), ("Head", "Stem"), ("Ball",), {"Head": probe.stylus[0].material}
    )


@pytest.mark.long
def test_step_errors_name_file_and_part(omp40: Probe, tmp_path: Path) -> None:
    step = merged_step(omp40, tmp_path)

    def with_step(**changes: object) -> Probe:
        return replace(omp40, step=replace(step, **changes))

    with pytest.raises(InputError, match="no such file"):
        probe_solids(with_step(path=tmp_path / "other.step"))
    (tmp_path / "bad.step").write_text("not a STEP file")
    with pytest.raises(InputError, match=r"bad\.step"):
        probe_solids(with_step(path=tmp_path / "bad.step"))
    with pytest.raises(InputError, match="no solid 'Arm'; there are #1"):
        probe_solids(with_step(tripod=("Arm",)))
    with pytest.raises(InputError, match="no solid '#9'"):
        probe_solids(with_step(tripod=("#9",)))
    with pytest.raises(DescriptionError, match="named for two parts"):
        probe_solids(with_step(stylus=("Head", "Tripod")))
    with pytest.raises(DescriptionError, match="tip's centre lies at"):
        probe_solids(replace(with_step(), hub_offset=13.0))
    with pytest.raises(DescriptionError, match="seat A-left should touch"):
        probe_solids(
            replace(
                with_step(), tripod=replace(omp40.tripod, rod_radius=omp40.tripod.rod_radius + 0.1)
            )
        )
    with pytest.raises(DescriptionError, match="is loose: no face joins"):
        probe_solids(with_step(stylus=("Stem",), materials={"Stem": omp40.stem.material}))
    with pytest.raises(DescriptionError, match="materials: 'Foot'"):
        probe_solids(with_step(materials={"Foot": omp40.tip.material}))


def test_overlapping_solids_are_named(omp40: Probe, tmp_path: Path) -> None:
    step = merged_step(omp40, tmp_path)
    solids = list(OCCGeometry(str(step.path)).shape.solids)
    block = Box(Pnt(-1, -1, -30), Pnt(1, 1, -20))
    block.solids.name = "Block"
    path = tmp_path / "overlap.step"
    Compound([*solids, block]).WriteStep(str(path))
    probe = replace(omp40, step=replace(
        step, path=path, stylus=("Head", "Stem", "Block"),
        materials=dict.fromkeys(("Head", "Stem", "Block"), omp40.stem.material),
    ))  # fmt: skip
    with pytest.raises(DescriptionError, match="overlap by"):
        probe_solids(probe)


def test_want_of_memory_is_said_before_the_work(
    omp40: Probe, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(free_body, "available_memory", lambda: 1e8)
    with pytest.raises(CapacityError, match=r"need about .* GB .*lower the refinement"):
        condense(coarse_sixth())


@pytest.mark.slow
def test_uneven_rods_are_meshed_too(omp40: Probe) -> None:
    azimuths = tuple(np.radians([3.0, 118.0, 246.0]))
    probe = replace(omp40, tripod=replace(omp40.tripod, rod_azimuths=azimuths))
    mesh = mesh_solids(probe_solids(probe), MeshSettings(refinement=0.2))
    assert len(mesh.faces) == 7


def test_a_hub_can_be_of_another_material(omp40: Probe) -> None:
    assert omp40.hub is not None
    aluminium = replace(omp40, hub=replace(omp40.hub, material=material("aluminium")))
    found = probe_solids(aluminium).materials
    assert {name for name, of in found.items() if of.name == "aluminium"} == {"hub", "holder"}


@pytest.mark.long
def test_solids_that_were_written_can_be_used_by_name(omp40: Probe, tmp_path: Path) -> None:
    """The recipe of docs/finite_elements.md: three rods with one name are selected together."""
    probe = replace(omp40, step=step_solids(omp40, tmp_path / "omp40.step"))
    solids = probe_solids(probe)
    assert set(solids.materials) == {
        "tripod: hub", "tripod: holder", "tripod: rods", "stylus: stylus 1", "stylus: stylus 2",
        "tip",
    }  # fmt: skip
    assert solids.materials["stylus: stylus 1"].name == "stainless steel"
    assert solids.materials["stylus: stylus 2"].name == "ceramic"
    # The same bodies, with the seats that are described.
    head, volume = omp40.stylus[0], volumes(solids)
    assert volume["stylus: stylus 1"] == pytest.approx(np.pi / 4 * head.diameter**2 * head.length)
    assert volume["tip"] == pytest.approx(4 / 3 * np.pi * 27.0, rel=1e-6)
    assert {face.name for face in solids.shape.faces} >= {seat_face(seat) for seat in range(6)}


def test_step_materials_are_not_guessed(omp40: Probe, tmp_path: Path) -> None:
    step = merged_step(omp40, tmp_path)
    probe = replace(omp40, step=replace(step, stylus=("Head", "Stem", "#4"), materials={}))
    with pytest.raises(DescriptionError, match="give the material of 'Head'"):
        probe_solids(probe)


def test_tips_and_seats_that_no_mesh_fills(omp40: Probe) -> None:
    with pytest.raises(DescriptionError, match=r"at least 2\.27"):
        probe_solids(replace(omp40, tip=replace(omp40.tip, radius=2.25)))
    steep = replace(omp40.seats, support_angle=np.radians(88.0))
    with pytest.raises(DescriptionError, match="lower support_angle_deg"):
        probe_solids(replace(omp40, seats=steep))


def test_what_carries_the_seats_is_of_the_tripods_material(omp40: Probe) -> None:
    solids = probe_body(omp40)
    other = replace(solids, materials={**solids.materials, "rods": material("steel")})
    with pytest.raises(DescriptionError, match="'rods' carries seats"):
        finite_element_model(omp40, other, coarse_sixth().mesh)
