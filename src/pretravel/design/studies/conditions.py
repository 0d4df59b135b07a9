"""Conditions of a design, without its probe: prediction, touches on a part, calibration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from pretravel.base import NOISE, PretravelError, TomlDocument, TomlStructure, checked
from pretravel.design.studies.definition import Level, Study
from pretravel.prediction import Material, Probe, described_probe


@dataclass(frozen=True)
class Prediction:
    """How the probe is predicted.

    Parameters
    ----------
    model : str
        analytic, fem, shen, ren or wozniak.
    workpiece : str
        Name of a material.
    """

    model: str = "analytic"
    workpiece: str = "steel"


@dataclass(frozen=True)
class TouchConditions:
    """Touches on a part.

    Parameters
    ----------
    surface : str
        As for ``pretravel simulate``: ``plane:polar=40``, ``convex``, ``part.step``.
    targets : str
        Path of a file of targets.
    feed : float or None
        [mm/min]
    delay_ms : float
        Of the trigger signal. [ms]
    friction : float
        Of the tip on the part.
    """

    surface: str = "plane:polar=0"
    targets: str = ""
    feed: float | None = None
    delay_ms: float = 0.0
    friction: float = 0.0


@dataclass(frozen=True)
class Calibration:
    """A qualification on a sphere.

    Parameters
    ----------
    touches : int
        Spread evenly from the pole to the equator.
    kind : str
        Of the map.
    noise : float
        Standard deviation of a touch. [mm]
    diameter : float
        Of the sphere. [mm]
    seed : int
        Of the noise.
    """

    touches: int = 25
    kind: str = "harmonic"
    noise: float = 0.3e-3
    diameter: float = 25.0
    seed: int = 1

    def __post_init__(self) -> None:
        checked(self.noise, "the noise of [calibration]", NOISE)
        if self.seed < 0:
            raise PretravelError(f"seed of [calibration] is {self.seed}; it must be 0 or more")


@dataclass(frozen=True)
class Case:
    """A design: a probe and its conditions.

    Attributes
    ----------
    probe : Probe
    prediction : Prediction
    touch : TouchConditions
    calibration : Calibration
    folder : Path
        To which the file of targets is relative.
    """

    probe: Probe
    prediction: Prediction
    touch: TouchConditions
    calibration: Calibration
    folder: Path

    @property
    def part(self) -> Material:
        """Material of the part, from the description or the package."""
        return self.probe.part_material(self.prediction.workpiece)


@cache
def _structure() -> TomlStructure:
    structure = TomlStructure()
    structure.table(TouchConditions, feed="feed_mm_min")
    structure.table(Calibration, diameter="diameter_mm", noise="noise_um")
    return structure


def case_of(study: Study, levels: Mapping[str, Level]) -> Case:
    """The probe and the conditions with some values of the factors.

    Parameters
    ----------
    study : Study
    levels : mapping of key to value

    Raises
    ------
    PretravelError
        Unknown keys; a probe or conditions that cannot be.

    >>> from pretravel.design.studies.definition import load_study
    >>> case_of(load_study("preload-and-seats"), {"spring.preload_N": 4.5}).probe.preload
    4.5
    """
    tables: dict[str, Any] = study.tables(levels)
    parts = {
        name: _structure().make(_unwritten({name: tables.pop(name)}), kind, name)
        for name, kind in _TABLES.items()
    }
    probe = described_probe(_unwritten(tables), study.folder)
    return Case(
        probe, parts["prediction"], parts["touch"], parts["calibration"], study.touch_folder
    )


_TABLES: Mapping[str, Any] = {
    "prediction": Prediction,
    "touch": TouchConditions,
    "calibration": Calibration,
}


def _unwritten(tables: Mapping[str, Any]) -> TomlDocument:
    """Tables of no file: messages name keys alone."""
    return TomlDocument(tables, "", "")
