"""What a study computes of one design: numbers, and values over directions."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pretravel.base import MICROMETRE, FloatArray, PretravelError, fibonacci_cap, grid
from pretravel.design.contact_stress import seat_stress, tip_stress
from pretravel.design.probing.simulation import Latch, PartSetup, simulate, travel_since_contact
from pretravel.design.studies.conditions import Calibration, Case, case_of
from pretravel.design.studies.definition import Directions, Level, Study
from pretravel.files import read_targets
from pretravel.maps import PretravelMap
from pretravel.measurement import apply, compare_corrections
from pretravel.prediction import Trigger, predict, probe_response, response_map
from pretravel.qualification import qualify
from pretravel.surface import parse_surface
from pretravel.touches import Touches


class OutputMeaning(NamedTuple):
    """A number that a study computes of each design."""

    unit: str
    text: str


def _spread(unit: str, what: str) -> dict[str, OutputMeaning]:
    key = what.replace(" ", "_")
    return {
        f"{key}_{which}": OutputMeaning(unit, f"{which} {what} over the directions")
        for which in ("least", "mean", "greatest")
    }


STUDIED_CORRECTIONS = (
    "uncorrected", "mean radius", "two axis radii", "four directions", "eight sectors",
    "eight sectors, resampled", "Woźniak",
)  # fmt: skip
"""Corrections of `compare_corrections` that a study reports."""


def _left_by(method: str) -> str:
    return "left_by_" + method.replace(",", "").replace(" ", "_").replace("ź", "z").lower()


MEANINGS: Mapping[str, Mapping[str, OutputMeaning]] = {
    "force": _spread("N", "trigger force"),
    "sensing-distance": _spread("um", "sensing distance"),
    "pretravel": {
        **_spread("um", "pretravel"),
        "pretravel_range": OutputMeaning("um", "largest minus smallest pretravel"),
        "pretravel_deviation": OutputMeaning("um", "root mean square about the mean pretravel"),
        "pretravel_lobes": OutputMeaning(
            "um", "amplitude of the third harmonic around, at the largest polar angle up to 90°"
        ),
    },
    "corrections": {
        _left_by(method): OutputMeaning("um", f"root mean square error after: {method}")
        for method in STUDIED_CORRECTIONS
    },
    "calibration": {
        "left_after_calibration": OutputMeaning(
            "um", "root mean square error of compensated touches, from the sphere's centre"
        ),
        "left_after_calibration_greatest": OutputMeaning("um", "largest of these errors"),
        "u_after_calibration": OutputMeaning("um", "root mean square of the given uncertainty"),
    },
    "touch": _spread("um", "travel since contact"),
    "stress": {"stress_greatest": OutputMeaning("MPa", "highest von Mises stress of any part")},
    "contact": {
        "seat_pressure_greatest": OutputMeaning("MPa", "highest Hertz pressure of a seat"),
        "tip_pressure_greatest": OutputMeaning("MPa", "highest Hertz pressure of tip and part"),
        "contact_shear_of_limit": OutputMeaning(
            "1", "highest shear of seats and tip, in that at which the softer material yields"
        ),
    },
}
"""The numbers of each output, by name."""


@dataclass(frozen=True, eq=False)
class Outcome:
    """What came of a design.

    Attributes
    ----------
    numbers : mapping of str to float
        See `MEANINGS`; none where the design failed.
    force, sensing_distance, pretravel : (p, a) float or None
        Over the directions: N, µm, µm. None: not kept.
    reason : str
        Why the design failed; empty: it did not.
    """

    numbers: Mapping[str, float]
    force: FloatArray | None = None
    sensing_distance: FloatArray | None = None
    pretravel: FloatArray | None = None
    reason: str = ""


def output_names(study: Study) -> dict[str, OutputMeaning]:
    """The numbers of a study, by name, in their order."""
    return {name: meaning for output in study.outputs for name, meaning in MEANINGS[output].items()}


def outcome_of(study: Study, levels: Mapping[str, Level]) -> Outcome:
    """Compute a design; a fault of it is its reason, not an error.

    Parameters
    ----------
    study : Study
    levels : mapping of key to value
        Of the factors.

    >>> from pretravel.design.studies.definition import load_study
    >>> study = load_study("preload-and-seats")
    >>> outcome_of(study, {"spring.preload_N": 5.91}).pretravel.shape  # polar, azimuth
    (9, 36)
    >>> outcome_of(study, {"spring.preload_N": -1.0}).reason
    'the spring preload is -1 N; it must be positive'
    """
    try:
        return computed(study, case_of(study, levels))
    except (PretravelError, ArithmeticError, np.linalg.LinAlgError) as error:
        return Outcome({}, reason=str(error) or type(error).__name__)


def computed(study: Study, case: Case) -> Outcome:
    """Compute the outputs of a case.

    Raises
    ------
    PretravelError
        A probe that never triggers in one of the directions; whatever the outputs refuse.
    """
    directions = study.directions
    d = grid(directions.polar, directions.azimuth)
    trigger = predict(case.probe, d, case.prediction.model, workpiece=case.part)
    shape = (len(directions.polar), len(directions.azimuth))
    force = trigger.force.reshape(shape)
    sensing_distance = trigger.sensing_distance.reshape(shape) / MICROMETRE
    pretravel = trigger.pretravel.reshape(shape) / MICROMETRE
    numbers: dict[str, float] = {}
    for output in study.outputs:
        found = _COMPUTE[output](case, trigger, directions)
        numbers |= {name: float(found[name]) for name in MEANINGS[output]}
    kept = (force, sensing_distance, pretravel) if study.keep_directions else (None, None, None)
    return Outcome(numbers, *kept)


def _three(what: str, values: FloatArray) -> dict[str, float]:
    return {
        f"{what}_least": float(values.min()),
        f"{what}_mean": float(values.mean()),
        f"{what}_greatest": float(values.max()),
    }


def _force(case: Case, trigger: Trigger, directions: Directions) -> dict[str, float]:
    del case
    return _three("trigger_force", trigger.force[directions.distinct])


def _sensing_distance(case: Case, trigger: Trigger, directions: Directions) -> dict[str, float]:
    del case
    return _three("sensing_distance", trigger.sensing_distance[directions.distinct] / MICROMETRE)


def _pretravel(case: Case, trigger: Trigger, directions: Directions) -> dict[str, float]:
    del case
    pretravel = trigger.pretravel / MICROMETRE
    distinct = pretravel[directions.distinct]
    return _three("pretravel", distinct) | {
        "pretravel_range": float(np.ptp(distinct)),
        "pretravel_deviation": float(np.std(distinct)),
        "pretravel_lobes": _lobes(
            pretravel.reshape(len(directions.polar), len(directions.azimuth)), directions
        ),
    }


def _lobes(pretravel: FloatArray, directions: Directions) -> float:
    """Amplitude of three lobes on a ring; not a number where the azimuths are not a whole circle.

    Least squares on an even circle is the discrete Fourier transform.
    """
    if not directions.has_lobes:
        return math.nan
    walls = [
        (polar, row) for row, polar in enumerate(directions.polar) if polar <= 0.5 * math.pi + 1e-9
    ]
    ring = pretravel[max(walls)[1]]
    return float(2.0 * abs(np.mean(ring * np.exp(-3j * np.asarray(directions.azimuth)))))


def _exact_map(case: Case, trigger: Trigger) -> PretravelMap:
    response = probe_response(case.probe, case.prediction.model, workpiece=case.part)
    return response_map(case.probe, response, trigger)


def _corrections(case: Case, trigger: Trigger, directions: Directions) -> dict[str, float]:
    del directions
    compared = compare_corrections(_exact_map(case, trigger))
    return {
        _left_by(row.method): row.rms / MICROMETRE for row in compared.rows if row.where == "all"
    }


_TESTED = 400
"""Directions in which a calibration is evaluated."""


def _calibration(case: Case, trigger: Trigger, directions: Directions) -> dict[str, float]:
    """The errors of touches without noise, compensated with the map of a qualification."""
    del trigger, directions
    wish = case.calibration
    n = fibonacci_cap(wish.touches)
    noise = np.random.default_rng(wish.seed).normal(0.0, wish.noise, len(n))
    made = qualify(
        _on_sphere(case, n, wish, noise),
        wish.diameter,
        tip_diameter=2.0 * case.probe.tip.radius,
        kind=wish.kind,
    )
    tested = fibonacci_cap(_TESTED)
    judged = apply(_on_sphere(case, tested, wish), made.pretravel_map, extrapolate=True)
    away = np.sum((judged.positions - made.center) * tested, axis=1) - 0.5 * wish.diameter
    return {
        "left_after_calibration": float(np.sqrt(np.mean(away**2))) / MICROMETRE,
        "left_after_calibration_greatest": float(np.abs(away).max()) / MICROMETRE,
        "u_after_calibration": float(np.sqrt(np.mean(judged.standard_uncertainty**2))) / MICROMETRE,
    }


def _on_sphere(
    case: Case, n: FloatArray, wish: Calibration, noise: FloatArray | float = 0.0
) -> Touches:
    """Touches of the predicted probe on the sphere, along its normals."""
    trigger = predict(case.probe, n, case.prediction.model, workpiece=case.part)
    reach = 0.5 * wish.diameter + case.probe.tip.radius - trigger.pretravel + noise
    return Touches(n * reach[:, None], n)


def _touch(case: Case, trigger: Trigger, directions: Directions) -> dict[str, float]:
    del trigger, directions
    wish = case.touch
    if not wish.targets:
        raise PretravelError(
            "the output touch needs [touch] with surface and targets (a file nx,ny,nz or "
            "x_mm,y_mm,z_mm in the folder of the study)"
        )
    surface = parse_surface(wish.surface)
    targets = read_targets(case.folder / wish.targets, surface, approach="normal")
    if targets.feed is not None and targets.feed != wish.feed:
        stated = "no feed_mm_min" if wish.feed is None else f"feed_mm_min = {wish.feed:g}"
        raise PretravelError(
            f"{wish.targets} has a feed of {targets.feed:g} mm/min, and [touch] has {stated}: give "
            "the same"
        )
    touches = simulate(
        case.probe,
        surface,
        targets,
        model=case.prediction.model,
        setup=PartSetup(material=case.part, friction=wish.friction),
        latch=Latch(wish.feed, wish.delay_ms * 1e-3),
    )
    return _three(
        "travel_since_contact", travel_since_contact(touches, case.probe.tip.radius) / MICROMETRE
    )


def _stress(case: Case, trigger: Trigger, directions: Directions) -> dict[str, float]:
    del directions
    from pretravel.design.fem.elastic_field import stress_by_direction
    from pretravel.design.fem.reduction_cache import reduced_model

    if case.prediction.model != "fem":
        raise PretravelError("the output stress needs the model fem")
    stresses = stress_by_direction(case.probe, trigger.directions, reduced_model(case.probe))
    return {"stress_greatest": float(stresses.highest.max())}


def _contact(case: Case, trigger: Trigger, directions: Directions) -> dict[str, float]:
    del directions
    seats = seat_stress(case.probe, trigger.reactions)
    tip = tip_stress(case.probe, trigger.force, case.part)
    return {
        "seat_pressure_greatest": float(seats.pressure.max()),
        "tip_pressure_greatest": float(tip.pressure.max()),
        "contact_shear_of_limit": float(
            np.max([seats.share_of_limit.max(), tip.share_of_limit.max()])
        ),
    }


_COMPUTE: Mapping[str, Callable[[Case, Trigger, Directions], dict[str, float]]] = {
    "force": _force,
    "sensing-distance": _sensing_distance,
    "pretravel": _pretravel,
    "corrections": _corrections,
    "calibration": _calibration,
    "touch": _touch,
    "stress": _stress,
    "contact": _contact,
}
