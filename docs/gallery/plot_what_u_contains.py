"""What U contains: the contributions of a bore, of an aligned part and of a position, as bars.

Orange bars are the form of single faces; together, in quadrature, they are that of the part. A bore
of 20 mm with three lobes of 2 µm is touched eight times. A bracket whose faces are wavy by 1.5 µm
is aligned by 8 and by 25 touches on each face. The position of a bore refers to three planes of
nine touches. The noise of a touch is 0.3 µm; map and tip radius are those of a qualification.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from matplotlib.figure import Figure
from published import ROOT, Statement, finish

from pretravel import PretravelMap, Touches, apply, measure_feature, qualify
from pretravel.base.directions import from_angles
from pretravel.base.frames import Placement
from pretravel.drawing.alignment.alignment import Alignment
from pretravel.drawing.alignment.alignment_fit import align
from pretravel.drawing.alignment.tip_centres import TipCentres
from pretravel.drawing.features.feature_uncertainty import FORM_OF_PART, OWN
from pretravel.drawing.features.form_of_part import NO_FORM
from pretravel.drawing.tolerances.geometric_tolerances import inspect_geometry
from pretravel.drawing.tolerances.tolerance_frame import GeometricTolerance, PlacedFeature
from pretravel.measurement.compensation import embed
from pretravel.surface.cad.part_file import read_part

NOISE, WAVE = 0.3e-3, 1.5e-3
SMALL = 0.25  # of the largest face's form: faces whose form is drawn together
X, Y, Z = np.eye(3)

STATEMENT = Statement(
    "form's part of u of a placement, 25 over 8 touches on each face",
    "about 1; independent errors would give sqrt(8/25) = 0.57",
    "form is common to the touches of a face",
    0.65,
    1.4,
    "both are estimated from the residuals of one part",
)


@dataclass(frozen=True)
class Computed:
    """Contributions to u by source, in µm."""

    parts: Mapping[str, Mapping[str, float]]
    by_face: Mapping[str, Mapping[str, float]]
    """Of the form of the part."""


def qualified() -> PretravelMap:
    """A map with three lobes from 25 directions three times."""
    rng = np.random.default_rng(1)
    polar = np.repeat([0.0, 30.0, 60.0, 90.0], [1, 8, 8, 8])
    azimuth = np.concatenate([[0.0], *(45.0 * np.arange(8) + shift for shift in (0.0, 22.5, 0.0))])
    normals = np.repeat(from_angles(np.radians(polar), np.radians(azimuth)), 3, axis=0)
    late = 1e-3 * (5.0 + 5.0 * np.hypot(normals[:, 0], normals[:, 1]) ** 2)
    late += (
        2e-3
        * np.hypot(normals[:, 0], normals[:, 1])
        * np.cos(3.0 * np.arctan2(normals[:, 1], normals[:, 0]))
    )
    radius = 12.5 + 3.0 - late + NOISE * rng.standard_normal(len(normals))
    touches = Touches(radius[:, None] * normals, normals)
    return qualify(touches, 25.0, tip_diameter=6.0, kind="harmonic").pretravel_map


def bore(made: PretravelMap) -> Mapping[str, float]:
    """The diameter of a bore with three lobes."""
    rng, angle = np.random.default_rng(2), 2.0 * np.pi * np.arange(8) / 8
    outward = np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle])
    off = 2e-3 * np.cos(3.0 * angle) + NOISE * rng.standard_normal(8)
    touches = embed((10.0 + off)[:, None] * outward, -outward, made, extrapolate=True)
    return measure_feature(apply(touches, made), "bore", axis=Z).quantity("diameter").parts


def aligned(made: PretravelMap, each: int) -> Alignment:
    """A bracket with a wave on each face, touched so many times there."""
    rng = np.random.default_rng(3)
    part, points, normals, faces = (
        read_part(ROOT / "examples" / "data" / "bracket.step"),
        [],
        [],
        [],
    )
    for index, face in enumerate(part.faces):
        local = face.local(face.samples(3.0))
        upward = local.normal[:, 2] > -0.05
        if np.count_nonzero(upward) < each:
            continue
        rows = rng.choice(np.flatnonzero(upward), each, replace=False)
        along = 2.0 * np.pi * rng.standard_normal(3) / np.linalg.norm(np.ptp(face.bounds, axis=0))
        wave = WAVE * np.cos(local.point[rows] @ along + rng.uniform(0.0, 2.0 * np.pi))
        off = wave + NOISE * rng.standard_normal(each)
        points.append(local.point[rows] + off[:, None] * local.normal[rows])
        normals.append(local.normal[rows])
        faces.append(np.full(each, index))
    touches = embed(np.vstack(points), np.vstack(normals), made, extrapolate=True)
    tips = TipCentres(touches.positions, faces=np.concatenate(faces))
    return align(tips, part, made, Placement(), extrapolate=True)


def placement(found: Alignment) -> tuple[Mapping[str, float], Mapping[str, float]]:
    """Of the part's shift along x, and the form by face."""
    rows = np.zeros((1, len(found.association.response)))
    rows[0, : found.motions.shape[1]] = found.motions[0]
    weights, touched = rows @ found.association.response, found.feet.face[found.used]
    by_face = {
        f"form of face {found.part.faces[face].number}": float(
            np.sqrt(found.errors.form.covariance(np.where(touched == face, weights, 0.0))[0, 0])
        )
        for face in np.unique(touched).tolist()
    }
    small = [name for name, u in by_face.items() if u < SMALL * max(by_face.values())]
    rest = float(np.sqrt(sum(by_face.pop(name) ** 2 for name in small)))
    parts = {cause: float(np.sqrt(one[0, 0])) for cause, one in found.errors.parts(rows).items()}
    return parts, {**by_face, f"form of {len(small)} other faces": rest}


def position(made: PretravelMap) -> tuple[Mapping[str, float], Mapping[str, float]]:
    """Of a bore to three planes of nine touches that are rough by 1 µm, and the form by face."""
    x, y = (each.ravel() for each in np.meshgrid([2.0, 30.0, 58.0], [2.0, 20.0, 38.0]))
    rng, at = np.random.default_rng(4), np.column_stack([x, y])
    flat, ring = np.zeros(len(at)), 2.0 * np.pi * np.arange(8) / 8
    outward = np.column_stack([np.cos(ring), np.sin(ring), 0.0 * ring])
    sets = {
        "A": (np.c_[at, flat], Z, (0.0 * Z, Z)),
        "B": (np.c_[at[:, 0], flat, -1.0 - 0.5 * at[:, 1]], -Y, (0.0 * Z, -Y)),
        "C": (np.c_[flat, at[:, 0], -1.0 - 0.5 * at[:, 1]], -X, (0.0 * Z, -X)),
        "E": (
            np.array([30.03, 20.02, -5.0]) + 4.0 * outward,
            -outward,
            (np.array([30.0, 20, 0]), Z),
        ),
    }
    normals = [np.broadcast_to(each[1], each[0].shape) for each in sets.values()]
    off = [1e-3 * rng.standard_normal(len(one)) for one in normals]
    there = np.vstack([each[0] + o[:, None] * n for each, o, n in
                       zip(sets.values(), off, normals, strict=True)])  # fmt: skip
    points = apply(embed(there, np.vstack(normals), made, extrapolate=True), made)
    placed, start = {}, 0
    for name, (own, _, (point, direction)) in sets.items():
        rows = np.arange(start, start + len(own))
        kind = "bore" if name == "E" else "plane"
        feature = measure_feature(points[rows], kind, axis=Z if name == "E" else None)
        placed[name], start = PlacedFeature(feature, point, direction), start + len(own)
    tolerance = GeometricTolerance("position", 0.2, ("A", "B", "C"))

    def parts_with_form_of(names: str) -> Mapping[str, float]:
        kept = {
            name: each if name in names else replace(each, feature=replace(
                each.feature, errors=replace(each.feature.errors, form=NO_FORM)))
            for name, each in placed.items()
        }  # fmt: skip
        return inspect_geometry([kept["E"]], tolerance, kept, 0.95).quantity.parts

    whole, by_face = parts_with_form_of("ABCE"), {}
    for name in placed:
        alone = parts_with_form_of(name)
        # What is near zero scales all parts alike, and differs without the other forms.
        by_face[f"form of {'the bore' if name == 'E' else name}"] = (
            alone.get(FORM_OF_PART, 0.0) * whole[OWN] / alone[OWN]
        )
    return whole, by_face


def compute() -> Computed:
    """The contributions of all four."""
    made = qualified()
    of_bore = bore(made)
    found = {
        "diameter of a bore\n8 touches, three lobes of 2 µm": (
            of_bore,
            {"form of the bore": of_bore[FORM_OF_PART]},
        ),
        "place of a part along x\n8 touches on each wavy face": placement(aligned(made, 8)),
        "place of a part along x\n25 touches on each wavy face": placement(aligned(made, 25)),
        "position to A|B|C\nplanes of 9 touches": position(made),
    }
    parts, by_face = (
        {
            name: {cause: 1e3 * u for cause, u in both[which].items() if u > 0.0}
            for name, both in found.items()
        }
        for which in (0, 1)
    )
    return Computed(parts, by_face)


def stated(computed: Computed) -> float:
    """The form's part with many touches over that with few."""
    _, few, many, _ = computed.parts.values()
    return many[FORM_OF_PART] / few[FORM_OF_PART]


def draw(computed: Computed) -> Figure:
    """One picture of bars for each quantity."""
    figure = Figure(figsize=(14, 4.2), layout="constrained", dpi=110)
    for axes, (name, parts) in zip(figure.subplots(1, 4), computed.parts.items(), strict=True):
        u = float(np.sqrt(sum(each**2 for each in parts.values())))
        bars = [(cause, each, "C0") for cause, each in parts.items() if cause != FORM_OF_PART]
        bars += [(face, each, "C1") for face, each in computed.by_face[name].items()]
        bars = [*sorted(bars, key=lambda bar: bar[1]), ("u", u, "0.35")]
        names, sizes, colours = zip(*bars, strict=True)
        axes.barh(names, sizes, color=colours)
        axes.set_title(name, fontsize=9)
        axes.set_xlabel("u / µm")
    return figure


if __name__ == "__main__":
    done = compute()
    for title, contributions in done.parts.items():
        print(title.replace("\n", ", "), {k: round(v, 3) for k, v in contributions.items()})
    finish(__file__, "what_u_contains.png", draw(done), STATEMENT, stated(done))
