"""Where a part lies: placements that are known, motions that touches cannot tell, searches."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError
from pretravel.base.frames import Placement
from pretravel.drawing.alignment import aligning
from pretravel.drawing.alignment.alignment import (
    MOTIONS,
    Alignment,
    Datum,
    points_in_part,
    radius_alone,
)
from pretravel.drawing.alignment.alignment_fit import align, placement_onto
from pretravel.drawing.alignment.alignment_search import found_placements
from pretravel.drawing.alignment.tip_centres import TipCentres
from pretravel.drawing.features.extreme_association import associate_by
from pretravel.measurement.compensation import embed
from pretravel.surface.cad.part import Part
from pretravel.touches import Touches
from pretravel.uncertainty.covariance import Covariance
from tests.support.example_maps import lobes
from tests.support.lobed_map import lobed_map
from tests.support.touched_bracket import (
    beside,
    bracket,
    faces_of_kind,
    random_placement,
    random_targets,
    tip_centres,
)

UM = 1e-3
RADIUS = 2.0


def _corners(part: Part) -> FloatArray:
    x, y, z = np.meshgrid(*part.box.T)
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()])


def _apart(part: Part, one: Placement, other: Placement) -> float:
    corners = _corners(part)
    return float(np.linalg.norm(one.points(corners) - other.points(corners), axis=1).max())


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_placement_and_pretravel_are_solved_together(seed: int) -> None:
    """A probe with lobes of some micrometres, exact touches: the placement is exact, and with the
    tip's radius alone it is off by the lobes."""
    rng, part, large = np.random.default_rng(seed), bracket(), lobes(3)
    made = replace(large, coefficients=4e-3 * large.coefficients, tip_radius=RADIUS)
    points, normals, faces = random_targets(part, 40, rng, made.tip_radius)
    placement = random_placement(rng)
    tips = tip_centres(placement, points, normals, made)
    start = beside(placement, rng, 0.005, 0.2)
    found = align(tips, part, made, start, extrapolate=True)
    assert _apart(part, found.placement, placement) < 1e-6
    assert np.all(found.feet.face == faces)
    assert np.abs(found.residuals).max() < 1e-6
    assert not found.gross.any()
    plain = align(tips, part, radius_alone(made.tip_radius), start, extrapolate=True)
    assert _apart(part, plain.placement, placement) > 1.0 * UM


@pytest.mark.parametrize(
    ("turn", "said"), [(0.0, ""), (180.0, "was the spindle or the part turned")]
)
def test_bores_show_a_map_that_is_not_that_of_the_touches(turn: float, said: str) -> None:
    rng, part = np.random.default_rng(3), bracket()
    made = lobed_map(tip_radius=RADIUS)
    points, normals, _ = random_targets(part, 90, rng, made.tip_radius)
    placement = Placement()
    about_z = Rotation.from_euler("z", turn, degrees=True).as_matrix()
    tips = tip_centres(placement, points, normals, replace(made, rotation=about_z))
    found = align(tips, part, made, placement, extrapolate=True)
    told = found.pretravel_left.sentence()
    assert (said in told) if said else told == ""


@pytest.mark.parametrize("stated", [False, True])
def test_the_travel_of_the_signal_delay_is_taken_off(stated: bool) -> None:
    """5 and 10 µm at two feeds, with approaches along the normals that are stated or not."""
    rng, part = np.random.default_rng(16), bracket()
    made = replace(radius_alone(RADIUS), delay=6e-3)
    points, normals, _ = random_targets(part, 40, rng)
    placement = random_placement(rng)
    feeds = np.where(np.arange(40) % 2 == 0, 50.0, 100.0)
    touches = embed(placement.points(points), placement.vectors(normals), made, feeds=feeds,
                    extrapolate=True)  # fmt: skip
    tips = TipCentres.of(touches, stated_approaches=stated)
    found = align(tips, part, made, placement, extrapolate=True)
    assert _apart(part, found.placement, placement) < 1e-6
    assert np.abs(found.residuals).max() < 1e-6
    with pytest.raises(PretravelError, match="do not give their feed"):
        align(replace(tips, feeds=None), part, made, placement, extrapolate=True)


@pytest.mark.long
def test_placements_are_covered_by_their_covariance() -> None:
    """The change of the placement with one touch, by alignments with that touch moved."""
    rng, part, made = np.random.default_rng(5), bracket(), radius_alone(RADIUS)
    nothing = Covariance.independent([0.0])
    made = replace(made, repeatability=UM, u_tip_radius=0.5 * UM, covariance=nothing)
    points, normals, _ = random_targets(part, 14, rng)
    placement = random_placement(rng)
    tips = tip_centres(placement, points, normals, made)
    found = align(tips, part, made, placement, extrapolate=True)
    step, changes = 0.2 * UM, []
    for row in range(14):
        moved = np.array(tips.positions)
        moved[row] += step * placement.vectors(normals[row : row + 1])[0]
        other = align(TipCentres(moved), part, made, placement, extrapolate=True).placement
        turn = other.rotation @ found.placement.rotation.T
        shift = other.shift - (turn @ (found.placement.shift - found.about) + found.about)
        changes.append(np.concatenate([shift, Rotation.from_matrix(turn).as_rotvec()]) / step)
    response = np.array(changes).T
    # Each touch repeats to 1 µm; the tip's radius is the same in all.
    wanted = UM**2 * (response @ response.T + 0.25 * np.outer(response.sum(1), response.sum(1)))
    assert found.covariance == pytest.approx(wanted, rel=1e-3, abs=1e-3 * np.abs(wanted).min())


def _box_faces(part: Part) -> dict[str, int]:
    """The outer planes of the bracket, by their side."""
    found = {}
    for index in faces_of_kind(part, "plane"):
        local = part.faces[index].local(part.faces[index].middle[None])
        point, normal = local.point[0], local.normal[0]
        for axis, name in enumerate("xyz"):
            if normal[axis] < -0.99 and abs(point[axis]) < 1e-9:
                found[name] = index
    return found


def _bore_12(part: Part) -> int:
    """The bore of 12 mm about (12, 12)."""
    return next(i for i in faces_of_kind(part, "cylinder") if part.faces[i].number == 12)


def _touched(part: Part, on: list[int], placement: Placement) -> TipCentres:
    """Twelve touches on some faces."""
    points, normals, _ = random_targets(part, 12, np.random.default_rng(3), on=on)
    return tip_centres(placement, points, normals, radius_alone(RADIUS))


def test_motions_that_touches_do_not_determine_are_named_and_stay() -> None:
    """In a bore; and on the floor, from a start that is off along all axes."""
    part, made = bracket(), radius_alone(RADIUS)
    placement = random_placement(np.random.default_rng(7))
    tips = _touched(part, [_bore_12(part)], placement)
    found = align(tips, part, made, placement, extrapolate=True)
    assert found.undetermined_motions == ("shift along z", "turn about z through (12, 12, 0) mm")
    assert found.motions.shape == (6, 4)
    tips = _touched(part, [_box_faces(part)["z"]], placement)
    start = replace(placement, shift=placement.shift + placement.rotation @ [0.3, -0.2, 0.4])
    found = align(tips, part, made, start, extrapolate=True)
    assert found.undetermined_motions == ("shift along x", "shift along y", "turn about z")
    moved = placement.rotation.T @ (found.placement.shift - placement.shift)
    assert moved == pytest.approx([0.3, -0.2, 0.0], abs=1e-6)


def test_only_free_motions_change() -> None:
    rng, part, made = np.random.default_rng(9), bracket(), radius_alone(RADIUS)
    points, normals, _ = random_targets(part, 30, rng)
    placement = Placement(shift=np.array([10.0, 20.0, 30.0]))
    tips = tip_centres(placement, points, normals, made)
    start = replace(placement, shift=placement.shift + 0.1)
    found = align(tips, part, made, start, free=("x", "y"), extrapolate=True).placement
    assert found.rotation == pytest.approx(np.eye(3), abs=1e-12)
    assert found.shift == pytest.approx([10.0, 20.0, 30.1], abs=0.02)
    assert found.shift[2] == pytest.approx(30.1, abs=1e-12)
    with pytest.raises(PretravelError, match="the motions are x, y, z, about x"):
        align(tips, part, made, start, free=("along x",))


@pytest.mark.parametrize("count", [12, 40, 120])
def test_gross_touches_are_named_and_left_out(count: int) -> None:
    rng, part, made = np.random.default_rng(count), bracket(), radius_alone(RADIUS)
    points, normals, _ = random_targets(part, count, rng)
    points = points + normals * (2.0 * UM * rng.standard_normal((count, 1)))
    wrong = count // 3
    points[wrong] += 0.2 * normals[wrong]
    placement = random_placement(rng)
    tips = tip_centres(placement, points, normals, made)
    found = align(tips, part, made, beside(placement, rng, 0.002, 0.1), extrapolate=True)
    assert np.flatnonzero(found.gross).tolist() == [wrong]
    assert found.residuals[wrong] == pytest.approx(0.2, abs=0.02)
    assert _apart(part, found.placement, placement) < 0.03


def test_a_touch_beyond_its_face_is_no_direction_of_the_map() -> None:
    """The nearest face of a touch in the air may hang over: it is not used, and refuses nothing."""
    rng, part, made = np.random.default_rng(4), bracket(), lobed_map(tip_radius=2.0)
    points, normals, _ = random_targets(part, 60, rng)
    reached = normals[:, 2] > -0.01
    points = np.vstack([points[reached], [75.0, 0.0, 17.0]])  # under it the slope hangs over
    normals = np.vstack([normals[reached], [0.0, -1.0, 0.0]])
    placement = Placement(shift=np.array([5.0, 6.0, 7.0]))
    tips = tip_centres(placement, points, normals, made)
    found = align(tips, part, made, placement)
    assert np.flatnonzero(~found.used).tolist() == [len(points) - 1]
    assert _apart(part, found.placement, placement) < 0.01 * UM


@pytest.mark.long
@pytest.mark.parametrize(("seed", "count"), [(1, 24), (3, 24), (2, 40)])
def test_a_gross_touch_drags_its_face_and_is_named(seed: int, count: int) -> None:
    """Each in turn, 0.3 mm off: the few others of its face follow it, and are no form of it."""
    rng, part, made = np.random.default_rng(seed), bracket(), radius_alone(RADIUS)
    points, normals, _ = random_targets(part, count, rng)
    placement, noise = random_placement(rng), 0.3 * UM * rng.standard_normal(count)
    for wrong in range(0, count, 5):
        off = noise + 0.3 * (np.arange(count) == wrong)
        tips = tip_centres(placement, points + off[:, None] * normals, normals, made)
        found = align(tips, part, made, placement, extrapolate=True)
        assert np.flatnonzero(found.gross).tolist() == [wrong]


def test_the_form_of_a_face_is_not_gross() -> None:
    """A bow of 4 µm of the first datum beside perfect ones: all touches are used, its form is in u;
    a touch 50 µm off on it is gross."""
    part, made, side = bracket(), radius_alone(RADIUS), _box_faces(bracket())
    datums = [Datum(letter, (side[name],)) for letter, name in zip("ABC", "zyx", strict=True)]
    rng, placement = np.random.default_rng(55), Placement(shift=np.array([5.0, 6.0, 7.0]))
    points, normals, faces = random_targets(part, 45, rng, on=list(side.values()))
    mine = faces == side["z"]
    away = np.linalg.norm(points - points[mine].mean(axis=0), axis=1) * mine
    noise = 0.2 * UM * rng.standard_normal(45)

    def aligned(off: FloatArray) -> Alignment:
        tips = tip_centres(placement, points + (off + noise)[:, None] * normals, normals, made)
        return align(tips, part, made, placement, datums=datums, extrapolate=True)

    bow = 4.0 * UM * (away / away.max()) ** 2
    flat, bowed = aligned(0.0 * bow), aligned(bow)
    assert not bowed.gross.any()
    assert bowed.standard_uncertainty.max() > 2.0 * flat.standard_uncertainty.max()
    wrong = np.zeros(45)
    wrong[np.flatnonzero(mine)[3]] = 50.0 * UM
    assert np.flatnonzero(aligned(bow + wrong).gross).tolist() == [np.flatnonzero(mine)[3]]


def test_datums_take_motions_in_their_order() -> None:
    """3-2-1 on planes that are not square to each other: the first is fitted whole, the second
    takes one turn and a shift, the third a shift. Calculated here with planes, lines and a mean."""
    rng, part, made = np.random.default_rng(11), bracket(), radius_alone(RADIUS)
    side = _box_faces(part)
    points, normals, faces = random_targets(part, 40, rng, on=list(side.values()))
    points, normals, faces = (
        np.concatenate(pair)
        for pair in zip((points, normals, faces), random_targets(part, 20, rng), strict=True)
    )
    skew = {"z": 0.0, "y": 2e-3, "x": -3e-3}
    for name, angle in skew.items():
        mine = faces == side[name]
        points[mine] += normals[mine] * (angle * points[mine][:, [2]])
    placement = Placement(shift=np.array([5.0, 6.0, 7.0]))
    tips = tip_centres(placement, points, normals, made)
    datums = [Datum(letter, (side[name],)) for letter, name in zip("ABC", "zyx", strict=True)]
    found = align(tips, part, made, placement, datums=datums, extrapolate=True)
    assert set(found.feet.face[found.used]) == {side[name] for name in "xyz"}
    here = found.placement.inverse.points(placement.points(points))
    on = {name: here[faces == side[name]] for name in "xyz"}
    # A: the plane of least squares through its points is z = 0.
    design = np.column_stack([np.ones(len(on["z"])), on["z"][:, :2]])
    assert np.linalg.lstsq(design, on["z"][:, 2], rcond=None)[0] == pytest.approx(0.0, abs=1e-6)
    # B: the line y(x) of least squares is zero; its tilt in z is not.
    design = np.column_stack([np.ones(len(on["y"])), on["y"][:, 0]])
    assert np.linalg.lstsq(design, on["y"][:, 1], rcond=None)[0] == pytest.approx(0.0, abs=1e-6)
    # C: the mean of x is zero.
    assert on["x"][:, 0].mean() == pytest.approx(0.0, abs=1e-6)
    everything = align(tips, part, made, placement, extrapolate=True)
    assert _apart(part, everything.placement, found.placement) > 1.0 * UM


def test_the_sizes_of_bores_are_free_as_datums() -> None:
    """Bores that are 30 µm too large, touched on one half: their axes are found all the same."""
    part, made = bracket(), radius_alone(RADIUS)
    side, bores = _box_faces(part), faces_of_kind(part, "cylinder")
    rng = np.random.default_rng(12)
    points, normals, faces = random_targets(part, 80, rng, on=[side["z"], *bores])
    kept = ~np.isin(faces, bores) | (normals[:, 0] > -0.3)
    points, normals, faces = points[kept], normals[kept], faces[kept]
    points = points - 0.015 * normals * np.isin(faces, bores)[:, None]
    placement = random_placement(rng)
    tips = tip_centres(placement, points, normals, made)
    datums = [Datum("A", (side["z"],)), Datum("B", tuple(bores))]
    found = align(tips, part, made, placement, datums=datums, extrapolate=True)
    assert _apart(part, found.placement, placement) < 1e-6
    # A larger bore, and a touch that moves with the part, leave no residuals.
    one_bore = (found.feet.face[found.used] == bores[0]).astype(float)
    shifted = found.association.outward @ np.array([1.0, 0.0, 0.0])
    for moved in (one_bore, shifted):
        assert found.association.residual_change(moved) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.long
def test_datums_from_outside_the_material() -> None:
    """A: the tangent plane, found by all planes through three points. B and C: the outermost
    point, after A has turned the part. Its response is that of moved touches."""
    rng, part, made = np.random.default_rng(21), bracket(), radius_alone(RADIUS)
    side = _box_faces(part)
    points, normals, faces = random_targets(part, 40, rng, on=list(side.values()))
    points = points + 0.01 * rng.uniform(-1.0, 1.0, (len(points), 1)) * normals
    placement = Placement(shift=np.array([5.0, 6.0, 7.0]))
    order = zip("ABC", "zyx", strict=True)
    datums = [Datum(letter, (side[name],), outside=True) for letter, name in order]

    def aligned(there: FloatArray) -> Alignment:
        tips = tip_centres(placement, there, normals, made)
        return align(tips, part, made, placement, datums=datums, extrapolate=True)

    found = aligned(points)
    here = found.placement.inverse.points(placement.points(points))
    on = {name: here[faces == side[name]] for name in "xyz"}
    for name, axis in zip("zyx", (2, 1, 0), strict=True):  # all on the side of the material
        assert on[name][:, axis].min() == pytest.approx(0.0, abs=1e-6)
    p = points[faces == side["z"]]
    widths = []
    for i, j, k in combinations(range(len(p)), 3):
        normal = np.cross(p[j] - p[i], p[k] - p[i])
        height = (p - p[i]) @ (normal / np.linalg.norm(normal))
        if min(abs(height.min()), abs(height.max())) < 1e-12:
            widths.append(np.ptp(height))
    for (i, j), (k, m) in combinations(list(combinations(range(len(p)), 2)), 2):
        normal = np.cross(p[j] - p[i], p[m] - p[k])
        if len({i, j, k, m}) == 4 and np.linalg.norm(normal) > 1.0:
            widths.append(np.ptp(p @ (normal / np.linalg.norm(normal))))
    assert on["z"][:, 2].max() == pytest.approx(min(widths), abs=1e-6)
    step = 1e-5
    for row in np.flatnonzero(np.any(np.abs(found.association.response) > 1e-9, axis=0)):
        touch = np.flatnonzero(found.used)[row]
        moved = points.copy()
        moved[touch] += step * normals[touch]
        shift = aligned(moved).placement.points(found.placement.inverse.points(found.about[None]))[
            0
        ]
        stated = found.motions[:3] @ found.association.response[: found.motions.shape[1], row]
        assert (shift - found.about) / step == pytest.approx(stated, abs=2e-3)
    # It rests on at least three, two and one touches; the form is no error.
    assert found.errors.excess == 0.0


def test_an_inscribed_bore_as_a_datum() -> None:
    """The centre is that of the largest circle across the plane, of another program."""
    rng, part, made = np.random.default_rng(22), bracket(), radius_alone(RADIUS)
    side = _box_faces(part)
    bore = _bore_12(part)
    points, normals, faces = random_targets(part, 40, rng, on=[side["z"], bore])
    points = points + 0.01 * rng.uniform(-1.0, 1.0, (len(points), 1)) * normals
    datums = [Datum("A", (side["z"],)), Datum("B", (bore,), outside=True)]
    tips = tip_centres(Placement(), points, normals, made)
    found = align(tips, part, made, Placement(), datums=datums, extrapolate=True)
    here = found.placement.inverse.points(points[faces == bore])
    flat = np.c_[here[:, :2], np.zeros(len(here))]
    circle = associate_by("inscribed", "circle", flat, axis=(0.0, 0.0, 1.0))
    assert not found.gross.any()
    assert circle.point[:2] == pytest.approx([12.0, 12.0], abs=1e-6)  # where the part has it


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"part": "part.step"}, "expected a Part, not a str: read_part"),
        ({"start": (0.0, 0.0, 0.0)}, "expected a Placement, not a tuple"),
        ({"datums": ["A"]}, "expected a Datum, not a str"),
        ({"datums": [Datum("A", (0,)), Datum("A", (1,))]}, "datum A is given twice"),
        ({"pretravel_map": 3.0}, "expected a map, not a float"),
    ],
)
def test_what_is_no_part_start_or_datum(arguments: dict[str, object], words: str) -> None:
    touches = Touches([[0.0, 0.0, 2.0]], [[0.0, 0.0, 1.0]])
    given = {"part": bracket(), "pretravel_map": radius_alone(2.0), "start": Placement()}
    with pytest.raises(PretravelError, match=words):
        aligning.align(touches, **(given | arguments))  # type: ignore[arg-type]


def test_a_datum_that_was_not_touched_is_refused() -> None:
    part, side = bracket(), _box_faces(bracket())
    tips, untouched = _touched(part, [side["z"]], Placement()), [Datum("B", (side["x"],))]
    with pytest.raises(PretravelError, match="no touch lies on the faces of datum B"):
        align(tips, part, radius_alone(RADIUS), Placement(), datums=untouched, extrapolate=True)


@pytest.mark.long
@pytest.mark.parametrize(
    ("count", "places"), [(15, 1), pytest.param(40, 2, marks=pytest.mark.slow)]
)
def test_a_placement_is_found_from_nothing(count: int, places: int) -> None:
    """Tip centres alone, without normals, anywhere: one answer, the right one."""
    rng, part, made = np.random.default_rng(count), bracket(), radius_alone(RADIUS)
    for _ in range(places):
        points, normals, _ = random_targets(part, count, rng)
        points = points + normals * (2.0 * UM * rng.standard_normal((count, 1)))
        placement = random_placement(rng)
        tips = tip_centres(placement, points, normals, made)
        found = found_placements(tips, part, made, extrapolate=True)
        assert len(found) == 1
        assert _apart(part, found[0].placement, placement) < 0.05


@pytest.mark.long
def test_approaches_exclude_placements_from_nothing() -> None:
    """Each approach is against the normal of its face: the same answer with them, none where each
    is along the normal."""
    rng, part, made = np.random.default_rng(8), bracket(), radius_alone(RADIUS)
    points, normals, _ = random_targets(part, 30, rng)
    placement = random_placement(rng)
    tips = tip_centres(placement, points, normals, made)
    inward = -placement.vectors(normals)
    found = found_placements(replace(tips, approaches=inward), part, made, extrapolate=True)
    assert len(found) == 1
    assert _apart(part, found[0].placement, placement) < 0.05
    away = found_placements(replace(tips, approaches=-inward), part, made, extrapolate=True)
    assert all(_apart(part, each.placement, placement) > 1.0 for each in away)


@pytest.mark.long
def test_a_symmetric_part_has_several_answers() -> None:
    """Half turns about the axes of a box leave it as it is: four placements."""
    from tests.unit.surface.test_faces_of_a_box import _box

    rng, part, made = np.random.default_rng(4), _box(), radius_alone(1.0)
    points, normals, _ = random_targets(part, 30, rng, 1.0)
    placement = random_placement(rng)
    tips = tip_centres(placement, points, normals, made)
    found = found_placements(tips, part, made, extrapolate=True)
    assert len(found) == 4
    turns = [each.placement.rotation.T @ placement.rotation for each in found]
    assert all(np.allclose(np.abs(turn), np.eye(3), atol=1e-6) for turn in turns)


@pytest.mark.parametrize("letters", ["", "A"])
def test_the_part_follows_the_errors_of_its_points(letters: str) -> None:
    """What a movement by the touches leaves of noise and of the tip's radius, by hand: all that
    points in the part state, and no more than single touches have on their own."""
    rng, part = np.random.default_rng(6), bracket()
    made = replace(radius_alone(RADIUS), repeatability=1.0 * UM, u_tip_radius=2.0 * UM)
    points, normals, faces = random_targets(part, 40, rng)
    placement = random_placement(rng)
    tips = tip_centres(placement, points, normals, made)
    datums = [Datum(letter, tuple(np.unique(faces).tolist())[:4]) for letter in letters]
    found = align(tips, part, made, placement, datums=datums, extrapolate=True)
    inside = points_in_part(found)
    assert inside.positions == pytest.approx(points, abs=1e-6)
    assert inside.shared is not None
    n = found.points.normals
    by_motion = np.column_stack([n, np.cross(found.points.positions - found.about, n)])
    follows = np.zeros((len(n), len(n)))
    amounts = found.association.response[: found.motions.shape[1]]
    follows[:, found.used] = by_motion @ found.motions @ amounts
    left = np.eye(len(n)) - follows
    true = left @ (np.eye(len(n)) + 4.0) @ left.T
    given = sum(np.outer(each, each) for each in inside.shared.values()) / UM**2
    common = np.diag(given).copy()
    own = np.einsum("ni,nij,nj->n", inside.normals, inside.covariance, inside.normals) / UM**2
    assert own - common == pytest.approx(1.0, rel=1e-6)
    beyond = np.linalg.eigvalsh(given + np.eye(len(n)) - true)
    assert beyond[0] > -1e-6
    if not letters:  # least squares on all touches leave six numbers less, and add nothing but k
        k = float(np.max(found.expanded_uncertainty / found.standard_uncertainty))
        assert k < 2.2  # a form smaller than the errors is never excluded
        assert np.trace(given + np.eye(len(n)) - true) < 6.5 * (0.5 * k) ** 2


def test_what_keeps_no_degrees_of_freedom_has_half_of_u() -> None:
    """Faces off by 5 µm: few faces show how far. 2 u of a stored placement is U of the report."""
    rng, part, made = np.random.default_rng(8), bracket(), radius_alone(RADIUS)
    points, normals, faces = random_targets(part, 14, rng)
    off = 5.0 * UM * rng.standard_normal(len(part.faces))[faces]
    placement = random_placement(rng)
    tips = tip_centres(placement, points + off[:, None] * normals, normals, made)
    found = align(tips, part, made, placement, extrapolate=True)
    assert np.all(found.expanded_uncertainty > 2.1 * found.standard_uncertainty)
    errors = found.measured_placement.errors
    assert errors is not None
    stored = 2.0 * np.sqrt(np.diag(errors.covariance))
    assert stored == pytest.approx(found.expanded_uncertainty, rel=1e-9)


def test_touches_that_nothing_checks_are_named() -> None:
    """One touch on the only face across x: it alone says where the part is along x."""
    part, made = bracket(), radius_alone(RADIUS)
    rng, side = np.random.default_rng(15), _box_faces(part)
    many, normals, _ = random_targets(part, 16, rng, on=[side["z"], side["y"]])
    single, across, _ = random_targets(part, 1, rng, on=[side["x"]])
    tips = tip_centres(Placement(), np.vstack([many, single]), np.vstack([normals, across]), made)
    found = align(tips, part, made, Placement(), extrapolate=True)
    assert found.unchecked.tolist() == [16]
    twice, across_twice, _ = random_targets(part, 3, rng, on=[side["x"]])
    tips = tip_centres(
        Placement(), np.vstack([many, twice]), np.vstack([normals, across_twice]), made
    )
    assert align(tips, part, made, Placement(), extrapolate=True).unchecked.tolist() == []


def test_points_onto_points() -> None:
    rng = np.random.default_rng(2)
    placement, points = random_placement(rng), rng.normal(size=(5, 3))
    found = placement_onto(points, placement.points(points))
    assert found.rotation == pytest.approx(placement.rotation, abs=1e-12)
    assert found.shift == pytest.approx(placement.shift, abs=1e-9)


def test_points_of_a_plane_are_not_mirrored() -> None:
    """A mirrored part fits them as well: see findings/trimesh_mirrored_alignment.sh."""
    rng = np.random.default_rng(3)
    points = np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [100.0, 60.0, 0.0], [0.0, 60.0, 0.0]])
    for _ in range(20):
        placement = random_placement(rng)
        touched = placement.points(points) + rng.normal(0.0, 0.002, points.shape)
        turned = placement_onto(points, touched).rotation - placement.rotation
        assert np.abs(turned).max() < 5 * 0.002 / 30.0  # five errors at half the width


def test_faces_that_are_known_are_kept() -> None:
    """A start between two faces: with known faces the answer is right."""
    rng, part, made = np.random.default_rng(13), bracket(), radius_alone(RADIUS)
    points, normals, faces = random_targets(part, 60, rng)
    placement = Placement()
    tips = replace(tip_centres(placement, points, normals, made), faces=faces)
    far = beside(placement, rng, 0.05, 6.0)
    found: Alignment = align(tips, part, made, far, extrapolate=True)
    assert _apart(part, found.placement, placement) < 1e-5
    assert len(MOTIONS) == found.motions.shape[1]


def test_three_touches_determine_three_motions() -> None:
    rng, part, made = np.random.default_rng(14), bracket(), radius_alone(RADIUS)
    points, normals, _ = random_targets(part, 40, rng)
    tips = tip_centres(Placement(), points[:3], normals[:3], made)
    found = align(tips, part, made, Placement(), extrapolate=True)
    assert found.undetermined.shape[1] == 3
    assert found.scatter == 0.0


def test_a_placement_is_no_mirror_and_keeps_its_numbers() -> None:
    """A left-handed frame would exchange bores and bosses."""
    with pytest.raises(PretravelError, match="axes of the part are not perpendicular"):
        Placement(np.diag([1.0, 1.0, -1.0]))
    with pytest.raises(PretravelError, match="axes of the part are not perpendicular"):
        Placement(0.999 * np.eye(3))
    given = np.zeros(3)
    placement = Placement(np.eye(3), given)
    given[:] = 9.0
    assert placement.shift.tolist() == [0.0, 0.0, 0.0]
