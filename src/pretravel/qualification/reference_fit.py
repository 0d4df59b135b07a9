"""Several references in one fit: what touches on blocks, rings, pins and spheres say together.

Every touch is one equation: the spindle point lies on the surface of its reference, farther by the
tip's radius and nearer by the pretravel of its direction. Unknown are where the references are, the
pretravel of each direction (no form of a map is assumed), the terms of the machine
(`machine_terms`), sizes that are not known, squareness and parallelism of blocks, a drift. What is
known of them in advance has its uncertainty; all others are given one so wide that it says nothing.
A term is stated where the touches make its uncertainty smaller. Where they do not, the fit names
the quantities that they do not distinguish from it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pretravel.base import (
    MICROMETRE,
    BoolArray,
    FloatArray,
    PretravelError,
    frozen,
)
from pretravel.maps import (
    TERMS,
    WIDE,
    MachinePriors,
    MachineTerms,
    orientation_of,
)
from pretravel.qualification.axis_errors import WITHIN_A_TURN, AxisErrors, hypotheses
from pretravel.qualification.delay import several_feeds
from pretravel.qualification.reference_model import (
    PLACE,
    PRETRAVEL_OF,
    SAME_DIRECTION,
    ReferenceModel,
)
from pretravel.qualification.references import Reference
from pretravel.touches import Touches
from pretravel.uncertainty import coverage_factor

_WEAKER, _OPEN = 10.0, 1.5
"""Where what says nothing in advance says ten times less, the uncertainty of a quantity that the
touches determine hardly grows; one that grows by more than a half is not determined."""
_NAMED = 0.25
"""Share of the largest part of a combination that names a quantity."""
_FEWEST_FREE = 3.0
_ROUNDS = 8
_ROUNDS_OF_NOISE = 2
_NO_WEIGHT = 1e-4
_NO_DOUBT = 0.02
"""Probability that there are no errors of a screw, from which nothing is said of them."""
_AGAINST = 4.0
"""Standard uncertainties by which a term contradicts what was stated of it."""
_OUTLYING = 4.0
"""Residuals that are larger, in the noise, are named."""
_ELSEWHERE = 2.0
"""Touches of a face that differ less along its axis are at one place of a screw: a quarter of a
turn of 8 mm, beyond which its error is another one. [mm]"""
_STEEP = 0.5
"""Component of a normal along an axis from which a touch tells of this axis."""
_OBLIQUE = 0.1
"""Component of a normal along an axis from which the arrival of this axis matters."""


@dataclass(frozen=True)
class Term:
    """A quantity and how far touches determine it.

    Attributes
    ----------
    name : str
    value, u : float
        [mm, rad or relative]
    factor : float
        k of U, by Student's distribution.
    determined : bool
    told_from : tuple of str
        What the touches do not distinguish it from, where it is not determined.
    """

    name: str
    value: float
    u: float
    factor: float = 2.0
    determined: bool = True
    told_from: tuple[str, ...] = ()

    @property
    def expanded(self) -> float:
        """U."""
        return self.factor * self.u


@dataclass(frozen=True, eq=False)
class ReferenceFit:
    """What touches on references determine.

    Attributes
    ----------
    terms : tuple of Term
        Of the machine.
    sizes : tuple of Term
        That were not known, and the squareness of blocks.
    pairs : tuple of Term
        Pretravel of opposite directions together, with backlash where it is not distinguished.
    directions : (g, 3) float
        Contact normals with a pretravel of their own.
    pretravel : tuple of Term
        Of these directions.
    residuals : (n,) float
        [mm]
    noise : float
        Standard deviation of a touch. [mm]
    dof : float
    drift : (n, 3) float
        [mm]
    covariance : (9, 9) float
        Of all `TERMS`.
    origin : (3,) float
        Point of the machine about which the terms hold. [mm]
    tilts : mapping of str to float
        Of the axes of rings and pins. [rad]
    warnings : tuple of str
    """

    terms: tuple[Term, ...]
    sizes: tuple[Term, ...]
    pairs: tuple[Term, ...]
    directions: FloatArray
    pretravel: tuple[Term, ...]
    residuals: FloatArray
    noise: float
    dof: float
    drift: FloatArray
    covariance: FloatArray
    origin: FloatArray
    tilts: Mapping[str, float]
    warnings: tuple[str, ...] = ()

    def term(self, name: str) -> Term:
        """A term, a size or a pair by its name."""
        return next(one for one in (*self.terms, *self.sizes, *self.pairs) if one.name == name)

    @property
    def machine(self) -> MachineTerms | None:
        """The terms of the machine that are determined, for other touches; None without any."""
        known = {term.name: term for term in self.terms if term.determined}
        if not known:
            return None
        rows = [TERMS.index(name) for name in known]
        values = np.zeros(len(TERMS))
        values[rows] = [term.value for term in known.values()]
        root = np.zeros((len(TERMS), len(rows)))
        root[rows] = np.linalg.cholesky(self.covariance[np.ix_(rows, rows)])
        return MachineTerms(values, root, self.origin, reach=0.0)


def fit_references(
    touches: Touches,
    references: Sequence[Reference],
    *,
    tip_diameter: float | None = None,
    priors: MachinePriors = MachinePriors(),
) -> ReferenceFit:
    """Determine machine, sizes and pretravel from touches on references.

    Parameters
    ----------
    touches : Touches
        In their order. `Touches.references` name the reference of each, ``block@90`` a block that
        was turned by 90°, ``plate@90`` the plate under it; without them all are on the only
        reference, and a block's turns follow from the normals. The probe's axis is the z axis.
    references : sequence of Reference
    tip_diameter : float, optional
        Not given: pretravel is less the tip's radius, up to one constant. [mm]
    priors : MachinePriors

    Raises
    ------
    PretravelError
        A touch on no reference, or on no face of its block; fewer touches than unknowns; touches
        at several feeds or orientations of the spindle, or of several tips.

    >>> block = Reference("block", "block", (50.0,))
    >>> n = np.array([[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0]] * 6)
    >>> at = n * (25.0 + 3.0 - 0.010) + np.repeat([[0.0] * 3, [5.0] * 3], 12, axis=0) * (1 - abs(n))
    >>> found = fit_references(Touches(at, n), [block], tip_diameter=6.0)
    >>> found.term("scale of x").determined, found.term("squareness of x and y").determined
    (False, False)
    """
    _refuse_several_states(touches)
    model = ReferenceModel(touches, references, tip_diameter, priors)
    unknowns = _solved(model)
    return _judged(model, unknowns)


def contradicted_priors(free: ReferenceFit, deviations: FloatArray) -> list[str]:
    """A warning where touches contradict what is stated of the machine.

    Parameters
    ----------
    free : ReferenceFit
        Of the touches, where nothing is stated.
    deviations : (9,) float
        Stated standard uncertainties of `TERMS`.
    """
    by_name = {term.name: term for term in free.terms if term.determined}
    against = [
        name
        for name, stated in zip(TERMS, deviations.tolist(), strict=True)
        if name in by_name
        and abs(by_name[name].value) > _AGAINST * math.hypot(by_name[name].u, stated)
    ]
    if not against:
        return []
    said = (
        "the touches contradict what is given of the machine. Without it these differ from zero by "
        f"more than both uncertainties explain: {', '.join(against)}. Their errors are now in the "
        "pretravel, and U does not contain them"
    )
    return [said]


def _refuse_several_states(touches: Touches) -> None:
    """Refuse touches whose pretravel in one direction is not one: this fit has one for each."""
    touches.refuse_several()
    orientation_of(touches)
    if several_feeds(touches):
        assert touches.feeds is not None
        raise PretravelError(
            f"the touches are at {touches.feeds.min():g} to {touches.feeds.max():g} mm/min: feed × "
            "signal delay would look like backlash or pretravel of single directions. Touch all "
            "references at one feed, or choose the touches of one",
            inputs=("series", "exclude"),
        )


def _shown(name: str) -> str:
    """The name of an unknown for people."""
    return re.sub(r"^(drift) (.)\d$", r"\1 of \2", name.partition(" #")[0])


@dataclass(frozen=True, eq=False)
class _Solved:
    values: FloatArray
    covariance: FloatArray
    """For the noise that was found."""
    weaker: FloatArray
    """The same where what says nothing in advance says less."""
    residual: FloatArray
    noise: float
    dof: float
    repeating: float
    """Standard deviation of errors that repeat at the same place of an axis. [mm]"""
    without: float = 1.0
    """Probability that there are none."""

    def u_and_open(self, weights: FloatArray) -> tuple[float, bool]:
        """Standard uncertainty of a sum of unknowns, and whether it is not determined."""
        own, weaker = (math.sqrt(max(float(weights @ matrix @ weights), 0.0))
                       for matrix in (self.covariance, self.weaker))  # fmt: skip
        return own, weaker > _OPEN * own


def _solved(model: ReferenceModel) -> _Solved:
    """The average of fits over the errors that repeat at the same place of an axis."""
    values, noise = np.array(model.unknowns.start), 1.0 * MICROMETRE
    every = list(hypotheses(model.positions, model.touches.normals))
    for _ in range(_ROUNDS):
        fit = _step(model, model.equations(values), values, noise, every[0])
        values, noise = fit.values, fit.noise
    linear, fits = model.equations(values), [fit]
    for each in every[1:]:
        fit = _step(model, linear, values, noise, each)
        for _ in range(_ROUNDS_OF_NOISE):
            fit = _step(model, linear, values, fit.noise, each)
        fits.append(fit)
    logs = np.array([fit.log_evidence for fit in fits])
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    mean = np.asarray(weights @ np.array([fit.values for fit in fits]))
    apart = np.array([fit.values for fit in fits]) - mean
    own, weaker = (np.zeros((len(mean), len(mean))) + (apart.T * weights) @ apart for _ in "ab")
    for fit, weight in zip(fits, weights, strict=True):
        if weight > _NO_WEIGHT:
            own += weight * fit.covariance(model, weaker=False)
            weaker += weight * fit.covariance(model, weaker=True)
    return _Solved(
        mean,
        own,
        weaker,
        model.equations(mean)[0],
        float(weights @ [fit.noise for fit in fits]),
        float(weights @ [fit.dof for fit in fits]),
        math.sqrt(float(weights @ [each.size**2 for each in every])),
        float(weights[0]),
    )


@dataclass(frozen=True, eq=False)
class _Fit:
    """A linear fit with given errors of the axes."""

    values: FloatArray
    noise: float
    dof: float
    log_evidence: float
    scaled: FloatArray
    """Derivatives in the noise, by unknowns in units of what was known in advance."""

    def covariance(self, model: ReferenceModel, *, weaker: bool) -> FloatArray:
        """Of the unknowns; weaker: where what says nothing in advance says less."""
        deviation = np.array(model.unknowns.deviation)
        free = deviation > 0.0
        known = 1.0 / np.where(weaker & _says_nothing(model)[free], _WEAKER, 1.0)
        r = np.linalg.qr(np.vstack([self.scaled, np.diag(known)]), mode="r")
        inverse = np.linalg.inv(r) * deviation[free, None]
        found = np.zeros((len(deviation), len(deviation)))
        found[np.ix_(free, free)] = inverse @ inverse.T
        return found


def _step(
    model: ReferenceModel,
    linear: tuple[FloatArray, FloatArray],
    values: FloatArray,
    noise: float,
    errors: AxisErrors,
) -> _Fit:
    """The linear fit at `values`."""
    residual, jacobian = linear
    deviation = np.array(model.unknowns.deviation)
    free = deviation > 0.0
    covariance = np.eye(len(residual)) + (errors.size / noise) ** 2 * errors.shared
    root = np.linalg.cholesky(covariance)
    # Unknowns in units of what was known in advance: matrices of one scale.
    whitened = np.linalg.solve(
        root, np.column_stack([jacobian[:, free] * deviation[free], residual])
    )
    scaled, white = whitened[:, :-1] / noise, whitened[:, -1]
    own = (np.array(model.unknowns.start) - values)[free] / deviation[free]
    q, r = np.linalg.qr(np.vstack([scaled, np.eye(len(own))]))
    step = np.linalg.solve(r, q.T @ np.append(-white / noise, own))
    dof = len(residual) - float(np.sum(q[: len(residual)] ** 2))
    if dof < _FEWEST_FREE:
        raise PretravelError(
            f"{len(residual)} touches on these references leave {max(dof, 0.0):.1f} degrees of "
            f"freedom; {_FEWEST_FREE:.0f} are needed to know the noise: repeat touches"
        )
    left, own = white / noise + scaled @ step, own - step
    found = values.copy()
    found[free] += step * deviation[free]
    log_evidence = errors.log_prior - 0.5 * (
        float(left @ left)
        + float(own @ own)
        + 2.0 * len(residual) * math.log(noise)
        + 2.0 * float(np.sum(np.log(np.diag(root))) + np.sum(np.log(np.abs(np.diag(r)))))
    )
    better = max(noise * math.sqrt(float(left @ left) / dof), 1e-8)
    return _Fit(found, better, dof, log_evidence, scaled)


def _says_nothing(model: ReferenceModel) -> BoolArray:
    """Unknowns whose standard deviations in advance are only wide, (u,)."""
    deviation, names = np.array(model.unknowns.deviation), model.unknowns.names
    wide = np.zeros(len(names), dtype=bool)
    for place, name in enumerate(names):
        if place < len(TERMS):
            wide[place] = deviation[place] >= WIDE[place // 3]
        elif name.startswith(("length of", "diameter of")):
            wide[place] = deviation[place] >= PLACE
        else:
            upright = re.fullmatch(r"(rotation of .* about [xy]|z of .*)", name)  # it stands there
            wide[place] = not name.startswith(("wedge of", "drift")) and upright is None
    return wide


def _judged(model: ReferenceModel, found: _Solved) -> ReferenceFit:
    names = model.unknowns.names
    deviation = np.array(model.unknowns.deviation)
    factor = coverage_factor(found.dof)

    def term(place: int, name: str) -> Term:
        u, is_open = found.u_and_open(np.eye(len(names))[place])
        others = _told_from(model, found, place) if is_open else ()
        return Term(name, float(found.values[place]), u, factor, not is_open, others)

    terms = tuple(term(place, name) for place, name in enumerate(TERMS) if deviation[place] > 0.0)
    known = [
        place for place, name in enumerate(names)
        if place >= len(TERMS) and (
            name.startswith("squareness of ")
            or (name.startswith(("diameter of ", "length of ")) and deviation[place] >= PLACE)
        )
    ]  # fmt: skip
    first = model.base
    of_directions = range(first, first + len(model.directions))
    return ReferenceFit(
        terms=terms,
        sizes=tuple(term(place, names[place]) for place in known),
        pairs=_pairs(model, found, factor),
        directions=frozen(model.directions),
        pretravel=tuple(
            term(place, _shown(names[place]).removeprefix(PRETRAVEL_OF)) for place in of_directions
        ),
        residuals=frozen(found.residual),
        noise=found.noise,
        dof=found.dof,
        drift=frozen(model.drift(found.values)),
        covariance=frozen(found.covariance[: len(TERMS), : len(TERMS)]),
        origin=frozen(model.origin),
        tilts={
            name: float(found.values[i]) for i, name in enumerate(names) if name.startswith("tilt")
        },
        warnings=(
            *_arrivals(model),
            *_outlying(model, found),
            *_repeating(found),
            *_at_few_places(model, terms),
        ),
    )


def _arrivals(model: ReferenceModel) -> list[str]:
    """A warning about touches whose arrival is not known where it matters."""
    resting = (model.moves == 0.0) & (np.abs(model.touches.normals) > _OBLIQUE)
    count = int(np.sum(resting.any(axis=1)))
    if not count:
        return []
    return [
        (
            f"{count} touches are on faces that are oblique to an axis which did not move in their "
            "approach: the side on which its backlash is taken up is not known. Let both axes move "
            "in the approach, as the plan of a block does"
        )
    ]


def _outlying(model: ReferenceModel, found: _Solved) -> list[str]:
    """A warning about the touch that fits least, where noise alone hardly makes it."""
    worst = int(np.argmax(np.abs(found.residual)))
    size = abs(float(found.residual[worst]))
    if size < _OUTLYING * math.hypot(found.noise, found.repeating):
        return []
    return [
        (
            f"{model.touches.where(worst)} is {size / MICROMETRE:.1f} µm off, "
            f"{size / found.noise:.1f} times the noise: look for dirt, or leave it out"
        )
    ]


def _repeating(found: _Solved) -> list[str]:
    """A warning about errors of the axes that repeats do not show."""
    if found.without > _NO_DOUBT:
        return []
    return [
        (
            f"the axes have errors that repeat at the same place, about "
            f"{found.repeating / MICROMETRE:.1f} µm, as those of a screw once for each turn "
            f"(probability {1.0 - found.without:.2f}). They are alike in all touches of a face, "
            "and u of the scales contains them: at each turn place the block a few millimetres "
            "elsewhere along each axis"
        )
    ]


def _at_few_places(model: ReferenceModel, terms: Sequence[Term]) -> list[str]:
    """A warning about scales between few places of an axis: errors of its screw are in them."""
    known = {term.name for term in terms if term.determined}
    found = [
        (letter, apart) for axis, letter in enumerate("xyz")
        if TERMS[axis] in known and (apart := _few_places(model, axis))
    ]  # fmt: skip
    if not found:
        return []
    axes = ", ".join(letter for letter, _ in found)
    wrong = WITHIN_A_TURN / min(apart for _, apart in found)
    return [
        (
            f"the touches that give the scale of {axes} are at few places of the axis, because the "
            "block stands at the same place at all turns. An error of the screw at these places "
            "changes the scale, and touches hardly show it. ISO 3408-3 allows "
            f"{WITHIN_A_TURN / MICROMETRE:.0f} µm within a revolution of a screw of grade 3 (not "
            "compared with its text): over these lengths this is up to "
            f"{wrong * 1e6:.0f} µm/m. U takes such an error as random, and "
            "a single screw can exceed U. At each turn place "
            "the block a few millimetres elsewhere along each axis, along z on parallels"
        )
    ]


def _few_places(model: ReferenceModel, axis: int) -> float:
    """Distance of the two ends of an axis that touches on blocks reach; zero: they reach more."""
    normal, at = model.touches.normals[:, axis], model.positions[:, axis]
    upper = np.where(model.plate, False, normal > _STEEP)
    ends = [at[upper], at[model.plate if axis == 2 and model.plate.any() else normal < -_STEEP]]
    if not all(len(end) for end in ends):
        return 0.0
    apart = abs(float(np.mean(ends[0]) - np.mean(ends[1])))
    of_block = [
        model.unknowns.start[place] for name, place in model.unknowns.at.items()
        if name.startswith(f"{'xyz'[axis]} of ")
    ]  # fmt: skip
    moved = len(of_block) < 2 or float(np.ptp(of_block)) > _ELSEWHERE
    several = any(float(np.ptp(end)) > _ELSEWHERE for end in ends)
    return 0.0 if moved and several else apart


def _told_from(model: ReferenceModel, found: _Solved, place: int) -> tuple[str, ...]:
    """Quantities that keep an unknown from being determined: those that go with it."""
    deviation, names = np.array(model.unknowns.deviation), model.unknowns.names
    u, weaker = (np.sqrt(np.maximum(np.diag(matrix), 0.0))
                 for matrix in (found.covariance, found.weaker))  # fmt: skip
    open_ones = weaker > _OPEN * u
    move = np.abs(found.weaker[:, place]) / math.sqrt(found.weaker[place, place])
    share = np.where(open_ones, move / np.maximum(deviation, 1e-12), 0.0)
    share[place] = 0.0
    order = np.argsort(-share)
    largest = float(share[order[0]])
    if largest < 0.05:
        return ()
    chosen = [_shown(names[i]) for i in order if share[i] > _NAMED * largest]
    directions = [name for name in chosen if name.startswith(PRETRAVEL_OF)]
    if len(directions) > 2:
        chosen = ["pretravel", *(name for name in chosen if name not in directions)]
    plain = [
        "how the reference lies: touch each face at two places"
        if name.startswith(("rotation of", "tilt of"))
        else "place of the reference" if re.match(r"[xyz] of ", name) else name
        for name in chosen
    ]  # fmt: skip
    return tuple(dict.fromkeys(plain))[:4]


def _pairs(model: ReferenceModel, found: _Solved, factor: float) -> tuple[Term, ...]:
    """Pretravel of opposite directions together, without the tip's radius where it is not known."""
    pairs = []
    names, at = model.unknowns.names, model.unknowns.at
    units = np.eye(len(names))
    open_axes = [found.u_and_open(units[6 + axis])[1] for axis in range(3)]
    open_scales = [found.u_and_open(units[axis])[1] for axis in range(3)]
    for g, direction in enumerate(model.directions):
        for h in range(g + 1, len(model.directions)):
            both = model.along_normal[g] and model.along_normal[h]
            if not both or direction @ model.directions[h] > -math.cos(SAME_DIRECTION):
                continue
            weights = np.zeros(len(names))
            weights[[model.base + g, model.base + h]] = 1.0
            if "radius of the tip" in at:
                weights[at["radius of the tip"]] = -2.0
            joined = [axis for axis in range(3) if open_axes[axis] and abs(direction[axis]) > 1e-3]
            for axis in joined:
                weights[6 + axis] = abs(direction[axis])
            u, is_open = found.u_and_open(weights)
            first, second = (
                _shown(names[model.base + k]).removeprefix(PRETRAVEL_OF) for k in (g, h)
            )
            name = f"pretravel of {first} and {second} together"
            if "radius of the tip" in at:
                name += ", minus the tip's diameter"
            for axis in joined:
                name += f", with the backlash of {'xyz'[axis]}"
            value = float(weights @ found.values)
            scales = [TERMS[axis] for axis in range(3)
                      if abs(direction[axis]) > _OBLIQUE and open_scales[axis]]  # fmt: skip
            others = tuple(scales or ["size of the reference"]) if is_open else ()
            pairs.append(Term(name, value, u, factor, not is_open, others))
    return tuple(pairs)
