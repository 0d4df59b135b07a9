"""A slide on any surface: the spindle is fed step by step along the first normal."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pretravel.base import ConvergenceError, FloatArray, IntArray, PretravelError
from pretravel.design.probing.slide_history import SlideHistory, SlideStep, slide_history
from pretravel.design.probing.tip import LateralTip, PredictedTip
from pretravel.six_seats import curved_part_factor
from pretravel.surface import (
    TANGENCY,
    Contact,
    Lines,
    LocalGeometry,
    Surface,
    ball_center,
    solve_contact,
)

_SETTLED = 1e-12
"""Change of the force, relative to that at the trigger, at which its iteration ends."""


@dataclass(frozen=True, eq=False)
class FirstContact:
    """Where a slide starts.

    Attributes
    ----------
    surface : Surface
    uv : (1, 2) float
    local : LocalGeometry
        Of the surface there, one row.
    """

    surface: Surface
    uv: FloatArray
    local: LocalGeometry

    def feed_line(self, radius: float) -> Lines:
        """The way of the spindle, from the centre of a ball at first contact into the part."""
        return Lines(self.local.point + radius * self.local.normal, -self.local.normal)


def slide_with_rays(tip: LateralTip, first: FirstContact, step: float, steps: int) -> SlideHistory:
    """A slide by the sub-processes of section 3.4 of the thesis.

    In each, a ray leads from P along the projection of the last normal, and the ball is tangent
    with its centre on the ray.

    Parameters
    ----------
    tip : LateralTip
    first : FirstContact
    step : float
        Feed of each step. [mm]
    steps : int

    Raises
    ------
    ConvergenceError
        A step without a tangent ball.
    PretravelError
        A tip that leaves the surface over its edge.
    """
    surface, uv, before = first.surface, first.uv, first.local
    feed_line = first.feed_line(tip.radius)
    record, event = [], math.nan
    for k in range(1, steps + 1):
        spindle = _fed(feed_line, k * step)
        ray = tip.across(before.normal)
        contact = solve_contact(surface, uv, Lines(spindle, ray), ball_center(tip.radius))
        _check_contact(contact, surface, k)
        uv = contact.uv
        deflection = float(contact.length[0])
        at_trigger = tip.state(before.normal)
        triggered = deflection >= float(np.linalg.norm(at_trigger.deflection))
        if triggered and math.isnan(event):
            event = _trigger_feed(surface, uv, feed_line, tip.radius, at_trigger.deflection)
        force = math.nan if triggered else tip.force_at(before.normal, deflection)
        center = (spindle + deflection * ray)[0]
        record.append(
            SlideStep(k * step, deflection, spindle[0], center, contact.local, force, triggered)
        )
        before = contact.local
    return slide_history(tip.tip, record, first.local, event)


def slide_with_model(
    tip: PredictedTip, first: FirstContact, step: float, steps: int
) -> SlideHistory:
    """As `slide_with_rays`, with all displacements of the model, compression included.

    Parameters, result and errors are those of `slide_with_rays`.
    """
    surface, uv, before, force = first.surface, first.uv, first.local, 0.0
    feed_line = first.feed_line(tip.radius)
    factor = float(curved_part_factor(tip.radius, first.local.principal_curvatures)[0])
    record, event = [], math.nan
    for k in range(1, steps + 1):
        spindle = _fed(feed_line, k * step)
        contact_at = _ForcedContact(tip, surface, spindle, before.normal, factor)
        contact, force = contact_at.balanced(uv, force)
        _check_contact(contact, surface, k)
        uv = contact.uv
        center = (spindle + tip.deflection(before.normal, force))[0]
        deflection = float(np.linalg.norm(center - spindle[0]))
        at_trigger = tip.state(before.normal)
        triggered = force >= float(at_trigger.force[0])
        if triggered and math.isnan(event):
            height = tip.radius - factor * float(at_trigger.compression[0])
            event = _trigger_feed(surface, uv, feed_line, height, at_trigger.deflection)
        known = math.nan if triggered else force
        record.append(
            SlideStep(k * step, deflection, spindle[0], center, contact.local, known, triggered)
        )
        before = contact.local
    return slide_history(tip, record, first.local, event)


@dataclass(frozen=True, eq=False)
class _ForcedContact:
    """One step with the force along the normal of the step before."""

    tip: PredictedTip
    surface: Surface
    spindle: FloatArray
    direction: FloatArray
    factor: float

    def balanced(self, uv: FloatArray, force: float) -> tuple[Contact, float]:
        """The contact and the force at which the deflected, compressed ball is tangent.

        Newton's method for the force: the change of deflection and compression with a small
        additional force is a line, along which the contact is searched.
        """
        limit = float(self.tip.state(self.direction).force[0])
        normal, small = self.direction, 1e-6 * limit
        for _ in range(60):
            here = self.tip.deflection(self.direction, force)
            forces = np.array([force, force + small])
            compression, ahead = self.factor * self.tip.response.tip_approach(forces)
            along = self.tip.deflection(self.direction, force + small) - here
            along = along + (ahead - compression) * normal
            rate = float(np.linalg.norm(along)) / small
            contact = solve_contact(
                self.surface,
                uv,
                Lines(self.spindle + here, along / (rate * small)),
                ball_center(self.tip.radius - float(compression)),
            )
            # A force cannot be negative; at zero Hertz's law has a vertical tangent.
            new = max(force + float(contact.length[0]) / rate, 0.1 * force, 1e-9)
            if not math.isfinite(new):
                break
            change, force, uv, normal = abs(new - force), new, contact.uv, contact.local.normal
            if change <= _SETTLED * limit:
                break
        return contact, force


def _fed(feed_line: Lines, feed: float) -> FloatArray:
    assert feed_line.direction is not None  # see FirstContact.feed_line
    return np.asarray(feed_line.anchor + feed * feed_line.direction)


def _trigger_feed(
    surface: Surface, uv: FloatArray, feed_line: Lines, height: float, deflection: FloatArray
) -> float:
    """Feed at which a tip that is deflected as at the trigger is tangent."""

    def reach(_rows: IntArray, local: LocalGeometry) -> FloatArray:
        return np.asarray(height * local.normal - deflection)

    return float(solve_contact(surface, uv, feed_line, reach).length[0])


def _check_contact(contact: Contact, surface: Surface, step: int) -> None:
    if contact.residual[0] > TANGENCY or not np.isfinite(contact.residual[0]):
        raise ConvergenceError(
            f"step {step}: no place of the ball on its way is tangent to the surface "
            f"(an error of {contact.residual[0]:.2g} mm remains); the steps may be too large"
        )
    if not surface.inside(contact.uv)[0]:
        raise PretravelError(f"step {step}: the tip has left the surface over its edge")
