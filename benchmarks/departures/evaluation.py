"""One set: qualify as a user does, compensate a part, and compare with the truth."""

from __future__ import annotations

import re
import time
from dataclasses import dataclass, field, replace

import numpy as np

from pretravel import (
    PretravelError,
    PretravelMap,
    Qualification,
    Touches,
    apply,
    verify,
)
from pretravel import qualify as qualify_probe
from pretravel.laboratory.reversal import reversed_touches
from pretravel.measurement.points_summary import TouchSummary
from pretravel.qualification.prior_update import update_map
from pretravel.qualification.touch_plan import plan_touches

from .departure import Departure
from .machine import (
    DIAMETER,
    RING_DIAMETER,
    Reference,
    Run,
    latched,
    part_run,
    reference_run,
    with_gross_errors,
    with_usual_errors,
)
from .patterns import reachable, scattered
from .probes import MICROMETRE, turned
from .rows import ROWS
from .tripod import TIP_RADIUS, SimulatedProbe, Tripod

PART_TOUCHES = 200
SEED = 14
FALSE_ALARM_RATE = 0.05


@dataclass(frozen=True)
class Job:
    """What one process does at a time; two jobs of one `number` share probe and noise."""

    row: str
    number: int
    kind: str
    seed: int = SEED


@dataclass(frozen=True)
class Outcome:
    """Of one set. Errors in µm.

    `error` is left after the best translation of the part, `error_here` counts from the centre of
    the reference that the same qualification found; each is a root mean square along the normals
    of 200 points. The two χ² are the means of (error / u)² of both. `covered` is the share of
    points within 2 u of the truth, counted from that centre. `center_off` is the distance of that
    centre from the true one. χ² at the rods and between them is of steep faces within 20° of a
    rod's azimuth and of the middle between two. `false` and `found` count touches that are named
    as outliers. `alarm` says whether `verify` reports the unchanged probe as changed.
    """

    row: str
    number: int
    seconds: float
    refused: str = ""
    error: float = np.nan
    error_here: float = np.nan
    u: float = np.nan
    chi_squared: float = np.nan
    chi_squared_moved: float = np.nan
    covered: float = np.nan
    chi_squared_at_rods: float = np.nan
    chi_squared_between: float = np.nan
    center_off: float = np.nan
    alarm: bool | None = None
    false: int = 0
    found: int = 0
    gross: int = 0
    warnings: tuple[str, ...] = field(default_factory=tuple)

    @property
    def confidently_wrong(self) -> bool:
        """χ² is above 1.4 and nothing was said."""
        return self.chi_squared > 1.4 and not self.warnings


@dataclass(frozen=True, eq=False)
class Scene:
    """Touches as the user has them, and the truth."""

    departure: Departure
    probe: SimulatedProbe
    """That touches the part: the one that was qualified, or what has become of it."""
    reference: Reference
    reference_touches: Touches
    gross: np.ndarray
    later_touches: Touches
    part_touches: Touches
    surface: np.ndarray


def scene_of(job: Job) -> Scene:
    """The simulated set; probe, part and noise do not depend on the departure."""
    departure = ROWS[job.row]
    streams = np.random.SeedSequence([job.seed, job.number]).spawn(8)
    generators = [np.random.default_rng(stream) for stream in streams]
    for_probe, for_reference, for_part, noise, gross, later, ageing, usual = generators
    if departure.usual_errors:
        departure = with_usual_errors(departure, usual)
    probe = departure.make_probe(for_probe)
    reference = reference_run(departure, probe, for_reference)
    found = latched(reference.run, probe, departure, noise)
    found, rows = with_gross_errors(found, reference.run, departure.gross_errors, gross)
    reference_touches = _touches(
        found, reference.nominal_normals, reference.run.feeds, stated=departure.feed_stated[0]
    )
    today = probe if departure.check is None else departure.change(probe, ageing)
    normals = scattered(4 * PART_TOUCHES, for_part, level=departure.ring)
    count = PART_TOUCHES // departure.part_repeats
    normals = reachable(probe.stem, normals, least=0.2)[:count]
    run, surface = part_run(departure, normals, for_part)
    today = turned(today, departure.spindle[1] - departure.spindle[0])
    again = reference_run(departure, probe, later)
    of_reference, of_part = departure.feed_stated
    if departure.reversal:
        reference_touches = _means(reference_touches, reference.run, probe, departure, noise)
    at = latched(again.run, probe, departure, later)
    later_touches = _touches(at, again.nominal_normals, again.run.feeds, stated=of_reference)
    run, normals, surface = _repeated(run, normals, surface, departure.part_repeats)
    at = latched(run, _rubbing(today, departure), _on_part(departure), noise)
    part_touches = _touches(at, normals, run.feeds, stated=of_part)
    if departure.reversal:
        later_touches = _means(later_touches, again.run, probe, departure, later)
        part_touches = _means(part_touches, run, today, departure, noise)
    return Scene(
        departure,
        today,
        reference,
        _oriented(reference_touches, departure, 0),
        rows,
        _oriented(later_touches, departure, 0),
        _oriented(part_touches, departure, 1),
        surface,
    )


def _means(
    touches: Touches,
    run: Run,
    probe: SimulatedProbe,
    departure: Departure,
    generator: np.random.Generator,
) -> Touches:
    """Means of these touches and of the same ones with the spindle turned by 180°."""
    positions = latched(run, turned(probe, 180.0), departure, generator)
    both = touches.take(np.tile(np.arange(len(touches)), 2))
    return reversed_touches(
        replace(
            both,
            positions=np.vstack([touches.positions, positions]),
            spindle=np.repeat([0.0, np.pi], len(touches)),
        )
    ).means


def _repeated(
    run: Run, normals: np.ndarray, surface: np.ndarray, repeats: int
) -> tuple[Run, np.ndarray, np.ndarray]:
    """Each touch of a part several times."""
    if repeats == 1:
        return run, normals, surface
    rows = np.repeat(np.arange(len(normals)), repeats)
    names = ("centers", "normals", "approaches", "feeds")
    run = replace(run, **{name: getattr(run, name)[rows] for name in names})
    return run, normals[rows], surface[rows]


def _rubbing(probe: SimulatedProbe, departure: Departure) -> SimulatedProbe:
    if departure.part_friction is None:
        return probe
    assert isinstance(probe, Tripod)
    return replace(probe, friction=departure.part_friction)


def _on_part(departure: Departure) -> Departure:
    noise = departure.part_noise
    return departure if noise is None else replace(departure, noise=noise)


def _oriented(touches: Touches, departure: Departure, which: int) -> Touches:
    """The touches with the orientation of the spindle, where this user states it."""
    if not departure.spindle_stated[which]:
        return touches
    return replace(touches, spindle=np.full(len(touches), np.radians(departure.spindle[which])))


def _touches(at: np.ndarray, normals: np.ndarray, feeds: np.ndarray, *, stated: bool) -> Touches:
    return Touches(at, normals, feeds=feeds if stated else None)


@dataclass(frozen=True, eq=False)
class Qualified:
    """What a user has before the part is measured, and how far the centre is from the true one."""

    pretravel_map: PretravelMap
    shift: np.ndarray
    warnings: tuple[str, ...]
    named: frozenset[int] = frozenset()


def qualified(scene: Scene, job: Job) -> Qualified:
    """Qualify as a user does; where the departure says so, a few touches of today follow."""
    departure = scene.departure
    result = _qualification(scene, job)
    if departure.check is not None:
        return _checked(scene, job, result.pretravel_map, departure.check)
    return Qualified(
        result.pretravel_map,
        result.center - scene.reference.center,
        tuple(result.warnings),
        frozenset(row for outlier in result.outliers for row in outlier.rows),
    )


_LAST: dict[tuple[object, ...], Qualification] = {}


def _qualification(scene: Scene, job: Job) -> Qualification:
    """The last one again if nothing differs: rows with a check share the map before it."""
    departure, touches = scene.departure, scene.reference_touches
    columns = [value for value in vars(touches).values() if isinstance(value, np.ndarray)]
    settings = (departure.ring, job.kind, repr(departure.options))
    key = (*settings, *(value.tobytes() for value in columns))
    if key not in _LAST:
        _LAST.clear()
        _LAST[key] = qualify_probe(
            touches,
            RING_DIAMETER if departure.ring else DIAMETER,
            tip_diameter=2.0 * TIP_RADIUS,
            ring=departure.ring,
            kind=job.kind,
            **departure.options,
        )
    return _LAST[key]


def _checked(scene: Scene, job: Job, old_map: PretravelMap, count: int) -> Qualified:
    planned = plan_touches(old_map, count).normals
    generator = np.random.default_rng([job.seed, job.number, count])
    drift = scene.departure.check_drift
    departure = replace(scene.departure, directions=planned, repeats=1, drift=drift)
    today = reference_run(departure, scene.probe, generator)
    at = latched(today.run, scene.probe, departure, generator)
    stated = departure.feed_stated[0]
    touches = _touches(at, today.nominal_normals, today.run.feeds, stated=stated)
    result = update_map(touches, old_map, DIAMETER)
    return Qualified(result.pretravel_map, result.center - today.center, tuple(result.warnings))


def evaluated(job: Job) -> Outcome:
    """Qualify and compensate one set."""
    scene = scene_of(job)
    started = time.perf_counter()
    try:
        found = qualified(scene, job)
        seconds = time.perf_counter() - started
        u_friction = scene.departure.u_friction
        points = apply(scene.part_touches, found.pretravel_map, u_friction=u_friction)
    except PretravelError as error:
        return Outcome(job.row, job.number, time.perf_counter() - started, refused=str(error))
    summary = TouchSummary.of(scene.part_touches, points, found.pretravel_map)
    said = summary.warnings(found.pretravel_map)
    gross = set(scene.gross.tolist())
    errors = points.positions - scene.surface - found.shift
    return Outcome(
        job.row,
        job.number,
        seconds,
        false=len(found.named - gross),
        found=len(found.named & gross),
        gross=len(gross),
        warnings=(*found.warnings, *said),
        center_off=float(np.linalg.norm(found.shift)) / MICROMETRE,
        alarm=_alarm(scene, found.pretravel_map),
        **_scores(scene, errors, points.standard_uncertainty),
    )


def evaluated_together(jobs: tuple[Job, ...]) -> tuple[Outcome, ...]:
    """Several rows of one set, in one process."""
    return tuple(evaluated(job) for job in jobs)


def _scores(scene: Scene, errors: np.ndarray, u: np.ndarray) -> dict[str, float]:
    normals = scene.part_touches.normals
    along = np.sum(errors * normals, axis=1)
    moved = along - normals @ np.linalg.lstsq(normals, along, rcond=None)[0]
    squares = (along / u) ** 2
    steep = np.hypot(normals[:, 0], normals[:, 1]) > 0.7
    azimuth = np.arctan2(normals[:, 1], normals[:, 0])
    toward = np.max(np.cos(azimuth[:, None] - scene.probe.rods), axis=1)
    away = np.max(-np.cos(azimuth[:, None] - scene.probe.rods), axis=1)
    near = np.cos(np.radians(20.0))
    return {
        "error": float(np.sqrt(np.mean(moved**2))) / MICROMETRE,
        "error_here": float(np.sqrt(np.mean(along**2))) / MICROMETRE,
        "u": float(np.sqrt(np.mean(u**2))) / MICROMETRE,
        "chi_squared": float(np.mean(squares)),
        "chi_squared_moved": float(np.mean((moved / u) ** 2)),
        "covered": float(np.mean(squares <= 4.0)),
        "chi_squared_at_rods": _mean(squares[steep & (toward > near)]),
        "chi_squared_between": _mean(squares[steep & (away > near)]),
    }


def _mean(values: np.ndarray) -> float:
    return float(np.mean(values)) if len(values) else np.nan


def _alarm(scene: Scene, pretravel_map: PretravelMap) -> bool | None:
    """Whether `verify` says of the same probe that it has changed; None where it refuses."""
    if scene.departure.check is not None:
        return None
    ring = scene.departure.ring
    try:
        found = verify(
            scene.later_touches,
            pretravel_map,
            RING_DIAMETER if ring else DIAMETER,
            ring=ring,
            false_alarm_rate=FALSE_ALARM_RATE,
        )
    except PretravelError:
        return None
    return bool(found.changed)


def pattern_of(sentence: str) -> str:
    """A warning or refusal without its numbers, to count alike ones."""
    return re.sub(r"[-+]?\d[\d.,]*", "#", sentence)[:110]
