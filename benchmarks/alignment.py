"""Where a part lies: is what `align` states so, and is the placement found from nothing?

python benchmarks/alignment.py --sets 200 --kind physical

Probes, machine and noise are those of `benchmarks/departures`, as in `benchmarks/features.py`. The
part is the bracket of the tests: 80 x 50 x 20 mm, planes, two bores, a boss, a slope, no symmetry.
It lies anywhere; faces that a probe from above reaches are touched at random places, 1 mm from
edges. The start is off by about 0.3° and 0.3 mm, but for the rows "from nothing", which know
neither start nor normals nor approaches.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

if __package__ in (None, ""):  # run as a file
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.departures.probes import MICROMETRE
from benchmarks.departures.tripod import TIP_RADIUS
from benchmarks.features import Workshop, around, workshop
from pretravel.base.errors import PretravelError
from pretravel.base.frames import Placement
from pretravel.drawing.alignment.alignment import Alignment, points_in_part
from pretravel.drawing.alignment.alignment_fit import align
from pretravel.drawing.alignment.alignment_search import found_placements
from pretravel.drawing.alignment.tip_centres import TipCentres
from pretravel.drawing.features.measured_feature import measure_feature
from pretravel.uncertainty.gum import coverage_factor
from tests.support.touched_bracket import beside, bracket, random_placement, random_targets

COUNTS = (8, 15, 50, 200)
Shape = Callable[[np.random.Generator, np.ndarray, np.ndarray], np.ndarray]
"""A drawn form: distances of the part from its nominal, by points and faces. [mm]"""


def _rough(deviation: float) -> Shape:
    """Independent from touch to touch."""
    return lambda rng, _, faces: deviation * rng.standard_normal(len(faces))


def _smooth(amplitude: float) -> Shape:
    """On each face a wave of its own, between half a face and two of them long."""

    def drawn(rng: np.random.Generator, points: np.ndarray, faces: np.ndarray) -> np.ndarray:
        off = np.zeros(len(faces))
        for face in range(len(bracket().faces)):
            size = float(np.linalg.norm(np.diff(bracket().faces[face].bounds, axis=0)))
            along = rng.standard_normal(3)
            along *= 2.0 * np.pi / (np.linalg.norm(along) * size * rng.uniform(0.5, 2.0))
            phase = rng.uniform(0.0, 2.0 * np.pi)
            mine = faces == face
            off[mine] = amplitude * np.cos(points[mine] @ along + phase)
        return off

    return drawn


def _displaced(deviation: float) -> Shape:
    """Each face as a whole."""

    def drawn(rng: np.random.Generator, _: np.ndarray, faces: np.ndarray) -> np.ndarray:
        return (deviation * rng.standard_normal(len(bracket().faces)))[faces]

    return drawn


def _bores() -> list[int]:
    faces = bracket().faces
    return [
        index
        for index, face in enumerate(faces)
        if face.local(face.middle[None]).principal_curvatures.min() < -1e-6
    ]


def _larger_bores(by: float) -> Shape:
    """All bores by this diameter."""
    return lambda _, __, faces: np.where(np.isin(faces, _bores()), -0.5 * by, 0.0)


FORMS: dict[str, Shape] = {
    "perfect": _rough(0.0),
    "form 1 µm": _rough(1.0 * MICROMETRE),
    "form 5 µm": _rough(5.0 * MICROMETRE),
    "smooth, ±1.5 µm": _smooth(1.5 * MICROMETRE),
    "faces off by 5 µm": _displaced(5.0 * MICROMETRE),
    "bores larger by 20 µm": _larger_bores(20.0 * MICROMETRE),
}
RING = 8
"""Touches in the bore of 12 mm beside the random ones: its place is measured in the part. It is
larger where bores are, and has no other form."""
RINGED = 50
"""Least count of random touches with which there is such a ring."""
_LARGER = "bores larger by 20 µm"
_UPWARD = -0.05  # least z of the normals that a probe from above touches


def touched(
    shop: Workshop, count: int, form: Shape, gross: int, ring: int = 0
) -> tuple[Placement, np.ndarray, np.ndarray]:
    """A placement, tip centres of random touches and a ring, and which of them are gross."""
    part, rng = bracket(), shop.generator
    placement = random_placement(rng)
    if ring:  # the bore stands upright, as all its sides are touched
        turn = Rotation.from_euler("z", rng.uniform(0.0, 2.0 * np.pi)).as_matrix()
        placement = Placement(turn, placement.shift)
    points, normals, faces = (np.empty((0, 3)), np.empty((0, 3)), np.empty(0, dtype=int))
    upward = [
        index
        for index, face in enumerate(part.faces)
        if face.kind != "plane"
        or placement.vectors(face.local(face.middle[None]).normal)[0, 2] > _UPWARD
    ]
    while len(points) < count:
        more = random_targets(part, count, rng, TIP_RADIUS, upward)
        kept = placement.vectors(more[1])[:, 2] > _UPWARD
        points = np.vstack([points, more[0][kept]])
        normals = np.vstack([normals, more[1][kept]])
        faces = np.append(faces, more[2][kept])
    points, normals, faces = points[:count], normals[:count], faces[:count]
    wrong = np.zeros(count, dtype=bool)
    wrong[rng.permutation(count)[:gross]] = True
    off = form(rng, points, faces)
    if ring:
        at, outward, bore = _ring(ring)
        points, normals = np.vstack([points, at]), np.vstack([normals, -outward])
        faces = np.append(faces, np.full(ring, bore))
        size = float(np.mean(off[faces[:count] == bore])) if form is FORMS[_LARGER] else 0.0
        off, wrong = np.append(off, np.full(ring, size)), np.append(wrong, np.zeros(ring, bool))
    off[wrong] += rng.choice([-1.0, 1.0], gross) * rng.uniform(0.05, 0.5, gross)
    there, facing = placement.points(points + off[:, None] * normals), placement.vectors(normals)
    positions = np.empty((len(points), 3))
    for index in np.unique(faces):
        mine = np.flatnonzero(faces == index)
        bend = float(part.faces[int(index)].local(part.faces[int(index)].middle[None])
                     .principal_curvatures[0, 1])  # fmt: skip
        bend = bend if part.faces[int(index)].kind == "cylinder" else 0.0
        positions[mine] = shop.touched(there[mine], facing[mine], bend).positions
    return placement, positions, wrong


def _ring(count: int) -> tuple[np.ndarray, np.ndarray, int]:
    """Points around the bore of 12 mm in the part, away from its axis, and its face."""
    bore = min(_bores(), key=lambda i: abs(bracket().faces[i].bounds.mean(axis=0)[0] - 12.0))
    outward = around(count)[1]
    return np.array([12.0, 12.0, 10.0]) + 6.0 * outward, outward, bore


def bore_in_part(found: Alignment, ring: int) -> dict[str, float]:
    """The place of the bore in the frame of the part, as `measure` states it."""
    rows = np.arange(len(found.points) - ring, len(found.points))
    points = points_in_part(found)[rows]
    bore = measure_feature(points, "bore", axis=np.array([0.0, 0.0, 1.0]))
    both = [bore.quantity(name) for name in "xy"]
    # Part and bore lie in the same error of the reference's centre.
    error = np.array([each.value - 12.0 for each in both])
    u = np.array([each.u for each in both])
    covered = np.abs(error) <= [each.expanded_u for each in both]
    return {"bore chi": float(np.mean((error / u) ** 2)), "bore covered": float(covered.mean()),
            "bore u": float(u.mean())}  # fmt: skip


def row(
    found: Alignment, placement: Placement, wrong: np.ndarray, centre_error: np.ndarray
) -> dict[str, float]:
    """Errors of the motions in units of u, for those that are determined.

    Positions refer to the centre of the reference as the qualification found it: what a probe adds
    to both alike cannot be told from where they lie.
    """
    turn = found.placement.rotation @ placement.rotation.T
    shift = found.placement.shift - (turn @ (placement.shift - found.about) + found.about)
    error = np.concatenate([shift - centre_error, Rotation.from_matrix(turn).as_rotvec()])
    rows = np.zeros((6, len(found.association.response)))
    rows[:, : found.motions.shape[1]] = found.motions
    u = found.standard_uncertainty
    factors = [
        coverage_factor(found.errors.dof(each, float(one)), whole_dof=False)
        for each, one in zip(rows, u, strict=True)
    ]
    return {
        "chi": float(np.mean((error / u) ** 2)),
        "covered": float(np.mean(np.abs(error) <= np.array(factors) * u)),
        "u": float(np.sqrt(np.mean(u[:3] ** 2))),
        "missed": float(np.sum(wrong & ~found.gross)),
        "false": float(np.sum(~wrong & found.gross)),
        "said": float(len(found.unchecked) > 0),
    }


def one_set(
    number: int,
    kind: str,
    forms: Sequence[str] = tuple(FORMS),
    counts: Sequence[int] = COUNTS,
    from_nothing: Sequence[int] = (9, 15, 50),
) -> dict[str, dict[str, float]]:
    """All rows with one probe and its map."""
    shop, part, found = workshop(number, kind), bracket(), {}
    for name, form in FORMS.items():
        for count in counts:
            if name not in forms:
                continue
            ring = RING if count >= RINGED else 0
            placement, positions, wrong = touched(shop, count, form, count // 50, ring)
            start = beside(placement, shop.generator, 0.005, 0.3)
            tips = TipCentres(positions)
            try:
                result = align(tips, part, shop.pretravel_map, start, extrapolate=True)
            except PretravelError as error:
                print(f"set {number}, {name}, {count} touches: {error}", file=sys.stderr)
                continue
            if result.motions.shape[1] == 6:
                one = row(result, placement, wrong, shop.centre_error)
                if ring:
                    one |= bore_in_part(result, ring)
                found[f"{name}, {count} touches"] = one
    x, y, z = np.meshgrid(*part.box.T)
    corners = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    for count in from_nothing:
        placement, positions, _ = touched(shop, count, FORMS["form 1 µm"], count // 50)
        try:
            answers = found_placements(
                TipCentres(positions), part, shop.pretravel_map, extrapolate=True
            )
        except PretravelError:
            answers = []
        away = [
            float(np.abs(each.placement.points(corners) - placement.points(corners)).max())
            for each in answers
        ]
        right = [distance < 0.5 for distance in away]
        found[f"from nothing, {count} touches"] = {
            "one, right": float(len(answers) == 1 and right[0]),
            "one, wrong": float(len(answers) == 1 and not right[0]),
            "several": float(len(answers) > 1),
            "none": float(not answers),
        }
    return found


def printed(sets: Sequence[dict[str, dict[str, float]]]) -> None:
    """The tables, as Markdown."""

    def of(name: str, column: str) -> np.ndarray:
        return np.array([one[name][column] for one in sets if name in one])

    names = list(dict.fromkeys(name for one in sets for name in one))
    print("| touches | sets | u of a shift µm | χ² | median of squares | covered by U % |"
          " gross missed | good named | of the sets beyond 4 u, warned | bore: u µm | χ² |"
          " covered by U % |")  # fmt: skip
    print("| --- |" + " --- |" * 11)
    for name in (name for name in names if "nothing" not in name):
        chi = of(name, "chi")
        print(
            f"| {name} | {len(chi)} | {of(name, 'u').mean() / MICROMETRE:.2f} | {chi.mean():.2f} | "
            f"{np.median(chi):.2f} | {100.0 * of(name, 'covered').mean():.1f} | "
            f"{of(name, 'missed').sum():.0f} | {of(name, 'false').sum():.0f} | "
            f"{of(name, 'said')[chi > 16.0].sum():.0f} of {np.sum(chi > 16.0)} |"
            + _bore_cells([one[name] for one in sets if name in one])
        )
    if not any("nothing" in name for name in names):
        return
    print("\n| touches without normals | one answer, right % | several, listed % | none % |"
          " one answer, wrong |")  # fmt: skip
    print("| --- |" + " --- |" * 4)
    for name in (name for name in names if "nothing" in name):
        shares = [100.0 * of(name, c).mean() for c in ("one, right", "several", "none")]
        print(
            f"| {name} | {' | '.join(f'{share:.0f}' for share in shares)} | "
            f"{of(name, 'one, wrong').sum():.0f} of {len(sets)} |"
        )


def _bore_cells(rows: Sequence[dict[str, float]]) -> str:
    if "bore u" not in rows[0]:
        return " – | – | – |"
    u, chi, covered = (np.mean([one[f"bore {key}"] for one in rows])
                       for key in ("u", "chi", "covered"))  # fmt: skip
    return f" {u / MICROMETRE:.2f} | {chi:.2f} | {100.0 * covered:.1f} |"


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--kind", default="physical")
    parser.add_argument("--form", nargs="*", default=list(FORMS), help=f"of {list(FORMS)}")
    parser.add_argument("--touches", nargs="*", type=int, default=list(COUNTS))
    parser.add_argument("--from-nothing", nargs="*", type=int, default=[9, 15, 50])
    stated = parser.parse_args()
    numbers = range(stated.first, stated.first + stated.sets)
    rows = (stated.form, stated.touches, stated.from_nothing)
    printed([one_set(number, stated.kind, *rows) for number in numbers])


if __name__ == "__main__":
    main()
