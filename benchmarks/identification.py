"""Whether `pretravel identify` states right numbers, and right uncertainties of them.

python benchmarks/identification.py --sets 200

The probe of each set has the numbers of the catalogue's OMP40-2 with a 100 mm stylus, except the
free ones, which are drawn. Its physics is that of `benchmarks/departures/tripod.py`, its stylus and
its contacts follow from the closed forms below; only `evaluated` uses the package, as a user does:
touches on a sphere, `qualify`, `write_map`, `read_map`, `identify` from the catalogue's numbers.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Literal

import numpy as np

if __package__ in (None, ""):  # run as a file
    sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from benchmarks.departures.departure import Departure
from benchmarks.departures.machine import DIAMETER, latched, reference_run
from benchmarks.departures.patterns import NINE, USUAL_25, spread
from benchmarks.departures.tripod import TIP_RADIUS, Tripod
from pretravel import (
    PretravelError,
    PretravelMap,
    Touches,
    identify,
    load_probe,
    qualify,
    read_map,
    write_map,
)
from pretravel.design.identification.free_numbers import FREE
from pretravel.files.map_json import json_of_map
from pretravel.prediction.catalogue import source_text

PROBE = "omp40-2-100mm"
U_DIAMETER = 0.2e-3
"""Of the reference sphere; its true diameter is drawn. [mm]"""
SEED = 29
COVERED = 1.96
STEEL = (210e3, 0.30)
ELASTIC = {
    "tungsten carbide": (686e3, 0.22),
    "ceramic": (413e3, 0.23),
    "stainless steel": (193e3, 0.30),
    "ruby": (400e3, 0.29),
}
"""Modulus of elasticity [MPa] and Poisson's ratio."""
SPREADS = {"stem_diameter": 0.1, "preload": 0.15, "rod_azimuth_1": 0.035}
"""Of the true numbers about the described ones: relative, relative, rad."""


def hertz_modulus(first: tuple[float, float], second: tuple[float, float]) -> float:
    return 1.0 / sum((1.0 - nu**2) / modulus for modulus, nu in (first, second))


def rod_on_ball(rod_radius: float, ball_radius: float, modulus: float) -> float:
    """Approach of a cylinder and a ball for 1 N: Johnson, Contact Mechanics, 4.26."""
    from scipy.optimize import brentq
    from scipy.special import ellipe, ellipk

    slender, steep = 1.0 / ball_radius, 1.0 / ball_radius + 1.0 / rod_radius

    def integrals(axes: float) -> tuple[float, float]:
        return float(ellipk(1.0 - axes**2)), float(ellipe(1.0 - axes**2))

    def mismatch(axes: float) -> float:
        k, e = integrals(axes)
        return (e / axes**2 - k) / (k - e) - steep / slender

    axes = float(brentq(mismatch, 1e-3, 1.0 - 1e-9, xtol=1e-14))
    k, e = integrals(axes)
    # p0 b / (a² e²) (K - E) = slender E* / 2, and N = 2/3 p0 pi a b; the approach is p0 b K / E*.
    eccentricity = 1.0 - axes**2
    cube = 3.0 * (k - e) / (np.pi * eccentricity * slender * modulus)  # a³ for 1 N
    a = cube ** (1.0 / 3.0)
    return float(1.5 * k / (np.pi * a * modulus))


def described(numbers: Mapping[str, float]) -> Tripod:
    """The catalogue's probe with other numbers; a rotation turns it about +z."""
    text = tomllib.loads(source_text(PROBE))
    head, stem = ({**segment} for segment in text["stylus"])
    stem["diameter_mm"] = numbers.get("stem_diameter", stem["diameter_mm"])
    lever = text["hub"]["offset_mm"] + head["length_mm"] + stem["length_mm"]
    across = along = 0.0
    far = head["length_mm"] + stem["length_mm"]
    for segment in (head, stem):
        modulus, nu = ELASTIC[segment["material"]]
        area, near = 0.25 * np.pi * segment["diameter_mm"] ** 2, far - segment["length_mm"]
        bent = 64.0 / (3.0 * np.pi * modulus * segment["diameter_mm"] ** 4)
        shear = segment["length_mm"] * (7.0 + 6.0 * nu) / (3.0 * modulus * area)  # Cowper
        across += bent * (far**3 - near**3) + shear
        along += segment["length_mm"] / (modulus * area)
        far = near
    rods = np.radians(text["tripod"]["rod_azimuths_deg"])
    rods[0] = numbers.get("rod_azimuth_1", rods[0])
    angle = numbers.get("rotation", 0.0)
    c, s = np.cos(angle), np.sin(angle)
    carbide = ELASTIC[text["seats"]["material"]]
    on_part = hertz_modulus(ELASTIC[text["tip"]["material"]], STEEL)
    return Tripod(
        rod_azimuths=rods,
        support_angles=np.full(6, np.radians(text["seats"]["support_angle_deg"])),
        seat_radius=text["tripod"]["radius_mm"],
        preload=numbers.get("preload", text["spring"]["preload_N"]),
        spring=np.zeros(2),
        tip=np.array([0.0, 0.0, -lever]),
        compliance=np.diag([across, across, along]),
        seat_approach=rod_on_ball(
            text["tripod"]["rod_radius_mm"],
            text["seats"]["ball_radius_mm"],
            hertz_modulus(carbide, carbide),
        ),
        tip_approach=(9.0 / (16.0 * TIP_RADIUS * on_part**2)) ** (1.0 / 3.0),
        rotation=np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]),
    )


@dataclass(frozen=True)
class Row:
    """Free numbers, the map that they are identified from, and how the sphere was touched."""

    free: tuple[str, ...]
    kind: str = "auto"
    form: Literal["json", "earlier", "csv"] = "json"
    """Earlier: a file without what was touched, as earlier versions wrote it."""
    touched: str = "25"
    repeats: int = 3

    @property
    def words(self) -> str:
        form = {"json": "", "earlier": ", without its touches", "csv": ", table (.csv)"}[self.form]
        return f"{', '.join(self.free)} | {self.kind}{form} | {self.touched} × {self.repeats}"

    def read(self, stored: bytes) -> PretravelMap:
        """The map as a user reads it."""
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "map.json"
            path.write_bytes(stored)
            found = read_map(path)
            if self.form == "csv":
                write_map(path.with_suffix(".csv"), found)
                found = read_map(path.with_suffix(".csv"))
        return replace(found, touched=None) if self.form == "earlier" else found


ROD = ("rotation", "rod_azimuth_1", "stem_diameter")
STEM = ("rotation", "stem_diameter")
ROWS = (
    Row(("rotation",), "harmonic"),
    Row(("stem_diameter",), "harmonic"),
    Row(("preload",), "harmonic"),
    Row(STEM, "harmonic"),
    Row(("rotation",)),
    Row(STEM),
    Row(ROD),
    Row(ROD, "harmonic"),
    Row(ROD, "mean"),
    Row(ROD, "mean", touched="9"),
    Row(ROD, "harmonic", touched="25", repeats=1),
    Row(ROD, "harmonic", touched="92", repeats=1),
    Row(STEM, "harmonic", "earlier"),
    Row(STEM, "auto", "earlier"),
    Row(ROD, "auto", "earlier"),
    Row(STEM, "mean", "earlier"),
    Row(STEM, "harmonic", "csv"),
)
DIRECTIONS = {"9": NINE, "25": USUAL_25, "92": spread(92, 90.0)}


@dataclass(frozen=True)
class Outcome:
    """Of one set: errors over u of each number, or the refusal; the warnings."""

    errors: tuple[float, ...] = ()
    u: tuple[float, ...] = ()
    warnings: tuple[str, ...] = ()
    refused: str = ""


@cache
def qualified(
    kind: str, touched: str, repeats: int, *, uneven: bool, number: int
) -> tuple[dict[str, float], bytes]:
    """The true numbers of a set, and the file of its map."""
    generator = np.random.default_rng([SEED, number])
    start = load_probe(PROBE)
    truth = {"rotation": generator.uniform(0.0, 2.0 * np.pi)}
    for name, described_as in (("stem_diameter", start.stem.diameter), ("preload", start.preload)):
        truth[name] = described_as * float(np.exp(generator.normal(0.0, SPREADS[name])))
    if uneven:
        truth["rod_azimuth_1"] = generator.normal(0.0, SPREADS["rod_azimuth_1"])
    error = generator.normal(0.0, U_DIAMETER)
    departure = Departure("", directions=DIRECTIONS[touched], repeats=repeats, diameter_error=error)
    probe = described(truth)
    reference = reference_run(departure, probe, generator)
    at = latched(reference.run, probe, departure, generator)
    found = qualify(
        Touches(at, reference.nominal_normals),
        DIAMETER,
        tip_diameter=2.0 * TIP_RADIUS,
        kind=kind,
        u_diameter=U_DIAMETER,
        u_temperature=0.0,
    )
    return truth, json_of_map(found.pretravel_map)


def evaluated(row: Row, number: int) -> Outcome:
    """Touch, qualify, write the map, read it, identify; numbers that are not free are known."""
    start = load_probe(PROBE)
    uneven = "rod_azimuth_1" in row.free
    try:
        truth, stored = qualified(row.kind, row.touched, row.repeats, uneven=uneven, number=number)
        for name in truth.keys() - set(row.free):
            start = FREE[name].put(start, truth[name])
        identified = identify(row.read(stored), start, row.free)
    except PretravelError as error:
        return Outcome(refused=str(error))
    off = identified.values - np.array([truth[name] for name in row.free])
    if "rotation" in row.free:
        period = 2.0 * np.pi / (1.0 if uneven else 3.0)
        column = row.free.index("rotation")
        off[column] = (off[column] + 0.5 * period) % period - 0.5 * period
    return Outcome(
        tuple(off.tolist()),
        tuple(identified.standard_uncertainty.tolist()),
        tuple(identified.unknown),
    )


def line(row: Row, outcomes: list[Outcome]) -> str:
    """A row of the table, with a value for each number."""
    refused = sum(bool(each.refused) for each in outcomes)
    answered = [each for each in outcomes if not each.refused]
    cells = [row.words]
    if answered:
        off = np.array([each.errors for each in answered])
        u = np.array([each.u for each in answered])
        warned = np.array([bool(each.warnings) for each in answered])
        ratio = np.abs(off / u)
        outside = np.any(ratio > COVERED, axis=1)
        quiet = ratio[~warned] if np.any(~warned) else ratio
        cells += [
            ", ".join(f"{100.0 * share:.0f}" for share in np.mean(ratio <= COVERED, axis=0)) + " %",
            ", ".join(f"{chi:.2f}" for chi in np.mean(ratio**2, axis=0)),
            ", ".join(f"{chi:.2f}" for chi in np.mean(quiet**2, axis=0)),
            ", ".join(f"{size:.2g}" for size in np.abs(off).max(axis=0)),
            ", ".join(f"{size:.2g}" for size in np.median(u, axis=0)),
            f"{warned.sum()}",
            f"{np.sum(warned & outside)} of {outside.sum()}",
        ]
    else:
        cells += ["-"] * 7
    cells.append(str(refused))
    return "| " + " | ".join(cells) + " |"


HEAD = (
    "| free numbers | map | touches | covered by 1.96 u | χ² | χ² without warned sets | "
    "largest error (rad, mm, N) | median u | warned | warned of those outside | refused |"
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sets", type=int, default=100)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--kind", help="of all maps, instead of that of the row")
    parser.add_argument("--rows", help="numbers of rows, a,b,…")
    parser.add_argument("--said", action="store_true", help="print warnings and refusals")
    chosen = parser.parse_args()
    numbers = range(len(ROWS)) if chosen.rows is None else map(int, chosen.rows.split(","))
    print(HEAD, "| --- " * 11 + "|", sep="\n")
    for number in numbers:
        row = ROWS[number] if chosen.kind is None else replace(ROWS[number], kind=chosen.kind)
        sets = range(chosen.first, chosen.first + chosen.sets)
        outcomes = [evaluated(row, number) for number in sets]
        print(line(row, outcomes), flush=True)
        if chosen.said:
            for number, each in zip(sets, outcomes, strict=True):
                off = np.array(each.errors) / np.array(each.u)
                print(number, each.refused, off.round(1).tolist(), *each.warnings, sep="\n    ")


if __name__ == "__main__":
    main()
