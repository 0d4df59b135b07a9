"""Qualification: touches on a reference sphere or ring in, a map of the probe out.

The steps, in the order of the statistics: what was touched (`observe`); the signal delay (`delay`);
what the machine added (`machine_effects`); gross errors (`outliers`); the fit of each kind of map
(`maps.kinds`); their weights (`kind_weights`); map, centre and their uncertainties; warnings
(`map_warnings`).
"""

from __future__ import annotations

import logging
import math
from collections.abc import Collection
from dataclasses import replace

import numpy as np
import numpy.typing as npt
from threadpoolctl import threadpool_limits

from pretravel.base import FloatArray, PretravelError, frozen, probe_rotation
from pretravel.maps import (
    AUTO,
    FEWEST_OF_SIX_SEATS,
    KINDS,
    AveragedBasis,
    CenteredFit,
    HarmonicMapFit,
    KindOfMap,
    MachineTerms,
    MapFit,
    MapLike,
    Origin,
    PretravelMap,
    Provenance,
    QualificationSetup,
    Scatter,
    TouchedMeans,
    as_map,
    fit_harmonic,
    hidden_lobes,
    kind_named,
    of_means,
    one_word,
    orientation_of,
)
from pretravel.qualification.delay import separated_delay, several_feeds, travel_per_second
from pretravel.qualification.impossible_touches import refuse_hidden_lobes
from pretravel.qualification.kind_weights import averaged, compare_kinds
from pretravel.qualification.machine_effects import without_machine
from pretravel.qualification.map_warnings import (
    copy_warnings,
    height_warnings,
    inclined_ring_warnings,
    map_warnings,
    repeat_warnings,
)
from pretravel.qualification.observe import observe, observed_again
from pretravel.qualification.outliers import Outlier, gross_errors
from pretravel.qualification.own_touches import touch_digests
from pretravel.qualification.qualification import PreparedTouches, Qualification
from pretravel.qualification.slow_drift import drift_of_fits, with_drift, without_drift
from pretravel.touches import (
    Touches,
    TouchesLike,
    as_touches,
    copied_readings,
)
from pretravel.uncertainty import Covariance

_LOG = logging.getLogger(__name__)


def qualify(  # noqa: PLR0913  # the setup by its keywords
    touches: TouchesLike,
    diameter: float,
    *,
    kind: str | KindOfMap = AUTO,
    tip_diameter: float | None = QualificationSetup.tip_diameter,
    ring: bool = QualificationSetup.ring,
    u_diameter: float | None = QualificationSetup.u_diameter,
    u_temperature: float = QualificationSetup.u_temperature,
    sphere_form: float = QualificationSetup.sphere_form,
    axial_pretravel: float | None = QualificationSetup.axial_pretravel,
    axis: npt.ArrayLike = QualificationSetup.axis,
    search_outliers: bool = QualificationSetup.search_outliers,
) -> Qualification:
    """Qualify a probe on a reference sphere or ring, with any kind of map.

    Every touch determines how far the latched point is from the centre of the reference:
    ``|P - c| = R + r - pretravel`` on a sphere, ``R - r + pretravel`` in a ring. A shift of the
    centre looks like a first harmonic of the map, and touches on a sphere cannot separate the two.
    A convention decides. Across the axis a harmonic map has no first harmonic, as an even tripod
    has none (kinds mean and sectors refer to the least-squares centre). Along the axis, where a
    least-squares centre lies 5 to 15 um off, because pole and equator differ so much, the map has
    the pretravel `QualificationSetup.axial_pretravel` at the pole. An error of the convention
    shifts map, centre and parts as a whole. Distances between points, and from the reference,
    remain right, and the uncertainties are those of these distances.

    Touches at several feeds separate the signal delay: delay travel grows with the feed,
    pretravel does not. The map is then that of the probe at rest, and contains the delay.

    Parameters
    ----------
    touches : Touches, str, Path or (n, 6) float
        In the order in which they were made: touches, their file, or x, y, z of the tip centres in
        mm with the outward normals. Repeats of a direction are recognised by their normals.
    diameter : float
        Calibrated diameter of the sphere or ring. [mm]
    kind : str or KindOfMap
        auto: the average of the kinds that predict directions left out of their fits; or one kind:
        mean, sectors, wozniak, harmonic, physical.
    tip_diameter, ring, u_diameter, u_temperature, sphere_form, axial_pretravel, axis, \
search_outliers
        See `QualificationSetup`. Lengths are in mm, also small ones.

    Returns
    -------
    Qualification

    Raises
    ------
    PretravelError
        Too few touches, all in one plane, diameters or units that do not fit, normals that do not
        fit, an impossible signal delay, sectors without a touch; an unknown kind.

    References
    ----------
    The sphere as reference: Woźniak, section 4; Rodrigues 2021, equation 2.1.

    >>> from pretravel.base.directions import sphere_pattern_25
    >>> n = sphere_pattern_25()
    >>> touches = Touches(n * (12.5 + 3.0 - 0.010) + [100.0, 0.0, 0.0], n)
    >>> result = qualify(touches, 25.0, tip_diameter=6.0, kind="mean")
    >>> abs(result.center.round(9)).tolist(), round(result.effective_radius, 9)
    ([100.0, 0.0, 0.0], 2.99)
    """
    setup = QualificationSetup(
        diameter,
        tip_diameter,
        ring,
        u_diameter,
        u_temperature,
        sphere_form,
        axial_pretravel,
        axis,  # type: ignore[arg-type]  # any array
        search_outliers,
    )
    touches = as_touches(touches, reference_diameter=setup.diameter, ring=setup.ring)
    return qualified(touches, setup, kind)


def qualified(
    touches: Touches,
    setup: QualificationSetup,
    kind: str | KindOfMap | Collection[KindOfMap] = AUTO,
) -> Qualification:
    """As `qualify`, with reference, tip and conventions as one value.

    Parameters
    ----------
    touches : Touches
    setup : QualificationSetup
    kind : str, KindOfMap or several KindOfMap
        Several: their average.

    Raises
    ------
    PretravelError
        As `qualify`; no kind of map fits.
    """
    # For matrices of this size threads gain nothing, and cost much on a busy machine.
    with threadpool_limits(1, user_api="blas"):
        if isinstance(kind, str):
            kind = KINDS.values() if kind == AUTO else kind_named(kind)
        alone = kind if isinstance(kind, KindOfMap) else None
        compared = _that_follow(touches, (kind,) if isinstance(kind, KindOfMap) else kind)
        fine = (each for each in compared if each.prior_weight > 1.0)
        confirm = alone or next(fine, None)
        ready = prepare(touches, setup, confirm)
        made = _made(ready, compared)
        fits = [(kind, each.fit) for kind, each in made if isinstance(each, Qualification)]
        drift = drift_of_fits(ready, fits)
        if drift is not None:
            still = prepare(without_drift(touches, ready, drift), setup, confirm)
            ready = with_drift(still, ready, touches, drift)
            made = _made(ready, compared)
        if alone is None:
            return _on_average(ready, made)
        found = made[0][1]
        if isinstance(found, PretravelError):
            raise found
        return _warned(ready, found)


def _that_follow(touches: Touches, kinds: Collection[KindOfMap]) -> Collection[KindOfMap]:
    """Of kinds of map those that can follow the touches.

    Raises
    ------
    PretravelError
        Means at two orientations of the spindle, and no kind without lobes of odd order.
    """
    if not of_means(touches):
        return kinds
    found = [kind for kind in kinds if kind.takes_means]
    if not found:
        words = ", ".join(kind.name for kind in kinds)
        raise PretravelError(
            "the touches are means at two orientations of the spindle, in which lobes of odd order "
            f"cancel, and {words} is a model of single touches: choose kind harmonic",
            inputs=("kind",),
        )
    return found


def with_machine(
    found: Qualification, touches: Touches, machine: MachineTerms | None, *, outside: bool
) -> Qualification:
    """A qualification whose map contains the errors of the machine that were subtracted before.

    Parameters
    ----------
    found : Qualification
        Of touches without these errors.
    touches : Touches
        As the machine reported them.
    machine : MachineTerms or None
    outside : bool
        The reference was touched from outside: a sphere or a pin, not a ring.
    """
    if machine is None:
        return found
    made, setup = found.pretravel_map, found.setup
    reach = made.tip_radius + (0.5 if outside else -0.5) * setup.diameter
    digests = touch_digests(touches.positions[found.used])
    made = replace(
        made,
        machine=replace(machine, reach=reach),
        provenance=replace(made.provenance, touch_digests=digests),
    )
    return replace(found, pretravel_map=made)


def prepare(
    touches: Touches, setup: QualificationSetup, confirm: KindOfMap | None = None
) -> PreparedTouches:
    """Observe touches about the centre of the reference, and name those that are wrong.

    Parameters
    ----------
    touches : Touches
        In the order in which they were made.
    setup : QualificationSetup
    confirm : KindOfMap, optional
        Kind of map that must contradict a direction too before it is left out; a harmonic map
        alone can take a kink of the probe for an error.

    Raises
    ------
    PretravelError
        As `pretravel.qualification.observe.observe`; an impossible signal delay; several
        orientations of the spindle.

    >>> from pretravel.base.directions import sphere_pattern_25
    >>> n = sphere_pattern_25()
    >>> ready = prepare(Touches(n * 15.49, n), QualificationSetup(25.0, tip_diameter=6.0))
    >>> bool(ready.used.all()), ready.delay is None
    (True, True)
    """
    touches.refuse_several(one_reference=True)
    orientation_of(touches)  # refuses several
    latched, rotation = touches.positions, probe_rotation(setup.axis)
    # What was touched: directions, their repeats, the centre of the reference.
    _LOG.info("centre of the reference")
    whole = observe(touches, setup, rotation)
    refuse_hidden_lobes(whole)
    delay, notes = separated_delay(touches, whole, rotation)
    if delay is not None:
        touches = touches.at_rest(delay.delay)
        whole = observed_again(touches, whole, setup, rotation)
        whole = replace(whole, u_constant=0.5 * setup.u_reference_diameter)
    # What the machine added: the step of the latch, drift, hysteresis.
    _LOG.info("drift and hysteresis")
    touches, effects = without_machine(touches, whole, setup, rotation, latched=latched)
    if effects.change.any():
        whole = observed_again(touches, whole, setup, rotation)
    whole = replace(whole, step_scatter=effects.step_scatter)
    # What is gross.
    used = np.ones(len(touches), dtype=bool)
    outliers: tuple[Outlier, ...] = ()
    detail: HarmonicMapFit | None = None
    if setup.search_outliers:
        _LOG.info("search of gross errors")
        scatter = {"step": effects.step, "fixed_scatter": effects.fixed_scatter}
        outliers, detail = gross_errors(whole, touches.where, confirm, **scatter)
        used[[row for outlier in outliers if outlier.left_out for row in outlier.rows]] = False
    observation = whole
    if not used.all():
        again = observe(touches.take(used), setup, rotation)
        whole = replace(whole, center=again.center, tip_radius=again.tip_radius)
        observation = whole.take(used)
    return PreparedTouches(
        touches=touches,
        setup=setup,
        rotation=rotation,
        whole=whole,
        observation=observation,
        used=used,
        outliers=outliers,
        detail=detail,
        effects=effects,
        delay=delay,
        warnings=(*notes, *effects.warnings, *inclined_ring_warnings(latched @ rotation, setup)),
        digests=touch_digests(latched[used]),
    )


_Made = list[tuple[KindOfMap, Qualification | PretravelError]]


def _made(ready: PreparedTouches, compared: Collection[KindOfMap]) -> _Made:
    """A map of every kind, or why there is none."""
    made: _Made = []
    for kind in compared:
        try:
            made.append((kind, _mapped(ready, kind)))
        except PretravelError as error:
            made.append((kind, error))
    return made


def _on_average(ready: PreparedTouches, every: _Made) -> Qualification:
    """The average of the kinds that predict left-out directions."""
    made = {kind.name: each for kind, each in every if isinstance(each, Qualification)}
    fits: dict[str, tuple[KindOfMap, MapFit | PretravelError]] = {
        kind.name: (kind, each.fit if isinstance(each, Qualification) else each)
        for kind, each in every
    }
    scores = tuple(compare_kinds(ready, fits))
    parts = [score for score in scores if score.weight > 0.0]
    if not parts:
        raise PretravelError(f"no kind of map fits these touches: {scores[0].problem}")
    best, *others = (made[part.kind] for part in parts)
    return replace(averaged([_warned(ready, best), *others], parts), scores=scores)


def _mapped(ready: PreparedTouches, kind: KindOfMap) -> Qualification:
    """The map of one kind, its centre, their uncertainties, and what to know of them."""
    _LOG.info("%s map", kind.name)
    setup, rotation = ready.setup, ready.rotation
    fit, centered = _fitted(ready, kind)
    repeatability = _repeatability(ready, fit)
    delay_effect, moved, longer = _effect_of_delay(ready, kind, fit, centered)
    by_outliers = _effect_of_outliers(ready, kind, fit, centered)
    pretravel_map = _map(ready, kind, fit, centered, repeatability, delay_effect)
    about = replace(ready.whole, center=centered.center)
    observed = about.values + (pretravel_map.tip_radius - fit.observation.tip_radius)
    modelled = fit.basis.values_in_blocks(about.directions, pretravel_map.coefficients)
    axes = rotation[:, : ready.observation.axes]
    later = rotation @ moved
    in_common = ready.effects.in_common
    of_center = axes @ centered.center_covariance @ axes.T + np.outer(later, later)
    of_center = frozen(of_center + in_common**2 * np.eye(3))
    copies = copied_readings(
        ready.touches.positions[ready.used], ready.observation.groups, ready.effects.step
    )
    made = pretravel_map.provenance.with_center_covariance(rotation.T @ of_center @ rotation)
    made = replace(made, center=tuple((rotation @ centered.center).tolist()))
    pretravel_map = replace(pretravel_map, provenance=made)
    return Qualification(
        pretravel_map=pretravel_map,
        setup=setup,
        kind=kind,
        center=frozen(rotation @ centered.center),
        center_covariance=of_center,
        own_center_covariance=of_center,
        effective_radius=fit.observation.tip_radius - fit.mean,
        u_effective_radius=math.hypot(
            fit.u_mean, 0.5 * setup.u_reference_diameter, longer, in_common
        ),
        residuals=frozen(observed - modelled),
        degrees_of_freedom=fit.dof,
        repeatability=repeatability.deviation,
        repeatability_dof=repeatability.dof,
        observed=frozen(observed),
        contact_normals=frozen(about.directions @ rotation.T),
        groups=ready.whole.groups,
        used=ready.used,
        outliers=ready.outliers,
        effect_of_outliers=by_outliers,
        effects=ready.effects,
        delay=ready.delay,
        fit=fit,
        copies=copies,
        warnings=(),
    )


def _warned(ready: PreparedTouches, found: Qualification) -> Qualification:
    """With its warnings, which only the best kind needs."""
    made, kind, fit, observation = found.pretravel_map, found.kind, found.fit, ready.observation
    repeatability = Scatter(found.repeatability, found.repeatability_dof)
    u_height = math.sqrt(_centered(ready, kind, fit).center_covariance[-1, -1])
    return replace(
        found,
        warnings=(
            *ready.warnings,
            *copy_warnings(found.copies, int(np.sum(ready.used))),
            *repeat_warnings(repeatability, repeated=observation.repeats.dof > 0.0),
            *kind.warnings(fit, found.repeatability),
            *map_warnings(made, observation, tip_is_fitted=fit.tip_radius is not None),
            *height_warnings(u_height, observation),
        ),
    )


def _fitted(ready: PreparedTouches, kind: KindOfMap) -> tuple[MapFit, CenteredFit]:
    """The fit, and its map and centre in the convention of the kind."""
    observation = ready.observation
    if not kind.fits_harmonics or ready.detail is None:
        fit = kind.fit(observation, observation.repeats)
    else:
        fit = kind.fit_near(ready.detail, observation, observation.repeats)
    centered = _centered(ready, kind, fit)
    if not kind.fits_harmonics:
        return fit, centered
    # Once more with the contact normals about the centre that was found.
    again = kind.refit(fit, replace(observation, center=centered.center))
    return (fit, centered) if again is None else (again, _centered(ready, kind, again))


def _centered(ready: PreparedTouches, kind: KindOfMap, fit: MapFit) -> CenteredFit:
    centered = kind.centered(fit, ready.setup.axial_pretravel)
    if fit.contains_hidden:
        return centered
    lobes = hidden_lobes(fit.observation)
    if lobes is None or fit.observation.direction_count < FEWEST_OF_SIX_SEATS:
        return centered
    axes = len(lobes.shift)
    change = np.linalg.lstsq(fit.basis.design(lobes.between), lobes.pretravel)[0]
    of_center = centered.center_covariance.copy()
    of_center[:axes, :axes] += lobes.shift @ lobes.shift.T
    return replace(
        centered,
        covariance=Covariance.full(centered.covariance.matrix + change @ change.T),
        center_covariance=of_center,
    )


def _repeatability(ready: PreparedTouches, fit: MapFit) -> Scatter:
    if fit.noise_is_repeatability:
        return Scatter(fit.noise, fit.dof)
    if ready.observation.repeats.dof > 0.0:
        return ready.observation.repeats
    # A coarse kind contains the part that it does not represent in its residuals.
    fine = fit if isinstance(fit, HarmonicMapFit) else ready.detail
    fine = fine or fit_harmonic(fit.observation)
    return Scatter(fine.noise, max(fine.dof, 1.0))


def _level(fit: MapFit, centered: CenteredFit) -> tuple[FloatArray, float, str]:
    """Coefficients, tip radius and gauge: by the fit; by the tip's diameter; else of mean zero."""
    radius = fit.observation.tip_radius
    if fit.tip_radius is not None:
        return centered.coefficients, fit.tip_radius, centered.gauge
    if fit.observation.tip_known:
        return centered.coefficients, radius, centered.gauge
    constant = fit.basis.constant
    assert constant is not None  # fitted maps contain one
    gauge = centered.gauge + " and to its mean, since no tip diameter was given"
    return centered.coefficients - fit.mean * constant, radius - fit.mean, gauge


def _effect_of_delay(
    ready: PreparedTouches, kind: KindOfMap, fit: MapFit, centered: CenteredFit
) -> tuple[FloatArray | None, FloatArray, float]:
    """Changes of coefficients, centre and mean for a delay longer by its u. [mm]"""
    if ready.delay is None:
        return None, np.zeros(3), 0.0
    u_delay, touches = ready.delay.u_delay, ready.touches.take(ready.used)
    later = touches.at_rest(u_delay).positions @ ready.rotation
    again = kind.refit(fit, replace(fit.observation, positions=later))
    if again is None:
        mean = -u_delay * float(np.mean(travel_per_second(touches)))
        constant = fit.basis.constant
        assert constant is not None  # fitted maps contain one
        return mean * constant, np.zeros(3), mean
    shifted = _centered(ready, kind, again)
    return (
        shifted.coefficients - centered.coefficients,
        shifted.center - centered.center,
        again.mean - fit.mean,
    )


def _effect_of_outliers(
    ready: PreparedTouches, kind: KindOfMap, fit: MapFit, centered: CenteredFit
) -> float:
    """Largest change of the map if nothing was left out. [mm]"""
    if ready.used.all():
        return 0.0
    try:
        other = kind.fit_near(fit, ready.whole, ready.whole.repeats)
    except PretravelError:
        return math.inf
    directions = fit.observation.group_directions
    moved = _centered(ready, kind, other)
    change = other.basis.value(directions, moved.coefficients)
    change = change - fit.basis.value(directions, centered.coefficients)
    shift = (moved.center - centered.center)[: fit.observation.axes]
    return float(np.abs(change - directions[:, : len(shift)] @ shift).max())


def _map(
    ready: PreparedTouches,
    kind: KindOfMap,
    fit: MapFit,
    centered: CenteredFit,
    repeatability: Scatter,
    delay_effect: FloatArray | None,
) -> PretravelMap:
    setup, touches, delay, effects = ready.setup, ready.touches, ready.delay, ready.effects
    coefficients, tip_radius, gauge = _level(fit, centered)
    feed = None if touches.feeds is None else float(np.mean(touches.feeds))
    return PretravelMap(
        basis=fit.basis,
        coefficients=coefficients,
        covariance=centered.covariance,
        support=fit.observation.support,
        tip_radius=tip_radius,
        # Both are the same in all directions.
        u_tip_radius=math.hypot(0.5 * setup.u_reference_diameter, effects.in_common),
        repeatability=repeatability.deviation,
        repeatability_dof=repeatability.dof,
        fixed_scatter=math.hypot(
            max(fit.fixed_scatter, effects.step_scatter), effects.fixed_scatter
        ),
        rotation=ready.rotation,
        feed=feed if delay is None else 0.0,
        delay=None if delay is None else delay.delay,
        u_delay=0.0 if delay is None else delay.u_delay,
        delay_effect=delay_effect,
        touched=TouchedMeans.of(fit.observation, centered.center, tip_radius),
        provenance=Provenance(
            Origin.QUALIFIED,
            f"qualified on a {setup.reference} of {setup.diameter:.9g} mm",
            touches=f"{int(ready.used.sum())} touches in {fit.observation.direction_count} "
            "directions" + (f", from {touches.source}" if touches.source else ""),
            touches_file=touches.source or "",
            reading=touches.reading,
            touch_digests=ready.digests,
            spindle_deg=orientation_of(touches),
            tip=one_word(touches, "tip"),
            orientation=one_word(touches, "orientation"),
            gauge=f"pretravel is relative to {gauge}",
            level_known=setup.tip_diameter is not None,
            setup=setup,
            kind_settings=dict(kind.settings()),
        ),
    )


def qualify_like(
    touches: TouchesLike, earlier: MapLike, diameter: float, *, ring: bool = False
) -> Qualification:
    """Qualify again, with the kind and the setup of an earlier map.

    Parameters
    ----------
    touches : Touches, str, Path or (n, 6) float
        New ones on the reference.
    earlier : PretravelMap, Qualification, str or Path
        Of a qualification.
    diameter : float
        Of the reference. [mm]
    ring : bool
        The reference is a ring.

    Returns
    -------
    Qualification

    Raises
    ------
    PretravelError
        As `qualify`; a map with a signal delay and touches that do not determine one.

    Notes
    -----
    Maps of earlier versions do not contain their setup. What they contain is used: tip, axis and
    the uncertainty of the radius, which is half that of the reference's diameter.
    """
    earlier = as_map(earlier)
    touches = as_touches(touches, reference_diameter=diameter, ring=ring)
    if earlier.delay is not None and not several_feeds(touches):
        raise PretravelError(
            "the old map contains the signal delay, which touches at one feed do not determine; "
            "touch the reference at two feeds"
        )
    made = earlier.provenance
    setup = made.setup or QualificationSetup(
        diameter,
        tip_diameter=2.0 * earlier.tip_radius,
        u_diameter=2.0 * earlier.u_tip_radius,
        u_temperature=0.0,
        sphere_form=0.0,
        axis=tuple(earlier.rotation[:, 2]),
    )
    setup = replace(setup, diameter=diameter, ring=ring)
    machine = earlier.machine
    true = touches if machine is None else machine.taken_off(touches)
    if earlier.kind == AveragedBasis.kind:
        found = qualified(true, setup)
    else:
        found = qualified(true, setup, kind_named(earlier.kind, **made.kind_settings))
    return with_machine(found, touches, machine, outside=not ring)
