"""A drift of the reference that repeats do not show, because they were made in a row.

A kind of map that knows which forms a probe can have shows it by what its fit leaves.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from pretravel.base import MICROMETRE, FloatArray
from pretravel.maps import KindOfMap, MapFit, ReferenceDrift
from pretravel.qualification.own_touches import touch_digests
from pretravel.qualification.qualification import PreparedTouches
from pretravel.qualification.touch_order import drift_columns, drift_is_separable, relative_times
from pretravel.touches import Touches


def drift_of_fits(
    ready: PreparedTouches, fits: Iterable[tuple[KindOfMap, MapFit]]
) -> ReferenceDrift | None:
    """The drift that one of the fits shows, where repeats cannot.

    Parameters
    ----------
    ready : PreparedTouches
    fits : iterable of (KindOfMap, MapFit)
        To these touches.
    """
    order = np.arange(len(ready.touches))
    if drift_is_separable(ready.whole.groups, order):
        return None
    times = relative_times(order)[ready.used]
    found = (kind.drift_of_reference(fit, times) for kind, fit in fits)
    return next((drift for drift in found if drift is not None), None)


def without_drift(touches: Touches, ready: PreparedTouches, drift: ReferenceDrift) -> Touches:
    """Touches as they were latched, less the drift.

    Parameters
    ----------
    touches : Touches
    ready : PreparedTouches
        Of the same touches.
    drift : ReferenceDrift
    """
    moved = ready.whole.directions * _pretravel(ready, drift)[:, None]
    return replace(touches, positions=touches.positions + moved @ ready.rotation.T)


def _pretravel(ready: PreparedTouches, drift: ReferenceDrift) -> FloatArray:
    columns = _columns(ready, drift)
    return np.asarray(columns @ drift.value)


def _columns(ready: PreparedTouches, drift: ReferenceDrift) -> FloatArray:
    directions = ready.whole.directions[:, : len(drift.value)]
    return drift_columns(directions, np.arange(len(directions)), slows=drift.slows)


def with_drift(
    again: PreparedTouches, ready: PreparedTouches, touches: Touches, drift: ReferenceDrift
) -> PreparedTouches:
    """Prepared touches that name the drift which was subtracted before.

    Parameters
    ----------
    again : PreparedTouches
        Without the drift.
    ready : PreparedTouches
        With it.
    touches : Touches
        As they were latched.
    drift : ReferenceDrift
    """
    columns = _columns(ready, drift)
    variance = float(np.mean(np.sum((columns @ drift.covariance) * columns, axis=1)))
    moved = np.zeros(3)
    moved[: len(drift.value)] = -drift.value
    size = float(np.linalg.norm(moved)) / MICROMETRE
    said = (
        f"the reference drifted by {size:.1f} µm against the machine during the touches: this "
        "explains the differences of the directions better than another kind of probe. Repeats in "
        "a row do not show the drift; it follows because no six-seat probe fits the touches. A "
        f"{'drift that slows down' if drift.slows else 'steady drift'} was subtracted. Let the "
        "machine warm up, and touch in passes over all directions, which separate probe and drift"
    )
    effects = replace(
        again.effects,
        drift=moved,
        fixed_scatter=math.hypot(again.effects.fixed_scatter, math.sqrt(variance)),
        change=again.effects.change + _pretravel(ready, drift),
    )
    return replace(
        again,
        effects=effects,
        warnings=(*again.warnings, said),
        digests=touch_digests(touches.positions[again.used]),
    )
