"""What a study varies and what it computes, and the TOML file that states it."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeAlias

from pretravel.base import (
    DEGREE,
    InputError,
    PretravelError,
    TomlDocument,
    TomlStructure,
    degrees_in,
    parse_toml,
    quoted,
    refuse_named_file,
)
from pretravel.design.shipped_texts import ShippedTexts
from pretravel.prediction import catalogue_names, source_text
from pretravel.surface import is_shape

PLANS: Mapping[str, str] = {
    "full-factorial": "every value of each factor with every value of all others",
    "one-at-a-time": "one factor after the other, from the base",
    "latin-hypercube": "samples spread evenly over each range",
    "sobol": "samples for Sobol' indices: the shares of the factors in the variance",
}
"""How the designs of a study are chosen."""
OUTPUTS: Mapping[str, str] = {
    "force": "trigger force",
    "sensing-distance": "sensing distance",
    "pretravel": "pretravel, its range and its lobes",
    "corrections": "what the corrections of controls leave",
    "calibration": "errors after a qualification with some touches",
    "touch": "travel from first contact to the reported point on a surface",
    "stress": "highest von Mises stress of the bodies at the trigger (model fem)",
    "contact": "pressure and shear of the contacts of seats and tip at the trigger",
}
"""What a study computes of each design."""
STUDIES = ShippedTexts("pretravel.design.studies", "data/studies", "study", "studies")
"""The studies that come with the package."""
LARGEST_PLAN = 1_000_000
"""Most designs of a study."""
Level: TypeAlias = float | str
"""A value of a factor, in the unit of its key."""


class AngleList(tuple[float, ...]):
    """Angles in degrees: in the file a number, a list, or ``"start:stop:step"``."""

    @classmethod
    def read(cls, value: Any) -> AngleList:
        """The angles that a value of the file means; see `degrees_in`."""
        text = ",".join(map(str, value)) if isinstance(value, list) else str(value)
        try:
            return cls(degrees_in(text))
        except PretravelError as error:
            raise ValueError(f"is {quoted(value)}: {error}") from None


def _radians(text: str) -> AngleList:
    return AngleList(DEGREE * angle for angle in AngleList.read(text))


class Levels(tuple[Level, ...]):
    """Values of a factor: numbers, or texts."""

    @classmethod
    def read(cls, value: Any) -> Levels:
        """The values of a list of the file."""
        if not isinstance(value, list) or not value or any(isinstance(v, bool) for v in value):
            raise ValueError(f"must be a list of values, got {quoted(value)}")
        if not (
            all(isinstance(v, str) for v in value) or all(isinstance(v, int | float) for v in value)
        ):
            raise ValueError(f"must be all numbers or all texts, got {quoted(value)}")
        if len(set(value)) < len(value):
            raise ValueError(f"has a value twice: {quoted(value)}")
        return cls(value)


@dataclass(frozen=True)
class Factor:
    """A quantity that a study varies.

    Parameters
    ----------
    key : str
        Its place in the description, or in the tables ``prediction``, ``touch`` and
        ``calibration`` of the study: ``spring.preload_N``, ``stylus.2.length_mm`` (the second
        segment), ``tripod.rod_azimuths_deg.3``, ``prediction.model``.
    values : Levels, optional
        Numbers or texts.
    range : two floats, optional
        Lowest and highest number.
    levels : int
        Values of a range in a plan of single values.
    """

    key: str
    values: Levels | None = None
    range: tuple[float, float] | None = None
    levels: int = 5

    def __post_init__(self) -> None:
        if (self.values is None) == (self.range is None):
            raise PretravelError(f"the factor {self.key} needs either values or a range")
        if self.range is not None and not self.range[0] < self.range[1]:
            raise PretravelError(
                f"the range of {self.key} is {list(self.range)}; the first number must be the "
                "lower one"
            )
        if not 2 <= self.levels <= 1000:
            raise PretravelError(f"{self.key} has {self.levels} levels; 2 to 1000 are possible")

    @property
    def single_values(self) -> tuple[Level, ...]:
        """The values, or `levels` numbers over the range."""
        if self.values is not None:
            return tuple(self.values)
        assert self.range is not None
        low, high = self.range
        return tuple(low + (high - low) * i / (self.levels - 1) for i in range(self.levels))

    @property
    def is_text(self) -> bool:
        """Whether the values are texts."""
        return self.values is not None and isinstance(self.values[0], str)

    def at(self, share: float) -> Level:
        """The value at a share of the range, 0 to 1; of single values, one of them.

        >>> Factor("spring.preload_N", range=(4.0, 6.0)).at(0.25)
        4.5
        >>> Factor("stylus.2.material", Levels(["steel", "ceramic"])).at(0.7)
        'ceramic'
        """
        if self.range is not None:
            return self.range[0] + share * (self.range[1] - self.range[0])
        assert self.values is not None
        return self.values[min(int(share * len(self.values)), len(self.values) - 1)]


@dataclass(frozen=True)
class Directions:
    """The grid of directions that each design is predicted in.

    Parameters
    ----------
    azimuth, polar : tuple of float
        Of the outward surface normals, in the probe's frame. [rad]
    """

    azimuth: AngleList = field(default_factory=lambda: _radians("0:350:10"))
    polar: AngleList = field(default_factory=lambda: _radians("10:90:10"))

    def __post_init__(self) -> None:
        wrong = [angle / DEGREE for angle in self.polar if not 0.0 <= angle <= math.pi + 1e-9]
        if wrong:
            raise PretravelError(
                f"a polar angle is {wrong[0]:g}°; it must lie between 0 (the probe's axis) and 180°"
            )
        for what, angles in (("azimuth", self.azimuth), ("polar angle", self.polar)):
            round_ = [round(angle / DEGREE, 9) % 360.0 for angle in angles]
            if len(set(round_)) < len(round_):
                twice = next(angle for angle in round_ if round_.count(angle) > 1)
                raise PretravelError(
                    f"the {what} {twice:g}° occurs twice (0° and 360° are the same direction) and "
                    "would count twice in the means: leave one of them out"
                )

    @property
    def distinct(self) -> list[int]:
        """Rows of the grid, azimuth after azimuth, without the pole's other azimuths."""
        count = len(self.azimuth)
        return [
            count * row + column
            for row, polar in enumerate(self.polar)
            for column in range(count if math.sin(polar) > 1e-9 else 1)
        ]

    @property
    def has_lobes(self) -> bool:
        """Whether they determine three lobes: an even circle of 7 or more, and walls."""
        azimuth = sorted(angle % (2.0 * math.pi) for angle in self.azimuth)
        step = 2.0 * math.pi / len(azimuth)
        even = all(abs(b - a - step) <= 1e-6 for a, b in pairwise(azimuth))
        return even and len(azimuth) >= 7 and min(self.polar) <= 0.5 * math.pi + 1e-9


@dataclass(frozen=True)
class Study:
    """A study: a probe, what is varied, what is computed.

    Parameters
    ----------
    name : str
    probe : str
        Name of the catalogue, or path of a description, relative to the study's file.
    plan : str
        One of `PLANS`.
    factors : tuple of Factor
    directions : Directions
    outputs : tuple of str
        Of `OUTPUTS`.
    samples : int
        Designs of a Latin hypercube; base samples of a Sobol' plan, which has
        samples × (factors + 2) designs.
    seed : int
    keep_directions : bool
        Whether force, sensing distance and pretravel are kept for each direction.
    prediction, touch, calibration : mapping
        Settings that factors can vary too: see `pretravel.design.studies.conditions`.
    base : mapping
        The tables of the probe's description.
    folder : Path
        To which the files of the description are relative.
    touch_folder : Path
        To which the file of targets is relative.
    """

    name: str
    probe: str
    plan: str
    factors: tuple[Factor, ...]
    directions: Directions
    outputs: tuple[str, ...]
    samples: int
    seed: int
    keep_directions: bool
    prediction: Mapping[str, Any]
    touch: Mapping[str, Any]
    calibration: Mapping[str, Any]
    base: Mapping[str, Any]
    folder: Path
    touch_folder: Path

    def tables(self, levels: Mapping[str, Level]) -> dict[str, Any]:
        """Description and settings with other values at some keys.

        Parameters
        ----------
        levels : mapping of key to value

        Raises
        ------
        PretravelError
            A key that is in no table.
        """
        tables: dict[str, Any] = {
            **copy.deepcopy(dict(self.base)),
            "prediction": dict(self.prediction),
            "touch": dict(self.touch),
            "calibration": dict(self.calibration),
        }
        for key, value in levels.items():
            put(tables, key, value)
        return tables


def put(tables: dict[str, Any], key: str, value: Level) -> None:
    """Set the value at a key of nested tables.

    Parameters
    ----------
    tables : dict
        Changed in place.
    key : str
        Names and numbers from 1, separated by points.
    value : float or str

    Raises
    ------
    PretravelError
        A table, or an element of a list, that does not exist.

    >>> tables = {"stylus": [{"length_mm": 12.0}, {"length_mm": 38.0}]}
    >>> put(tables, "stylus.2.length_mm", 50.0)
    >>> tables["stylus"][1]
    {'length_mm': 50.0}
    """
    *path, last = key.split(".")
    inside: Any = tables
    for step in path:
        if isinstance(inside, list):
            inside = inside[_number_in(inside, step, key)]
        elif isinstance(inside, dict) and step in inside:
            inside = inside[step]
        else:
            raise _no_table(inside, step, key)
    if isinstance(inside, list):
        inside[_number_in(inside, last, key)] = value
    elif isinstance(inside, dict) and path:
        inside[last] = value
    else:
        raise _no_table(inside, last, key)


def _number_in(entries: list[Any], step: str, key: str) -> int:
    if not step.isdigit() or not 1 <= int(step) <= len(entries):
        raise PretravelError(
            f"'{key}': {step} is none of the numbers 1 to {len(entries)} of the list"
        )
    return int(step) - 1


def _no_table(inside: Any, step: str, key: str) -> PretravelError:
    known = ", ".join(inside) if isinstance(inside, dict) else "none"
    return PretravelError(
        f"'{key}': there is no table '{step}'; there are {known}. A key is written as "
        "stylus.2.length_mm"
    )


@dataclass(frozen=True)
class StudySettings:
    """The table ``[study]`` of a file; see `Study`."""

    probe: str = "omp40-2"
    name: str = "study"
    plan: str = "full-factorial"
    outputs: tuple[str, ...] = ("force", "sensing-distance", "pretravel")
    samples: int = 256
    seed: int = 1
    keep_directions: bool = True


@dataclass(frozen=True)
class StudyParts:
    """The tables of a study's file; see `Study`."""

    factor: tuple[Factor, ...]
    study: StudySettings = field(default_factory=StudySettings)
    directions: Directions = field(default_factory=Directions)
    prediction: Mapping[str, Any] = field(default_factory=dict)
    touch: Mapping[str, Any] = field(default_factory=dict)
    calibration: Mapping[str, Any] = field(default_factory=dict)


def structure_with_factors(hint: str) -> TomlStructure:
    """The keys of a file that has factors and directions.

    Parameters
    ----------
    hint : str
        Where to find a whole file.
    """
    structure = TomlStructure(hint=hint)
    structure.table(Directions, azimuth="azimuth_deg", polar="polar_deg")
    structure.value(AngleList, AngleList.read)
    structure.value(Levels, Levels.read)
    structure.value(bool, _truth)
    return structure


@cache
def _structure() -> TomlStructure:
    return structure_with_factors("pretravel studies stylus-length prints a whole study")


def _truth(value: Any) -> bool:
    if not isinstance(value, bool):
        raise ValueError(f"must be true or false, got {quoted(value)}")
    return value


def study_in(document: TomlDocument, folder: Path = Path()) -> Study:
    r"""A study from the tables of its file.

    Parameters
    ----------
    document : TomlDocument
    folder : Path
        To which its paths are relative.

    Raises
    ------
    PretravelError
        Tables or keys that are unknown or missing; an unknown plan or output; a key that the
        description of the probe does not have; too many designs.

    >>> text = '[study]\nplan = "one-at-a-time"\n[[factor]]\nkey = "spring.preload_N"\n'
    >>> study_in(parse_toml(text + "values = [4.0, 5.0]")).factors[0].single_values
    (4.0, 5.0)
    """
    return study_of_parts(_structure().make(document, StudyParts), document, folder)


def load_study(study: str | Path) -> Study:
    """A study by the name of a shipped one, or from a TOML file.

    Raises
    ------
    PretravelError
        Neither such a name nor a file; a file that is not a study.

    >>> load_study("stylus-length").factors[0].key
    'stylus.2.length_mm'
    """
    return study_in(*STUDIES.document(study))


def study_of_parts(
    parts: StudyParts,
    document: TomlDocument,
    folder: Path,
    settings: str = "study",
    factors: str = "factor",
) -> Study:
    """A study from the values of its tables, which are checked together.

    Parameters
    ----------
    parts : StudyParts
    document : TomlDocument
        For the lines in messages.
    folder : Path
        To which paths are relative.
    settings, factors : str
        Names of their tables in the document.

    Raises
    ------
    PretravelError
        See `study_in`.
    """
    table = parts.study
    with document.located(settings):
        _one_of(table.plan, PLANS, "plan")
        for output in table.outputs:
            _one_of(output, OUTPUTS, "outputs")
        if not 1 <= table.samples <= LARGEST_PLAN:
            raise PretravelError(f"samples is {table.samples}; 1 to {LARGEST_PLAN} are possible")
        if not 0 <= table.seed < 2**63:
            raise PretravelError(f"seed is {table.seed}; it must be 0 or more")
    is_name = table.probe in catalogue_names()
    path = table.probe if is_name else folder / table.probe
    if not is_name and not Path(path).is_file():
        raise document.error(
            f"the probe '{table.probe}' is neither in the catalogue ({', '.join(catalogue_names())}"
            f") nor a file in the folder of the study",
            settings,
            "probe",
        )
    if not is_name:
        refuse_named_file("the study", Path(table.probe).name)
    study = Study(
        name=table.name,
        probe=table.probe,
        plan=table.plan,
        factors=parts.factor,
        directions=parts.directions,
        outputs=table.outputs,
        samples=table.samples,
        seed=table.seed,
        keep_directions=table.keep_directions,
        prediction=parts.prediction,
        touch=parts.touch,
        calibration=parts.calibration,
        base=parse_toml(source_text(path), path).tables,
        folder=(folder / table.probe).parent,
        touch_folder=folder,
    )
    _refuse_named_files(study)
    _check_factors(study, document, factors)
    _refuse_unused(study, document, settings, factors)
    return study


def _refuse_unused(study: Study, document: TomlDocument, settings: str, factors: str) -> None:
    """Refuse what is stated and changes nothing: a table of another output, samples of a plan."""
    for number, factor in enumerate(study.factors):
        drawn = "values are drawn from the whole range" if study.plan in _DRAWN else ""
        unused = "it has values" if factor.values is not None else drawn
        if unused and factor.levels != Factor.levels:
            raise document.error(
                f"levels of {factor.key} is not used: {unused}. Leave levels out",
                factors, number, "levels",
            )  # fmt: skip
        if factor.key.startswith("moving."):
            unused = "studies have no direction of gravity, and the weight is neglected"
            raise document.error(
                f"the factor {factor.key} changes nothing: {unused}", factors, number, "key"
            )
    for table in ("touch", "calibration"):
        if table in study.outputs:
            continue
        unused = f"the output {table} alone uses it, and is none of {', '.join(study.outputs)}"
        if getattr(study, table):
            raise document.error(f"the table [{table}] changes nothing: {unused}", table)
        for number, factor in enumerate(study.factors):
            if factor.key.startswith(f"{table}."):
                raise document.error(
                    f"the factor {factor.key} changes nothing: {unused}", factors, number, "key"
                )
    own = document.tables.get(settings, {})
    for key in ("samples", "seed"):
        if study.plan not in _DRAWN and key in own:
            raise document.error(
                f"{key} is not used by the plan {study.plan}, which has all values of the factors: "
                f"leave it out, or choose {' or '.join(_DRAWN)}",
                settings,
                key,
            )


_DRAWN = ("latin-hypercube", "sobol")
"""Plans that draw their designs."""


def _refuse_named_files(study: Study) -> None:
    """Those of the table [touch], and of factors that change it or a part."""
    named = [(f"touch.{key}", study.touch[key]) for key in study.touch]
    named += [(factor.key, value) for factor in study.factors for value in factor.single_values]
    for key, value in named:
        shape = key == "touch.surface" and is_shape(str(value))
        if key.startswith(("touch.", "geometry.")) and isinstance(value, str) and not shape:
            refuse_named_file(f"{key} of the study", value)


def _one_of(name: str, known: Mapping[str, str], key: str) -> None:
    if name not in known:
        raise PretravelError(f"{key} has '{name}'; known are {', '.join(known)}")


def _check_factors(study: Study, document: TomlDocument, table: str) -> None:
    if not study.factors:
        raise document.error(f"at least one [[{table}]] is needed")
    seen = set()
    for number, factor in enumerate(study.factors):
        if factor.key in seen:
            raise document.error(f"the factor {factor.key} occurs twice", table, number, "key")
        seen.add(factor.key)
        if factor.range is None and study.plan == "sobol" and not factor.is_text:
            raise document.error(
                f"the plan sobol needs a range of {factor.key}, not single numbers", table, number
            )
        try:
            study.tables({factor.key: factor.at(0.0)})
        except InputError:
            raise
        except PretravelError as error:
            raise document.error(str(error), table, number, "key") from None
