"""How often the laboratory's intervals contain the truth: separation, rig, drift over time.

python benchmarks/laboratory.py --sets 200
python benchmarks/laboratory.py --sets 20 --only rig

The simulators are numpy alone: readings, traces of a rig, days of a probe. Of the package each
row calls what a user calls. A row counts the quantities of all its sets: how many lie within the
interval of 95 % that is stated (the rig's: 95.45 %, U), and the mean of (error / u)², where u is
half of the interval over its normal quantile. That mean is 1 where u is right.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

if __package__ in (None, ""):  # run as a file
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.departures.probes import six_seats
from benchmarks.few_touches import FRESH, NOISE, Drifted, touched
from pretravel.base.errors import PretravelError
from pretravel.files.laboratory_statements import LaboratoryStatements
from pretravel.laboratory.certificate import calibration_certificate
from pretravel.laboratory.rig.budget import REN_BUDGET, repeatability_doubts
from pretravel.laboratory.rig.calibration import RigCalibration, calibrate_rig
from pretravel.laboratory.rig.events import rig_touch
from pretravel.laboratory.rig.trace import RigTrace
from pretravel.laboratory.separation.multi_step_readings import MultiStepReadings
from pretravel.laboratory.separation.separation import Method, Separation, separate
from pretravel.maps.provenance import QualificationSetup
from pretravel.qualification.drifts import (
    DailyQuantity,
    DriftOverTime,
    QuantityCourse,
    drift_over_time,
)
from pretravel.qualification.qualifying import qualify
from pretravel.qualification.terms_of_days import day_quantities, day_terms

SEED = 28
UM = 1e-3
NORMAL_95, EXPANDED = 1.959964, 2.0


@dataclass(frozen=True)
class Outcome:
    """Of one set: quantities within their intervals, their errors over u, and a doubt of its own.

    `ratio` is empty where an interval is not symmetric.
    """

    inside: np.ndarray
    ratio: np.ndarray
    warned: bool = False


def symmetric(error: np.ndarray, half: np.ndarray, factor: float, *, warned: bool) -> Outcome:
    """Of intervals value ± half."""
    error, half = np.atleast_1d(error), np.atleast_1d(half)
    return Outcome(np.abs(error) <= half, factor * error / half, warned)


# Separation of machine and probe


@dataclass(frozen=True)
class MultiStep:
    """A multi-step test of a three-lobed probe whose scatter follows its lobes."""

    count: int = 12
    heavy: bool = False
    """Student's t with 3 degrees of freedom, of the same variance."""
    missing: float = 0.0
    gross: int = 0
    """Readings that are off by 5 to 50 standard deviations."""

    @property
    def angle(self) -> np.ndarray:
        return 2.0 * np.pi * np.arange(self.count) / self.count

    @property
    def truth(self) -> np.ndarray:
        """The machine's errors, which add up to zero, then the probe's."""
        a = self.angle
        return UM * np.concatenate([np.sin(a) + 0.5 * np.cos(2.0 * a), 3.0 + 2.5 * np.cos(3.0 * a)])

    @property
    def pairs(self) -> np.ndarray:
        a = self.angle
        machine, probe = 0.10 + 0.06 * np.cos(a), 0.25 + 0.15 * np.cos(3.0 * a + 0.4)
        return UM**2 * (machine[:, None] + probe)

    def readings(self, rng: np.random.Generator) -> MultiStepReadings:
        size = self.count**2
        i, j = np.divmod(np.arange(size), self.count)
        noise = rng.standard_t(3.0, size) / np.sqrt(3.0) if self.heavy else rng.normal(size=size)
        off = rng.choice(size, self.gross, replace=False)
        noise[off] += rng.choice([-1.0, 1.0], self.gross) * rng.uniform(5.0, 50.0, self.gross)
        errors = self.truth[i] - self.truth[self.count + j] + np.sqrt(self.pairs[i, j]) * noise
        kept = rng.random(size) >= self.missing
        return MultiStepReadings(i[kept] + 1, j[kept] + 1, errors[kept])

    def separated(self, rng: np.random.Generator, method: Method) -> tuple[Separation, bool]:
        """With whether a doubt is stated."""
        found = separate(self.readings(rng), method=method)
        return found, any("heavier tails" in note for note in found.notes)

    def errors(self, rng: np.random.Generator, method: Method = "reml") -> Outcome:
        found, warned = self.separated(rng, method)
        low, high = found.error_interval().T
        value = np.concatenate([found.machine_error, found.probe_error])
        return symmetric(value - self.truth, 0.5 * (high - low), NORMAL_95, warned=warned)

    def variances(self, rng: np.random.Generator, method: Method = "reml") -> Outcome:
        found, warned = self.separated(rng, method)
        inside = []
        for i in range(self.count):
            for j in range(self.count):
                low, high = found.pair_interval(i + 1, j + 1)
                inside.append(low <= self.pairs[i, j] <= high)
        return Outcome(np.array(inside), np.empty(0), warned)


# The rig


@dataclass(frozen=True)
class RigSession:
    """Touches of a tripod on a rig: 0.05 mm/s, samples of 1 ms, noise of the ruler 5 nm."""

    directions: int
    repeats: int
    scatter: float = 0.06 * UM
    """Of the trigger, and half of it of the contact."""
    uneven: float = 0.0
    """One of the three lobes is higher by this share."""

    def pretravel(self, azimuth: np.ndarray) -> np.ndarray:
        """Tilting over two of three balls: 1 / cos, with kinks."""
        third = 2.0 * np.pi / 3.0
        lobe = 3.0 * UM / np.cos((azimuth + 0.2) % third - 0.5 * third)
        higher = (azimuth + 0.2) % (2.0 * np.pi) < third
        return np.asarray(lobe * (1.0 + self.uneven * higher) + 0.2 * UM * np.cos(azimuth - 1.0))

    def trace(self, name: str, pretravel: float, rng: np.random.Generator) -> RigTrace:
        r0 = 0.06 + 0.5 * self.scatter * rng.normal() + 1e-3 * rng.random()
        r1 = r0 + pretravel + self.scatter * rng.normal()
        top, back = r1 + 4.0 * UM, r0 + 0.3 * UM + 0.5 * self.scatter * rng.normal()
        there = top / 0.05
        time = np.arange(0.0, 2.0 * there + 0.4, 1e-3)
        rod = np.interp(time, [0.0, there, there + 0.2, 2.0 * there + 0.2], [0.0, top, top, 0.0])
        out = time < there + 0.1
        zero = np.where(out, r0, back)
        pressed = np.maximum(rod - zero, 0.0)
        laser = pressed + np.where(out, 0.0, back - r0) + rng.normal(0.0, 2e-6, len(time))
        trigger = ~((rod >= r1) & (pressed > 0.0))
        ruler = rod + rng.normal(0.0, 5e-6, len(time))
        return RigTrace(time, ruler, laser, pressed == 0.0, trigger, name)

    def calibrated(self, rng: np.random.Generator) -> tuple[RigCalibration, np.ndarray]:
        """The calibration, and the true pretravel in its directions."""
        degrees = 360.0 * np.arange(self.directions) / self.directions
        truth = self.pretravel(np.radians(degrees))
        touches = [
            rig_touch(self.trace(f"rig_{degree:05.1f}_{k + 1}", value, rng))
            for degree, value in zip(degrees, truth, strict=True)
            for k in range(self.repeats)
        ]
        found = calibrate_rig(touches)
        at = np.array([direction.azimuth for direction in found.directions])
        return found, self.pretravel(at)

    def of_repeats(self, rng: np.random.Generator) -> Outcome:
        """U of each direction, without the rig's own sources."""
        found, truth = self.calibrated(rng)
        value = np.array([d.pretravel for d in found.directions])
        half = np.array([d.expanded_pretravel for d in found.directions])
        warned = bool(repeatability_doubts(found, REN_BUDGET))
        return symmetric(value - truth, half, EXPANDED, warned=warned)

    def of_certificate(self, rng: np.random.Generator) -> Outcome:
        """U of each direction on the certificate; the rig's own error is that of Ren's budget."""
        found, truth = self.calibrated(rng)
        rig = [c for c in REN_BUDGET if not c.repeatability]
        common = sum(rng.normal(0.0, c.constant + c.per_length * 4.0 * UM) for c in rig)
        certified = calibration_certificate(found, REN_BUDGET, LaboratoryStatements()).directions
        value = np.array([d.performance.pretravel for d in certified])
        half = np.array([d.expanded for d in certified])
        warned = bool(repeatability_doubts(found, REN_BUDGET))
        return symmetric(value + common - truth, half, EXPANDED, warned=warned)


# Drift over time


@dataclass(frozen=True)
class Days:
    """A quantity on some days: a line, errors of the days, and a random walk. Unit: µm."""

    count: int
    slope: float = 0.08
    u: float = 0.1
    """Of a day, as it is stated."""
    scatter: float = 0.0
    """Beside it."""
    walk: float = 0.0
    """Standard deviation of the steps that add up, in a day."""
    stated: bool = True
    """Whether u is that of a day alone; of verifications it is not."""

    def drift(self, rng: np.random.Generator) -> DriftOverTime:
        times = np.arange(self.count)
        error = np.hypot(self.u, self.scatter) * rng.normal(size=self.count)
        walked = self.walk * np.concatenate([[0.0], np.cumsum(rng.normal(size=self.count - 1))])
        values, u = self.slope * times + walked + error, np.full(self.count, self.u)
        level = DailyQuantity("level", "µm", values, u, UM, known_u=self.stated)
        return drift_over_time(dates(self.count), [level], 2.0 * UM)

    def course(self, rng: np.random.Generator) -> QuantityCourse:
        found = self.drift(rng).last
        if not found:  # a jump that is none leaves too few days
            raise PretravelError("no course is stated")
        return found[0]

    def slopes(self, rng: np.random.Generator, *, if_walking: bool = False) -> Outcome:
        course = self.course(rng).course
        slope, u = (course.walking if if_walking else course.allowed).slope
        return symmetric(slope - self.slope, NORMAL_95 * u, NORMAL_95, warned=course.may_walk)

    def early(self, rng: np.random.Generator) -> Outcome:
        """Whether the true line passes the limit of 2 µm after the earliest date (95 %)."""
        due = self.course(rng).due
        true = 2.0 / self.slope
        return Outcome(np.array([due is not None and due.early <= true]), np.empty(0))


def dates(count: int) -> list[datetime]:
    return [datetime(2026, 3, 1) + timedelta(days=day) for day in range(count)]


def slopes_of_touches(rng: np.random.Generator) -> Outcome:
    """Ten days of 75 touches of a tripod whose level drifts by 0.05 µm a day, against a map."""
    probe = six_seats(rng)
    first = touched(Drifted(probe, 0.0), FRESH, rng)
    made = qualify(first, 25.0, tip_diameter=6.0, kind="harmonic").pretravel_map
    setup = QualificationSetup(25.0, 6.0)
    slope, count = 0.05, 10
    days = [
        day_terms(touched(Drifted(probe, slope * UM * day), FRESH, rng), made, setup)
        for day in range(count)
    ]
    found = drift_over_time(dates(count), day_quantities(days, made), 5.0 * NOISE)
    truth = {"level": slope, "scale": 0.0, "turn": 0.0}
    known = [one for one in found.last if one.quantity.name in truth]
    error = np.array([one.course.slope - truth[one.quantity.name] for one in known])
    u = np.array([one.course.u_slope for one in known])
    return symmetric(error, NORMAL_95 * u, NORMAL_95, warned=False)


SIX, TWELVE = MultiStep(6), MultiStep()
HEAVY = replace(TWELVE, heavy=True)
Simulate = Callable[[np.random.Generator], Outcome]
ROWS: Mapping[str, Mapping[str, Simulate]] = {
    "separate": {
        "6 × 6, normal: errors": SIX.errors,
        "6 × 6, normal: variances of pairs": SIX.variances,
        "6 × 6, two gross errors: errors": replace(SIX, gross=2).errors,
        "12 × 12, normal: errors": TWELVE.errors,
        "12 × 12, normal: variances of pairs": TWELVE.variances,
        "12 × 12, a fifth missing: variances of pairs": replace(TWELVE, missing=0.2).variances,
        "12 × 12, t₃: errors": HEAVY.errors,
        "12 × 12, t₃: variances of pairs": HEAVY.variances,
        "12 × 12, normal: variances of pairs, least-squares": (
            lambda rng: TWELVE.variances(rng, "least-squares")
        ),
        "12 × 12, t₃: variances of pairs, least-squares": (
            lambda rng: HEAVY.variances(rng, "least-squares")
        ),
    },
    "rig": {
        "12 directions five times: repeats alone": RigSession(12, 5).of_repeats,
        "12 directions five times: certificate": RigSession(12, 5).of_certificate,
        "one direction five times: repeats alone": RigSession(1, 5).of_repeats,
        "one direction five times: certificate": RigSession(1, 5).of_certificate,
        "four directions three times: repeats alone": RigSession(4, 3).of_repeats,
        "four directions three times: certificate": RigSession(4, 3).of_certificate,
        "24 directions once: scatter alone": RigSession(24, 1).of_repeats,
        "24 directions once: certificate": RigSession(24, 1).of_certificate,
        "24 directions once, a lobe 5 % higher: scatter alone": (
            RigSession(24, 1, uneven=0.05).of_repeats
        ),
    },
    "history": {
        **{f"line, {n} days, errors as stated: slope": Days(n).slopes for n in (5, 7, 10)},
        **{
            f"line, {n} days, three times the scatter: slope": Days(n, scatter=0.3).slopes
            for n in (5, 7, 10)
        },
        **{
            f"line, {n} days, u not of the day (verifications): slope": (
                Days(n, stated=False).slopes
            )
            for n in (5, 7, 10)
        },
        "line, 10 days: earliest date not after the true one": Days(10).early,
        "level, scale and turn, 10 days of 75 touches: slopes": slopes_of_touches,
        **{
            f"line and random walk, {n} days: slope, as stated": Days(n, walk=0.2).slopes
            for n in (5, 10)
        },
        **{
            f"line and random walk, {n} days: slope, if it walks": (
                lambda rng, n=n: Days(n, walk=0.2).slopes(rng, if_walking=True)
            )
            for n in (5, 10)
        },
    },
}


@dataclass(frozen=True)
class Line:
    """A row of the table, over all sets. Shares in percent."""

    title: str
    sets: int
    covered: float
    chi_squared: float
    refused: int
    warned: float

    def __str__(self) -> str:
        squares = "–" if np.isnan(self.chi_squared) else f"{self.chi_squared:.2f}"
        return (
            f"| {self.title} | {self.sets} | {self.covered:.1f} | {squares} | "
            f"{self.refused} | {self.warned:.0f} |"
        )


def line(title: str, simulate: Simulate, sets: int) -> Line:
    """A row. Set 7 of it has the generator of set 7 of every other row."""
    found: list[Outcome] = []
    for number in range(sets):
        try:
            found.append(simulate(np.random.default_rng([SEED, number])))
        except PretravelError:
            continue
    inside = np.concatenate([one.inside for one in found])
    ratio = np.concatenate([one.ratio for one in found])
    return Line(
        title,
        sets,
        100.0 * float(inside.mean()),
        float(np.mean(ratio**2)) if len(ratio) else np.nan,
        sets - len(found),
        100.0 * float(np.mean([one.warned for one in found])),
    )


def main(arguments: list[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sets", type=int, default=200)
    parser.add_argument("--only", choices=ROWS, help="the rows of this task")
    options = parser.parse_args(arguments)
    print("| row | sets | covered % | χ² | refused | a doubt stated % |")
    print("| --- | --- | --- | --- | --- | --- |")
    for task, rows in ROWS.items():
        if options.only in (None, task):
            for title, simulate in rows.items():
                print(line(f"`{task}`: {title}", simulate, options.sets), flush=True)


if __name__ == "__main__":
    main()
