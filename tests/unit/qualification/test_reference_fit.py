"""Touches on blocks, rings and pins: a simulator apart from the model; what is not determined."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.block_qualification import LENGTHS, TIP_DIAMETER, Shop, one_set
from pretravel.base.arrays import FloatArray
from pretravel.base.errors import PretravelError
from pretravel.maps.machine_terms import MachinePriors, displacements, last_moves
from pretravel.qualification.axis_errors import hypotheses
from pretravel.qualification.block_plan import plan_block
from pretravel.qualification.reference_fit import contradicted_priors, fit_references
from pretravel.qualification.references import Reference
from pretravel.tasks.qualify.references_report import reference_document
from pretravel.touches import Touches

FOUR = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
NOISE = 0.2e-3
NO_TOUCHES = np.zeros((0, 3))
EVERY = [(np.exp(one.log_prior), one.size) for one in hypotheses(NO_TOUCHES, NO_TOUCHES)]
USUAL = np.sqrt(sum(w * size**2 for w, size in EVERY) / sum(w for w, _ in EVERY))
"""Root mean square of what axes repeat, as it is known before any touch: 0.3 µm."""
STATED = 8
"""Of the nine terms: nothing comes from below a block; the play of z looks like pretravel."""


def _ring_and_block(scale: float, seed: int = 4) -> Touches:
    """A ring of 40 mm and a block of 60 mm, touched in four directions on a stretched machine.

    With a scale s of the machine, p = P (1 + s): inside, P (1 + s) = (R - r + d); outside,
    P (1 + s) = L / 2 + r - d.
    """
    rng = np.random.default_rng(seed)
    travel = np.array([0.010, 0.012, 0.011, 0.014])
    rows, names = [], []
    for along in (-10.0, 10.0) * 3:
        for n, d in zip(FOUR, travel, strict=True):
            noise = rng.normal(0.0, NOISE, 2)
            rows.append(-n * (20.0 - 3.0 + d + noise[0]) / (1.0 + scale))
            face = n * (30.0 + 3.0 - d - noise[1]) + along * np.array([-n[1], n[0], 0.0])
            rows.append(face / (1.0 + scale) + [100.0, 0.0, 0.0])
            names += ["r40", "block@0"]
    return Touches(np.array(rows), np.repeat(FOUR, 2, axis=0).tolist() * 6, references=tuple(names))


@pytest.mark.long
@pytest.mark.parametrize("shops", [4, pytest.param(300, marks=pytest.mark.slow)])
def test_terms_lie_within_their_uncertainty(shops: int) -> None:
    """U is that of 95.45 %. Of 4 shops with 8 terms, 32 cases, 95.45 % are within with a standard
    deviation of 3.7 % if terms of one shop were independent; 8 % are allowed."""
    inside = []
    for number in range(shops):
        shop, found = one_set(number)
        known = [term.determined for term in found.terms]
        assert sum(known) == STATED
        assert not found.term("backlash of z").determined
        inside += [
            abs(term.value - truth) <= term.expanded
            for term, truth in zip(found.terms, shop.truth, strict=True)
            if term.determined
        ]
    allowed = 0.02 if shops > 100 else 0.08
    assert np.mean(inside) == pytest.approx(0.9545, abs=allowed)


def test_a_cube_does_not_tell_scale_from_pretravel() -> None:
    """One length along x and y: L (1 - s) + 2 r - d - d' is all that is seen of them."""
    _, found = one_set(3, (50.8,) * 3)
    scale, pair = found.term("scale of x"), found.pairs[0]
    assert not scale.determined
    assert "pretravel" in scale.told_from
    assert not pair.determined
    assert "scale of x" in pair.told_from
    # The plate under the block is another matter, and angles and play need no length.
    for name in ("scale of z", "squareness of x and y", "backlash of x"):
        assert found.term(name).determined


def test_known_scales_give_the_pretravel() -> None:
    shop = Shop(np.random.default_rng(8), (50.8,) * 3)
    shop.scale[:] = 0.0
    block = Reference("block", "block", (50.8,), u_size=0.3e-3)
    found = fit_references(
        shop.touches(plan_block((50.8,))),
        [block],
        tip_diameter=TIP_DIAMETER,
        priors=MachinePriors(u_scale=0.0),
    )
    x = np.array([1.0, 0.0, 0.0])
    pair = found.pairs[0]
    assert pair.determined
    assert abs(pair.value - shop.pretravel(x) - shop.pretravel(-x)) < pair.expanded
    assert "scale of x" not in [term.name for term in found.terms]


@pytest.mark.parametrize("tip_diameter", [6.0, None])
def test_inside_and_outside_give_the_scale(tip_diameter: float | None) -> None:
    """Ring and block together: tip and pretravel cancel in the sum of both, D + L = 100 mm."""
    references = [Reference("r40", "ring", (40.0,)), Reference("block", "block", (60.0,), form=0.0)]
    found = fit_references(_ring_and_block(150e-6), references, tip_diameter=tip_diameter)
    for axis in "xy":
        scale = found.term(f"scale of {axis}")
        assert scale.determined
        assert abs(scale.value - 150e-6) < scale.expanded
        # A mean of 2 x 2 x 6 touches and both sizes, over 100 mm; and what the axes repeat at four
        # places, of which these touches exclude the largest sizes alone.
        u = np.sqrt(
            4.0 * NOISE**2 / 6.0
            + references[0].u_of(40.0) ** 2
            + references[1].u_of(60.0) ** 2
            + 4.0 * USUAL**2
        )
        assert scale.u == pytest.approx(u / 100.0, rel=0.4)
    assert "same directions" not in " ".join(map(str, reference_document(found, references).notes))


def test_other_directions_of_ring_and_block_are_named() -> None:
    """The ring is touched 5° off the normals of the faces: its pretravel is another unknown."""
    both, turn = _ring_and_block(150e-6), np.radians(5.0)
    ring = np.array([name == "r40" for name in both.references or ()])[:, None]
    about = np.array(
        [[np.cos(turn), -np.sin(turn), 0.0], [np.sin(turn), np.cos(turn), 0.0], [0, 0, 1]]
    )
    turned = [np.where(ring, rows @ about.T, rows) for rows in (both.positions, both.normals)]
    references = [Reference("r40", "ring", (40.0,)), Reference("block", "block", (60.0,))]
    found = fit_references(
        Touches(*turned, references=both.references), references, tip_diameter=6.0
    )
    assert not found.term("scale of x").determined
    assert "same directions" in str(reference_document(found, references).notes[-1])


@pytest.mark.parametrize(
    ("stated", "reason"),
    [
        ({"feeds": [50.0, 500.0]}, "50 to 500 mm/min"),
        ({"spindle": [0.0, np.pi]}, "spindle 180°"),
        ({"tips": ["down", "front"]}, "2 tips"),
    ],
)
def test_touches_of_several_states_are_refused(stated: dict[str, list[float]], reason: str) -> None:
    """Each direction has one pretravel."""
    touches = _ring_and_block(0.0)
    several = {name: np.resize(values, len(touches)) for name, values in stated.items()}
    several = {name: tuple(v) if name == "tips" else v for name, v in several.items()}
    references = [Reference("r40", "ring", (40.0,)), Reference("block", "block", (60.0,))]
    with pytest.raises(PretravelError, match=reason):
        fit_references(replace(touches, **several), references, tip_diameter=6.0)  # type: ignore[arg-type]


def test_what_is_stated_of_a_machine_is_compared_with_the_touches() -> None:
    """A scale of 1e-3 on 100 mm of ring and block is 100 µm, and noise is 0.2 µm."""
    references = [Reference("r40", "ring", (40.0,)), Reference("block", "block", (60.0,))]
    free = fit_references(_ring_and_block(1e-3), references, tip_diameter=6.0)
    assert not contradicted_priors(free, MachinePriors().deviations)
    assert not contradicted_priors(free, MachinePriors(u_scale=1e-3).deviations)
    (said,) = contradicted_priors(free, MachinePriors(u_scale=1e-4).deviations)
    assert "explain: scale of x, scale of y." in said


def test_a_ring_alone_gives_no_scale() -> None:
    touches = _ring_and_block(0.0)
    inside = touches.take([name == "r40" for name in touches.references or ()])
    found = fit_references(inside, [Reference("r40", "ring", (40.0,))], tip_diameter=6.0)
    assert not found.term("scale of x").determined
    assert not found.term("backlash of y").determined


def test_an_unknown_bore_beside_a_block_of_three_lengths() -> None:
    """The block gives scale and pretravel, and so the size of a bore that nobody knows."""
    shop = Shop(np.random.default_rng(9))
    shop.shear[:], shop.backlash[:], shop.lobes[:], shop.warming[:] = 0.0, 0.0, 0.0, 0.0
    touches = shop.touches(plan_block(LENGTHS))
    rng = np.random.default_rng(1)
    hole = np.array([-n * (15.0 - 3.0 + shop.mean + rng.normal(0.0, shop.noise)) for n in FOUR] * 3)
    hole[:, :2] /= 1.0 + shop.scale[:2]
    both = Touches(
        np.vstack([touches.positions, hole]),
        np.vstack([touches.normals, *[FOUR] * 3]),
        np.vstack([touches.approach_directions, *[-FOUR] * 3]),
        references=(*(touches.references or ()), *["hole"] * 12),
    )
    references = [Reference("block", "block", LENGTHS), Reference("hole", "ring")]
    found = fit_references(both, references, tip_diameter=TIP_DIAMETER)
    size = found.term("diameter of hole")
    assert size.determined
    assert abs(size.value - 30.0) < size.expanded
    assert size.expanded < 0.008


def test_displacements_by_hand() -> None:
    """A table that is dragged to the left lies to the right of its screw by half of the play."""
    moves = last_moves(np.array([[-1.0, 0.04, 0.0]]))
    found = displacements(np.array([[10.0, 20.0, 30.0]]), moves)[0]
    assert found[:, 0].tolist() == [10.0, 0.0, 0.0]
    assert found[:, 5].tolist() == [0.0, 30.0, 0.0]
    assert found[:, 6].tolist() == [0.5, 0.0, 0.0]
    assert found[:, 7].tolist() == [0.0, -0.5, 0.0]


def _wrong(**changes: object) -> Touches:
    plan = plan_block((50.0,))
    touches = Touches(plan.points + 3.0 * plan.normals, plan.normals, plan.approaches,
                      references=plan.references)  # fmt: skip
    return replace(touches, **changes)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("touches", "reason"),
    [
        (_wrong(references=("ring",) * 96), "none of the references (block)"),
        (_wrong(references=("block@x",) * 96), "a turn in degrees is needed"),
        (_wrong(references=("block@20",) * 96), "not a face of a block that is turned by 20°"),
        (_wrong(references=None, labels=None).take([0, 1, 2, 3]), "degrees of freedom"),
    ],
)
def test_refused(touches: Touches, reason: str) -> None:
    with pytest.raises(PretravelError) as caught:
        fit_references(touches, [Reference("block", "block", (50.0,))], tip_diameter=6.0)
    assert reason in str(caught.value)


@pytest.mark.parametrize(
    ("sizes", "refused"),
    [
        ((50.0 / 25.4,), True),  # inches
        ((50.6,), True),
        ((50.4,), False),  # as far off, it can be an error of the machine
        ((50.0, 60.0, 50.0), True),
        ((50.0, 50.0, 50.0), False),
        ((), False),
    ],
)
def test_a_size_that_the_touches_contradict(sizes: tuple[float, ...], refused: bool) -> None:
    block = [Reference("block", "block", sizes)]
    if refused:
        with pytest.raises(
            PretravelError, match=r"its touches are 50\.00 and .* or is the size in inches"
        ):
            fit_references(_wrong(), block, tip_diameter=6.0)
        return
    assert len(fit_references(_wrong(), block, tip_diameter=6.0).terms) == 9


def test_a_ring_of_another_size() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    out = np.stack([np.cos(angle), np.sin(angle), 0.0 * angle], axis=1)
    inside = Touches(np.repeat(out * 22.0, 3, axis=0), np.repeat(-out, 3, axis=0))
    for size, fits in ((50.0, True), (51.0, False)):
        ring = [Reference("r", "ring", (size,))]
        if fits:
            assert fit_references(inside, ring, tip_diameter=6.0).dof > 3.0
        else:
            with pytest.raises(PretravelError, match=r"its touches are 50\.00 mm apart"):
                fit_references(inside, ring, tip_diameter=6.0)


def test_arrivals_that_are_not_known() -> None:
    """On an oblique face an axis that rests has its play on either side."""
    touches = _wrong()
    way = np.array(touches.approach_directions)
    way[:] = -touches.normals
    oblique = [name == "block@30" for name in touches.references or ()]
    way[oblique] = np.round(way[oblique])
    found = fit_references(
        replace(touches, approaches=way), [Reference("block", "block", (50.0,))], tip_diameter=6.0
    )
    assert any("did not move in their approach" in warning for warning in found.warnings)


@pytest.mark.parametrize(
    ("shape", "sizes", "reason"),
    [
        ("block", (50.0, 60.0), "2 sizes; a block has one, or three along x, y and z"),
        ("ring", (50.0, 50.0, 50.0), "3 sizes; a ring has one diameter"),
    ],
)
def test_a_number_of_sizes_that_there_is_not(
    shape: str, sizes: tuple[float, ...], reason: str
) -> None:
    with pytest.raises(PretravelError, match=f"^r has {reason}$"):
        Reference("r", shape, sizes)


def test_an_outlying_touch_is_named() -> None:
    positions: FloatArray = np.array(_wrong().positions)
    positions += np.random.default_rng(2).normal(0.0, NOISE, positions.shape)
    positions[30] += 0.02 * _wrong().normals[30]
    found = fit_references(
        _wrong(positions=positions), [Reference("block", "block", (50.0,))], tip_diameter=6.0
    )
    assert any(warning.startswith("touch 31 is ") for warning in found.warnings)


@pytest.mark.long
@pytest.mark.parametrize(("amplitude", "moved"), [(0.0, False), (3e-3, False), (3e-3, True)])
def test_what_a_screw_repeats_is_in_u_and_said(amplitude: float, moved: bool) -> None:
    """Once for each turn of a screw of 5 mm: alike in all touches of a face, so that the scale of
    +335 µm/m had U = 85 µm/m. Of 4 x 3 scales one may be outside. Where the block stands elsewhere
    at each turn, u is less than half as large (55 to 110 instead of 180 to 300 µm/m along y)."""
    inside = []
    for number in range(4):
        rng = np.random.default_rng([77, number])
        shop = Shop(rng)
        plan = plan_block(LENGTHS)
        touches = shop.with_screw(shop.touches(plan), amplitude, moved=moved)
        block = Reference("block", "block", LENGTHS, u_size=shop.u_length, u_temperature=0.0)
        found = fit_references(touches, [block], tip_diameter=TIP_DIAMETER)
        assert any("repeat at the same place" in one for one in found.warnings) == (amplitude > 0.0)
        few = [one for one in found.warnings if "scale of x, y, z are at few places" in one]
        assert bool(few) != moved
        inside += [
            abs(term.value - truth) <= term.expanded
            for term, truth in zip(found.terms[:3], shop.truth[:3], strict=True)
        ]
        if amplitude > 0.0:
            assert (found.terms[1].u < 120e-6) == moved
    assert np.sum(inside) >= 11
