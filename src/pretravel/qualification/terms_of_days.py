"""What one day's touches on the reference say of a probe and its map: level, scale, turn, form.

The differences from the map are fitted by least squares with equal weights, so that on the same
directions the errors of the map are the same every day. The uncertainties are those of the day's
own touches: errors that all days share (of the map, what it leaves of the lobes in single
directions, of the calibrated diameter) are not in them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pretravel.base import DEGREE, MICROMETRE, SECONDS_PER_MINUTE, FloatArray
from pretravel.maps import PretravelMap, QualificationSetup
from pretravel.qualification.change_tests import TouchesAndMap, separable_columns
from pretravel.qualification.delay import SignalDelay, several_feeds, travel_per_second
from pretravel.qualification.drifts import DailyQuantity
from pretravel.qualification.outliers import Outlier
from pretravel.qualification.probe_drift import slope_around_axis
from pretravel.qualification.qualifying import prepare
from pretravel.qualification.unseen_turn import USUAL_RATE, UnseenTurn, unseen_turn
from pretravel.qualification.verification import touches_beside_map
from pretravel.touches import Touches

_MEAN_ROOT = 1.25
"""Variance of a normal quantity over that of the signed root of its size, in its deviation:
1 / E|x|."""


@dataclass(frozen=True)
class DayTerms:
    """A probe on one day, less its map; not a number where something is not determined.

    Attributes
    ----------
    touches, directions : int
    level, u_level : float
        Pretravel in all directions alike; the effective radius of the tip is smaller by it. [mm]
    scale, u_scale : float
        Of the variation of the map over the directions. [1]
    turn, u_turn : float
        About the axis. [rad]
    form, u_form : float
        Root mean square of what the others leave, beyond the noise; negative where it is smaller
        than the noise would produce. [mm]
    delay, u_delay : float
        Signal delay, of touches at several feeds. [s]
    feed : float
        The fastest; not a number where not stated. [mm/min]
    gross : tuple of Outlier
        Touches that were left out.
    warnings : tuple of str
    unseen_turn : UnseenTurn, optional
        A turn that these directions cannot show; `turn` is then not a number.
    """

    touches: int
    directions: int
    level: float
    u_level: float
    scale: float
    u_scale: float
    turn: float
    u_turn: float
    form: float
    u_form: float
    delay: float
    u_delay: float
    feed: float
    gross: tuple[Outlier, ...] = ()
    warnings: tuple[str, ...] = ()
    unseen_turn: UnseenTurn | None = None


def day_terms(
    touches: Touches, pretravel_map: PretravelMap, setup: QualificationSetup, *, own: bool = False
) -> DayTerms:
    """Compare one day's touches with a map.

    Parameters
    ----------
    touches : Touches
        On the reference, wherever it stands.
    pretravel_map : PretravelMap
        Of the same tip, from `qualify`, of a kind that follows the probe.
    setup : QualificationSetup
        The reference.
    own : bool
        Whether the map was made from these touches: they tell nothing of a change of form.

    Raises
    ------
    PretravelError
        As `pretravel.qualification.verification.verify`.
    """
    delay = _delay(touches, pretravel_map, setup)
    if delay is not None:
        pretravel_map = replace(pretravel_map, delay=delay.delay)
    found = touches_beside_map(touches, pretravel_map, setup.diameter, ring=setup.ring)
    compared = found.kept
    change, covariance, rest = _fitted(compared)
    u = np.sqrt(np.diagonal(covariance))
    unseen = None if own else unseen_turn(compared, pretravel_map, USUAL_RATE)
    if unseen is not None:
        change[2] = u[2] = math.nan
    travel = 0.0 if delay is None else delay.u_delay * float(np.mean(travel_per_second(touches)))
    form, u_form = (math.nan, math.nan) if own else _form(compared, rest)
    return DayTerms(
        touches=len(touches),
        directions=len(compared.differences),
        level=float(change[0]),
        u_level=math.hypot(float(u[0]), travel),
        scale=float(change[1]),
        u_scale=float(u[1]),
        turn=float(change[2]),
        u_turn=float(u[2]),
        form=form,
        u_form=u_form,
        delay=math.nan if delay is None else delay.delay,
        u_delay=math.nan if delay is None else delay.u_delay,
        feed=math.nan if touches.feeds is None else float(touches.feeds.max()),
        gross=found.gross,
        warnings=(*found.feed_warnings, *found.machine_warnings),
        unseen_turn=unseen,
    )


def _delay(
    touches: Touches, pretravel_map: PretravelMap, setup: QualificationSetup
) -> SignalDelay | None:
    """The day's own signal delay, where the map has one and the feeds separate it."""
    if pretravel_map.delay is None or not several_feeds(touches):
        return None
    tip = QualificationSetup(setup.diameter, 2.0 * pretravel_map.tip_radius, setup.ring)
    return prepare(touches, replace(tip, axis=tuple(pretravel_map.rotation[:, 2]))).delay


def _fitted(compared: TouchesAndMap) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Level, scale and turn (3,), the covariance from the day's touches (3, 3), and what makes the
    rest of differences (g, g).
    """
    axes = compared.observation.axes
    used = [*range(axes), *separable_columns(compared.design, axes)]
    design = compared.design[:, used]
    gain = np.linalg.pinv(design)
    of_touches = compared.noise.of_means
    change, covariance = np.full(3, math.nan), np.full((3, 3), math.nan)
    known = [column - axes for column in used[axes:]]
    change[known] = (gain @ compared.differences)[axes:]
    covariance[np.ix_(known, known)] = ((gain * of_touches) @ gain.T)[axes:, axes:]
    return change, covariance, np.eye(len(design)) - design @ gain


def _form(compared: TouchesAndMap, rest: FloatArray) -> tuple[float, float]:
    """Signed root of the mean square that is left beyond the noise, and its uncertainty. [mm]"""
    left = rest @ compared.differences
    count = len(left)
    of_touches = compared.noise.of_means
    noise = (rest * of_touches) @ rest.T
    beyond = (float(left @ left) - float(np.trace(rest @ compared.covariance @ rest.T))) / count
    squares = float(np.sum(noise * noise.T))
    # The touches' part of what is left is in it twice; only the rest is a change of form.
    crossed = max(float(left @ noise @ left) - squares, 0.0)
    u_square = math.sqrt(2.0 * squares + 4.0 * crossed) / count
    if not u_square > 0.0:
        return math.nan, math.nan
    # A root is linear only far from zero; near zero it scatters as the root of the deviation.
    clear = max(abs(beyond) - 2.0 * u_square, 0.0)
    return (
        math.copysign(math.sqrt(abs(beyond)), beyond),
        u_square / math.sqrt(4.0 * clear + _MEAN_ROOT * u_square),
    )


def day_quantities(
    terms: Sequence[DayTerms], pretravel_map: PretravelMap
) -> tuple[DailyQuantity, ...]:
    """The quantities of several days, with what each of them changes in the map.

    Parameters
    ----------
    terms : sequence of DayTerms
    pretravel_map : PretravelMap
        That they are less.

    Returns
    -------
    tuple of DailyQuantity
        Those that any day determines: size [µm], amplitude [%], turn [°], form [µm], signal delay
        [ms]; of the delay less that of the map. A delay changes the pretravel by its travel at the
        fastest feed of the touches.
    """
    directions, value, _ = pretravel_map.over_support()
    steepest = float(np.abs(slope_around_axis(pretravel_map, directions)).max())
    spread = float(np.abs(value - value.mean()).max())
    feeds = [one.feed for one in terms if math.isfinite(one.feed)]
    per_millisecond = 1e-3 * max(feeds, default=0.0) / SECONDS_PER_MINUTE
    rows = (
        ("level", "size", "µm", MICROMETRE, MICROMETRE),
        ("scale", "amplitude", "%", 0.01, 0.01 * spread),
        ("turn", "turn", "°", DEGREE, DEGREE * steepest),
        ("form", "form", "µm", MICROMETRE, MICROMETRE),
        ("delay", "signal delay", "ms", 1e-3, per_millisecond),
    )
    found = []
    for name, label, unit, size, share in rows:
        of_map = pretravel_map.delay or 0.0 if name == "delay" else 0.0
        values = np.array([getattr(one, name) - of_map for one in terms]) / size
        u = np.array([getattr(one, f"u_{name}") for one in terms]) / size
        if np.isfinite(values).any():
            found.append(DailyQuantity(label, unit, values, u, share))
    return tuple(found)


def radius_beside(pretravel_map: PretravelMap) -> float:
    """Effective radius of the tip that a map states: tip less mean pretravel about the centre of
    the least-squares sphere through its touches. [mm]
    """
    nodes = pretravel_map.support.nodes
    value = pretravel_map.basis.value(nodes, pretravel_map.coefficients)
    design = np.column_stack([np.ones(len(nodes)), nodes])
    return pretravel_map.tip_radius - float((np.linalg.pinv(design) @ value)[0])
