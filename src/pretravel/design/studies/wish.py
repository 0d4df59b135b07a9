"""What is required of a probe, and the TOML file that states it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

from pretravel.base import PretravelError, TomlDocument, TomlStructure
from pretravel.design.shipped_texts import ShippedTexts
from pretravel.design.studies.definition import (
    Directions,
    Factor,
    Study,
    StudyParts,
    StudySettings,
    structure_with_factors,
    study_of_parts,
)
from pretravel.design.studies.outputs import MEANINGS, OutputMeaning

OF_GEOMETRY: Mapping[str, OutputMeaning] = {
    "lever": OutputMeaning("mm", "tip centre to the plane of the rod axes"),
    "stylus_length": OutputMeaning("mm", "root of the stylus to tip centre"),
    "rod_lift": OutputMeaning("mm", "rise of the rod that opens, at the overtravel"),
}
"""Quantities of a description that a specification can limit, as it can outputs of studies."""
_LARGEST_OVERTRAVEL = 100.0
"""[mm]"""
WISHES = ShippedTexts("pretravel.design.studies", "data/wishes", "wish", "wishes")
"""The specifications that come with the package."""


@dataclass(frozen=True)
class Limit:
    """A quantity that must stay within limits.

    Parameters
    ----------
    of : str
        An output of studies or a name of `OF_GEOMETRY`.
    at_least, at_most : float
        In the unit of the quantity.
    """

    of: str
    at_least: float = -math.inf
    at_most: float = math.inf

    def __post_init__(self) -> None:
        if not self.at_least <= self.at_most:
            raise PretravelError(
                f"the limit of {self.of} has at_least {self.at_least:g} above at_most "
                f"{self.at_most:g}"
            )
        if math.isinf(self.at_least) and math.isinf(self.at_most):
            raise PretravelError(f"the limit of {self.of} needs at_least or at_most")


@dataclass(frozen=True)
class Wish:
    """A specification: what is to be small, what may change, what must hold.

    Attributes
    ----------
    study : Study
        The probe, its directions and conditions; its factors are the free quantities.
    goal : str
        The quantity that is made as small as possible.
    sign : float
        -1 where it is made as large as possible instead.
    second : str
        A second quantity that is made small, for a front of best designs; empty: none.
    limits : tuple of Limit
    overtravel : float
        Of the tip, for `rod_lift`. [mm]
    seed : int
        Of the search.
    """

    study: Study
    goal: str
    sign: float
    second: str
    limits: tuple[Limit, ...]
    overtravel: float
    seed: int


@dataclass(frozen=True)
class _WishTable:
    probe: str = "omp40-2"
    name: str = "wish"
    least: str = ""
    most: str = ""
    and_least: str = ""
    overtravel: float = 0.0
    seed: int = 1


@dataclass(frozen=True)
class _Whole:
    free: tuple[Factor, ...]
    limit: tuple[Limit, ...] = ()
    wish: _WishTable = field(default_factory=_WishTable)
    directions: Directions = field(default_factory=Directions)
    prediction: Mapping[str, Any] = field(default_factory=dict)
    touch: Mapping[str, Any] = field(default_factory=dict)
    calibration: Mapping[str, Any] = field(default_factory=dict)


@cache
def _structure() -> TomlStructure:
    structure = structure_with_factors("pretravel wishes stylus-50mm prints a whole specification")
    structure.table(_WishTable, overtravel="overtravel_mm")
    return structure


def wish_in(document: TomlDocument, folder: Path = Path()) -> Wish:
    """A specification from the tables of its file.

    Parameters
    ----------
    document : TomlDocument
    folder : Path
        To which the path of the description is relative.

    Raises
    ------
    PretravelError
        Tables, keys or quantities that are unknown or missing.
    """
    parts = _structure().make(document, _Whole)
    table = parts.wish
    goal = table.least or table.most
    if bool(table.least) == bool(table.most):
        raise document.error(
            "a specification has either least (a quantity that is made small) or most", "wish"
        )
    for name, place in (
        (goal, ("wish",)),
        (table.and_least, ("wish", "and_least")),
        *((limit.of, ("limit", number)) for number, limit in enumerate(parts.limit)),
    ):
        if name and name not in known_quantities():
            raise document.error(
                f"there is no quantity '{name}'; known are {', '.join(known_quantities())}", *place
            )
    _refuse_contradictions(document, parts, goal)
    names = {goal, table.and_least, *(limit.of for limit in parts.limit)}
    outputs = tuple(output for output, numbers in MEANINGS.items() if names & set(numbers))
    return Wish(
        study=study_of_parts(_as_study(parts, outputs), document, folder, "wish", "free"),
        goal=goal,
        sign=1.0 if table.least else -1.0,
        second=table.and_least,
        limits=parts.limit,
        overtravel=table.overtravel,
        seed=table.seed,
    )


def _refuse_contradictions(document: TomlDocument, parts: _Whole, goal: str) -> None:
    table, limited = parts.wish, [limit.of for limit in parts.limit]
    names = {goal, table.and_least, *limited}
    for number, name in enumerate(limited):
        if name in limited[:number]:
            raise document.error(
                f"{name} has two limits: give at_least and at_most in one [[limit]]",
                "limit", number, "of",
            )  # fmt: skip
    if table.and_least == goal:
        raise document.error(f"and_least is the goal {goal} itself: leave it out", "wish")
    if "rod_lift" in names and not table.overtravel:
        raise document.error(
            "rod_lift is the rise of a rod at the overtravel of the tip: give overtravel_mm",
            "wish",
        )
    if not 0.0 <= table.overtravel <= _LARGEST_OVERTRAVEL:
        raise document.error(
            f"the overtravel is {table.overtravel:g} mm; 0 to {_LARGEST_OVERTRAVEL:g} mm are "
            "possible",
            "wish", "overtravel_mm",
        )  # fmt: skip
    if "pretravel_lobes" in names and not parts.directions.has_lobes:
        raise document.error(
            "pretravel_lobes needs azimuths of a whole circle in equal steps, 7 or more, and a "
            "polar angle up to 90°",
            "directions",
        )


def load_wish(wish: str | Path) -> Wish:
    """A specification by the name of a shipped one, or from a TOML file.

    Raises
    ------
    PretravelError
        Neither such a name nor a file; a file that is not a specification.

    >>> load_wish("stylus-50mm").goal
    'pretravel_deviation'
    """
    return wish_in(*WISHES.document(wish))


def known_quantities() -> dict[str, OutputMeaning]:
    """All quantities that a specification can name.

    >>> known_quantities()["lever"].unit
    'mm'
    """
    return {
        **{name: meaning for numbers in MEANINGS.values() for name, meaning in numbers.items()},
        **OF_GEOMETRY,
    }


def _as_study(parts: _Whole, outputs: tuple[str, ...]) -> StudyParts:
    """The free quantities and conditions as those of a study; the search chooses the designs."""
    table = parts.wish
    return StudyParts(
        factor=parts.free,
        study=StudySettings(
            probe=table.probe, name=table.name, plan="latin-hypercube", outputs=outputs,
            keep_directions=False,
        ),
        directions=parts.directions,
        prediction=parts.prediction,
        touch=parts.touch,
        calibration=parts.calibration,
    )  # fmt: skip
