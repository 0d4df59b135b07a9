"""Form, size and distances of features of a part: is what `measure` states so?

python benchmarks/features.py --sets 200 --kind auto

Probes, machine and noise are those of `benchmarks/departures`, with physics of their own: a random
six-seat probe is qualified by 25 directions three times, with 0.3 µm of noise, on a sphere whose
diameter is wrong by a draw of its stated uncertainty (0.1 µm). Then bores (20 mm) and planes are
touched once in each place. The shape of the part is drawn here. All features of a set have the same
map.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

if __package__ in (None, ""):  # run as a file
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.departures.departure import Departure
from benchmarks.departures.machine import DIAMETER, PART_AT, Run, latched, reference_run
from benchmarks.departures.probes import MICROMETRE, MakeProbe, six_seats, uneven
from benchmarks.departures.rows import ROWS
from benchmarks.departures.tripod import FLAT, TIP_RADIUS, SimulatedProbe
from pretravel import PretravelMap, Touches, apply, measure_feature, qualify, relations_between
from pretravel.drawing.features.conformity import (
    ConformityVerdict,
    form_conformity,
    size_conformity,
)
from pretravel.drawing.features.measured_feature import MeasuredFeature

SEED = 23
U_DIAMETER = 0.1 * MICROMETRE
BORE = 10.0  # radius, mm
REQUIRED = 0.975
Z = np.array([0.0, 0.0, 1.0])
Shape = Callable[[np.random.Generator], Callable[[np.ndarray], np.ndarray]]
"""A drawn profile: distance from the perfect bore at azimuths. [mm]"""


def _waves(least: int, most: int, amplitude: float) -> Shape:
    def drawn(generator: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
        count, phase = generator.integers(least, most + 1), generator.uniform(0.0, 2.0 * np.pi)
        return lambda azimuth: amplitude * np.cos(count * azimuth + phase)

    return drawn


def _rough(deviation: float) -> Shape:
    """Independent from touch to touch."""

    def drawn(generator: np.random.Generator) -> Callable[[np.ndarray], np.ndarray]:
        return lambda azimuth: generator.normal(0.0, deviation, len(azimuth))

    return drawn


SHAPES: dict[str, Shape] = {
    "perfect": _waves(2, 2, 0.0),
    "oval, 1 µm": _waves(2, 2, 1.0 * MICROMETRE),
    "oval, 5 µm": _waves(2, 2, 5.0 * MICROMETRE),
    "2 to 12 lobes, 2 µm": _waves(2, 12, 2.0 * MICROMETRE),
    "rough, 0.3 µm": _rough(0.3 * MICROMETRE),
    "rough, 1 µm": _rough(1.0 * MICROMETRE),
    "rough, 3 µm": _rough(3.0 * MICROMETRE),
}
"""Amplitudes of waves, standard deviations of what is rough."""
BORES = [
    *(("perfect", count) for count in (4, 5, 8, 50)),
    *((shape, count) for shape in list(SHAPES)[1:] for count in (5, 8)),
    ("oval, 5 µm", 50),
    ("2 to 12 lobes, 2 µm", 50),
    ("rough, 1 µm", 50),
]
PLANES = (4, 50)


@dataclass(frozen=True)
class Workshop:
    """A probe, the map that was made of it, and the noise to come."""

    probe: SimulatedProbe
    pretravel_map: PretravelMap
    generator: np.random.Generator
    centre_error: np.ndarray  # of the reference, to which positions refer [mm]

    def touched(self, at: np.ndarray, normals: np.ndarray, curvature: float) -> Touches:
        """Touches of true surface points, along the normals."""
        feeds = np.full(len(at), 50.0)
        centers = at + TIP_RADIUS * normals
        run = Run(centers, normals, -normals, curvature, feeds, PART_AT, on_reference=False)
        found = latched(run, self.probe, Departure("part"), self.generator)
        return Touches(found, normals)

    def measured(
        self, kind: str, at: np.ndarray, normals: np.ndarray, curvature: float, label: str = ""
    ) -> MeasuredFeature:
        points = apply(self.touched(at, normals, curvature), self.pretravel_map)
        return measure_feature(points, kind, axis=Z if kind == "bore" else None, label=label)


def workshop(
    number: int,
    kind: str,
    make_probe: MakeProbe = six_seats,
    departure: Departure = Departure("sphere"),
) -> Workshop:
    """One probe, qualified as a user does."""
    generator = np.random.default_rng([SEED, number])
    probe = make_probe(generator)
    departure = replace(departure, diameter_error=generator.normal(0.0, U_DIAMETER))
    reference = reference_run(departure, probe, generator)
    at = latched(reference.run, probe, departure, generator)
    result = qualify(
        Touches(at, reference.nominal_normals),
        DIAMETER,
        tip_diameter=2.0 * TIP_RADIUS,
        u_diameter=U_DIAMETER,
        u_temperature=0.0,
        sphere_form=0.0,
        kind=kind,
    )
    return Workshop(probe, result.pretravel_map, generator, result.center - reference.center)


def around(count: int) -> tuple[np.ndarray, np.ndarray]:
    azimuth = 2.0 * np.pi * np.arange(count) / count
    return azimuth, np.column_stack([np.cos(azimuth), np.sin(azimuth), 0.0 * azimuth])


def left(columns: np.ndarray, values: np.ndarray) -> np.ndarray:
    """What a least-squares feature leaves of its surface."""
    return np.asarray(values - columns @ np.linalg.lstsq(columns, values, rcond=None)[0])


def _form_and_size(
    found: MeasuredFeature, touched: np.ndarray, whole: np.ndarray | None, size: float | None
) -> dict[str, float]:
    """Of one feature against the truth: forms of the touched places and of the whole, size."""
    form, truth = found.form, float(np.ptp(touched))
    low, high = form.interval

    def accepted(limit: float) -> float:
        decision = form_conformity("form", form, max(limit, 1e-9) * (1.0 - 1e-6), REQUIRED)
        return float(decision.verdict is ConformityVerdict.CONFORMS)

    row = {
        "true": truth,
        "measured": form.measured,
        "value": form.value,
        "U": form.expanded_u,
        "covered": float(low - 1e-9 <= truth <= high + 1e-9),
        "bound": float(low == 0.0),
        "accepted": accepted(truth),
        "whole": np.nan if whole is None else accepted(float(np.ptp(whole))),
        "old": float(abs(form.measured - truth) <= 2.0 * _range_u(found)),
    }
    if size is not None:
        diameter = found.quantity("diameter")
        limits = (-np.inf, size * (1.0 - 1e-12)), (size * (1.0 + 1e-12), np.inf)
        decisions = [
            size_conformity("d", diameter.value, diameter.u, each, REQUIRED, dof=diameter.dof)
            for each in limits
        ]
        row["size"] = float(abs(diameter.value - size) <= diameter.expanded_u)
        row["size 2u"] = float(abs(diameter.value - size) <= 2.0 * diameter.u)
        row["size chi"] = ((diameter.value - size) / diameter.u) ** 2
        row["size said"] = np.nan if row["size"] else float(bool(found.warnings))
        row["size u"], row["k"] = diameter.u, diameter.expanded_u / diameter.u
        row["size accepted"] = float(
            np.mean([each.verdict is ConformityVerdict.CONFORMS for each in decisions])
        )
    return row


def _range_u(found: MeasuredFeature) -> float:
    """The scatter of the range when the noise is added once more: what U of the range was."""
    noise = found.errors.noise_trials(np.random.default_rng(1), 4000)
    return float(np.std(np.ptp(found.association.residuals + noise, axis=1)))


def bore_row(shop: Workshop, shape: str, count: int) -> dict[str, float]:
    azimuth, outward = around(count)
    profile = SHAPES[shape](shop.generator)
    off, everywhere = profile(azimuth), profile(around(2000)[0])
    found = shop.measured("bore", PART_AT + (BORE + off)[:, None] * outward, -outward, -1.0 / BORE)
    rough = shape.startswith("rough")
    # The mean of what is rough is zero; that of waves is so over the whole turn.
    touched = left(np.column_stack([outward[:, :2], np.ones(count)]), off)
    return _form_and_size(found, touched, None if rough else everywhere, 2.0 * BORE)


def plane_row(shop: Workshop, count: int) -> dict[str, float]:
    at = shop.generator.uniform(-20.0, 20.0, (count, 3)) * [1.0, 1.0, 0.0]
    if count == 4:
        at = np.array(
            [[-20.0, -20.0, 0.0], [20.0, -20.0, 0.0], [20.0, 20.0, 0.0], [-20.0, 20.0, 0.0]]
        )
    found = shop.measured("plane", PART_AT + at, np.tile(Z, (count, 1)), FLAT)
    return _form_and_size(found, np.zeros(count), None, None)


def height_row(shop: Workshop, count: int) -> dict[str, float]:
    """A plane touched from above: its height from the centre of the reference."""
    at = shop.generator.uniform(-20.0, 20.0, (count, 3)) * [1.0, 1.0, 0.0]
    found = shop.measured("plane", PART_AT + at, np.tile(Z, (count, 1)), FLAT).quantity("z")
    error = found.value - PART_AT[2] - shop.centre_error[2]
    return {
        "chi": (error / found.u) ** 2,
        "covered": float(abs(error) <= found.expanded_u),
        "u": found.u,
        "error": error,
    }


def _apart(first: MeasuredFeature, second: MeasuredFeature, truth: float) -> dict[str, float]:
    """The one distance or angle of two features, in units of its u, and of u in quadrature."""
    (relation,) = relations_between([first, second])
    found = relation.quantity
    error = found.value - truth
    return {
        "chi": (error / found.u) ** 2,
        "covered": float(abs(error) <= found.expanded_u),
        "u": found.u,
        "error": error,
    }


def bores_apart(shop: Workshop, count: int, away: Sequence[float]) -> dict[str, float]:
    _, outward = around(count)
    centres = (np.zeros(3), np.array([*away, 0.0]))
    bores = [
        shop.measured("bore", PART_AT + c + BORE * outward, -outward, -1.0 / BORE, str(i))
        for i, c in enumerate(centres)
    ]
    row = _apart(*bores, float(np.linalg.norm(centres[1])))
    alone = [bore.quantity("x").u for bore in bores]
    row["chi in quadrature"] = row["error"] ** 2 / float(np.sum(np.square(alone)))
    return row


def planes_apart(shop: Workshop, second_normal: np.ndarray, *, angle: bool) -> dict[str, float]:
    """Two planes of nine touches: their distance (a step of 5 mm), or their angle."""
    u, v = (side.ravel() * 20.0 for side in np.meshgrid([-1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]))
    found = []
    for index, normal in enumerate((Z, second_normal)):
        across = np.array([-normal[1], normal[0], 0.0]) if abs(normal[2]) < 0.9 else np.eye(3)[0]
        across = across / np.linalg.norm(across)
        at = u[:, None] * across + v[:, None] * np.cross(normal, across)
        at = PART_AT + at + index * (np.array([60.0, 0.0, 0.0]) if angle else 5.0 * Z)
        found.append(shop.measured("plane", at, np.tile(normal, (9, 1)), FLAT, str(index)))
    by_name = {r.quantity.name: r.quantity for r in relations_between(found)}
    quantity = by_name["angle" if angle else "distance"]
    truth = float(np.arccos(Z @ second_normal)) if angle else 5.0
    error = quantity.value - truth
    alone = [f.u_direction or 0.0 for f in found] if angle else [f.quantity("z").u for f in found]
    return {
        "chi": (error / quantity.u) ** 2,
        "covered": float(abs(error) <= quantity.expanded_u),
        "u": quantity.u,
        "error": error,
        "chi in quadrature": error**2 / float(np.sum(np.square(alone))),
    }


def one_set(number: int, kind: str) -> dict[str, dict[str, float]]:
    """All rows with one probe and its map."""
    shop = workshop(number, kind)
    oblique = np.array([np.sin(1.0), 0.0, np.cos(1.0)])
    found = {f"bore, {shape}, {n} touches": bore_row(shop, shape, n) for shape, n in BORES}
    warming = workshop(number, kind, departure=ROWS["warming_rings"])
    for n in (8, 24):
        found[f"bore, perfect, {n} touches, after a sphere that drifted ring by ring"] = bore_row(
            warming, "perfect", n
        )
    found |= {f"plane, perfect, {n} touches": plane_row(shop, n) for n in PLANES}
    found |= {
        f"two bores, {n} touches each, distance along {axis}": bores_apart(shop, n, away)
        for n in (8, 50)
        for axis, away in (("x", (50.0, 0.0)), ("xy", (30.0, 40.0)))
    }
    found["two planes, 9 touches each, step of 5 mm"] = planes_apart(shop, Z, angle=False)
    found["two planes, 9 touches each, angle of 57.3°"] = planes_apart(shop, oblique, angle=True)
    for name, one in (("usual", shop), ("very uneven", workshop(number, kind, uneven))):
        row = f"two heights, plane (50 touches) and sphere, {name} probe"
        found[row] = height_row(one, 50)
    return found


def printed(sets: Sequence[dict[str, dict[str, float]]]) -> None:
    """The tables, as Markdown."""

    def mean(name: str, column: str) -> float:
        seen = [value for one in sets if not np.isnan(value := one[name].get(column, np.nan))]
        return float(np.mean(seen)) if seen else np.nan

    def percent(name: str, column: str) -> str:
        value = mean(name, column)
        return "–" if np.isnan(value) else f"{100.0 * value:.0f}"

    def micrometres(name: str, column: str) -> str:
        return f"{mean(name, column) / MICROMETRE:.2f}"

    names = list(sets[0])
    features = [name for name in names if not name.startswith("two")]
    print(
        "| form | true µm | measured range µm | form µm | U µm | covered % | only a bound % | "
        "range ± 2 u covers % | false acceptance of touched points % | of the whole % |"
    )
    print("| --- |" + " --- |" * 9)
    for name in features:
        print(
            "|",
            name,
            "|",
            " | ".join(
                [
                    *(micrometres(name, c) for c in ("true", "measured", "value", "U")),
                    *(percent(name, c) for c in ("covered", "bound", "old", "accepted", "whole")),
                ]
            ),
            "|",
        )
    print("\n| size | u µm | k | χ² | covered by U % | covered by 2 u % | false acceptance % |"
          " of the others, warned % |")  # fmt: skip
    print("| --- |" + " --- |" * 7)
    for name in (name for name in features if "size" in sets[0][name]):
        print(
            "|",
            name,
            "|",
            " | ".join(
                [
                    micrometres(name, "size u"),
                    f"{mean(name, 'k'):.2f}",
                    f"{mean(name, 'size chi'):.2f}",
                    percent(name, "size"),
                    percent(name, "size 2u"),
                    f"{100.0 * mean(name, 'size accepted'):.1f}",
                    percent(name, "size said"),
                ]
            ),
            "|",
        )
    print("\n| between features | u µm or µrad | χ² | covered by U % | χ² of u in quadrature |")
    print("| --- |" + " --- |" * 4)
    for name in names[len(features) :]:
        scale = 1e-6 if "angle" in name else MICROMETRE
        print(
            "|",
            name,
            "|",
            f"{mean(name, 'u') / scale:.2f} | {mean(name, 'chi'):.2f} | "
            f"{percent(name, 'covered')} | {mean(name, 'chi in quadrature'):.2f} |",
        )
    print(f"\n{len(sets)} sets; false acceptance: of a value at its limit, with P = "
          f"{100.0 * REQUIRED:g} %", flush=True)  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=150)
    parser.add_argument("--first", type=int, default=0, help="number of the first set")
    parser.add_argument("--kind", default="auto", help="kind of map")
    given = parser.parse_args()
    numbers = range(given.first, given.first + given.sets)
    printed([one_set(number, given.kind) for number in numbers])


if __name__ == "__main__":
    main()
