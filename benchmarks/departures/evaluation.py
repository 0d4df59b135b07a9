"""One set: qualify as a user does, compensate a part, and compare with the truth."""

from __future__ import annotations

import re
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from pretravel import PretravelError, Touches, apply
from pretravel import qualify as qualify_probe
from pretravel.compensation.compensation import compensation_warnings

from .departure import Departure
from .machine import (
    DIAMETER,
    RING_DIAMETER,
    Reference,
    latched,
    part_run,
    reference_run,
    with_gross_errors,
)
from .patterns import about, scattered
from .probes import MICROMETRE
from .rows import ROWS
from .tripod import TIP_RADIUS

PART_TOUCHES = 200
SEED = 14


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
    of 200 points. The two χ² are the means of (error / u)² of both. `false` and `found` count
    touches that are named as outliers.
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
    reference: Reference
    reference_touches: Touches
    gross: np.ndarray
    part_touches: Touches
    surface: np.ndarray


def scene_of(job: Job) -> Scene:
    """The simulated set; probe, part and noise do not depend on the departure."""
    departure = ROWS[job.row]
    streams = np.random.SeedSequence([job.seed, job.number]).spawn(5)
    for_probe, for_reference, for_part, noise, gross = map(np.random.default_rng, streams)
    probe = departure.make_probe(for_probe)
    reference = reference_run(departure, probe, for_reference)
    found = latched(reference.run, probe, departure, noise)
    found, rows = with_gross_errors(found, reference.run, departure.gross_errors, gross)
    normals = scattered(PART_TOUCHES, for_part, level=departure.ring)
    run, surface = part_run(departure, about(probe.stem, normals), for_part)
    return Scene(
        departure,
        reference,
        _touches(found, reference.nominal_normals, departure.feed, departure.feed_stated[0]),
        rows,
        _touches(
            latched(run, probe, departure, noise),
            run.normals,
            departure.part_feed,
            departure.feed_stated[1],
        ),
        surface,
    )


def _touches(at: np.ndarray, normals: np.ndarray, feed: float, stated: bool) -> Touches:
    return Touches(at, normals, feeds=np.full(len(at), feed) if stated else None)


def evaluated(job: Job) -> Outcome:
    """Qualify and compensate one set."""
    scene = scene_of(job)
    departure = scene.departure
    started = time.perf_counter()
    try:
        result = qualify_probe(
            scene.reference_touches,
            RING_DIAMETER if departure.ring else DIAMETER,
            tip_diameter=2.0 * TIP_RADIUS,
            ring=departure.ring,
            kind=job.kind,
            **departure.options,
        )
        seconds = time.perf_counter() - started
        points = apply(scene.part_touches, result.pretravel_map)
    except PretravelError as error:
        return Outcome(job.row, job.number, time.perf_counter() - started, refused=str(error))
    said = (
        *result.warnings,
        *compensation_warnings(scene.part_touches, points, result.pretravel_map),
    )
    named = {row for outlier in result.outliers for row in outlier.rows}
    shift = result.center - scene.reference.center
    return Outcome(
        job.row,
        job.number,
        seconds,
        false=len(named - set(scene.gross.tolist())),
        found=len(named & set(scene.gross.tolist())),
        gross=len(scene.gross),
        warnings=said,
        **_scores(points.positions - scene.surface - shift, points.normals, points),
    )


def _scores(errors: np.ndarray, normals: np.ndarray, points: Any) -> dict[str, float]:
    along = np.sum(errors * normals, axis=1)
    u = points.standard_uncertainty
    moved = along - normals @ np.linalg.lstsq(normals, along, rcond=None)[0]
    return {
        "error": float(np.sqrt(np.mean(moved**2))) / MICROMETRE,
        "error_here": float(np.sqrt(np.mean(along**2))) / MICROMETRE,
        "u": float(np.sqrt(np.mean(u**2))) / MICROMETRE,
        "chi_squared": float(np.mean((along / u) ** 2)),
        "chi_squared_moved": float(np.mean((moved / u) ** 2)),
    }


def pattern_of(sentence: str) -> str:
    """A warning or refusal without its numbers, to count alike ones."""
    return re.sub(r"[-+]?\d[\d.,]*", "#", sentence)[:110]
