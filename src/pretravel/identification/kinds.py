"""Qualification with every kind of map, physical among them, and the choice of kind."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pretravel.errors import PretravelError
from pretravel.identification.kind_choice import KindScore, compare_kinds
from pretravel.identification.physical import MISFIT_LEVEL, PhysicalMapFit, fit_physical
from pretravel.qualification import qualification
from pretravel.qualification.map_fit import KINDS, Kind
from pretravel.qualification.qualification import FitMap, Qualification
from pretravel.touches import Touches

ALL_KINDS: Mapping[str, Kind | FitMap] = {kind: kind for kind in KINDS} | {"physical": fit_physical}
AUTO = "auto"
FEW_DIRECTIONS = 15
"""Below this a physical map is warned about."""


@dataclass(frozen=True, eq=False)
class Choice:
    """A qualification with how its kind compared with the others.

    Attributes
    ----------
    qualification : Qualification
    kind : str
    scores : list of KindScore
        The best first; empty where the kind was told.
    """

    qualification: Qualification
    kind: str
    scores: tuple[KindScore, ...]


def qualify(
    touches: Touches, diameter: float, *, kind: str = "harmonic", **settings: Any
) -> Qualification:
    """Qualify a probe on a reference sphere or ring, with any kind of map.

    Parameters
    ----------
    touches : Touches
    diameter : float
        Calibrated diameter of the sphere or ring. [mm]
    kind : str
        mean, sectors, wozniak, harmonic, physical; or auto, the one of them that predicts
        touches left out of its fit best.
    **settings
        As `pretravel.qualification.qualification.qualify` takes them: ring, tip_diameter,
        u_diameter, axis, ...

    Returns
    -------
    Qualification

    Raises
    ------
    PretravelError
        As there; an unknown kind.

    >>> from pretravel.directions import sphere_pattern_25
    >>> n = sphere_pattern_25()
    >>> touches = Touches(n * (12.5 + 3.0 - 0.010), n)
    >>> qualify(touches, 25.0, tip_diameter=6.0, kind="mean").pretravel_map.kind
    'mean'
    """
    return choose(touches, diameter, kind=kind, **settings).qualification


def choose(touches: Touches, diameter: float, *, kind: str = AUTO, **settings: Any) -> Choice:
    """As `qualify`, with the comparison that led to the kind.

    Parameters, errors: see `qualify`.

    Returns
    -------
    Choice
    """
    if kind != AUTO and kind not in ALL_KINDS:
        known = ", ".join([*ALL_KINDS, AUTO])
        raise PretravelError(f"map kind '{kind}' is not known; there are {known}")
    scores: list[KindScore] = []
    if kind == AUTO:
        scores = compare_kinds(touches, diameter, ALL_KINDS, **settings)
        kind = scores[0].kind
        if scores[0].problem:
            raise PretravelError(f"no kind of map fits these touches: {scores[0].problem}")
    chosen: Any = ALL_KINDS[kind]
    result = qualification.qualify(touches, diameter, kind=chosen, **settings)
    return Choice(result, kind, tuple(scores))


def physical_warnings(result: Qualification) -> list[str]:
    """What to know before believing a physical map, as sentences; empty for other kinds."""
    fit = result.fit
    if not isinstance(fit, PhysicalMapFit):
        return []
    found = []
    count = int(result.groups.max()) + 1
    if count < FEW_DIRECTIONS:
        found.append(
            f"{count} directions are few for a six-seat probe: another one may explain them as "
            "well, and u of the map does not know that; touch 25"
        )
    if fit.misfit < MISFIT_LEVEL:
        found.append(
            "this probe is not quite of the six-seat kind: the residuals are larger than repeats "
            f"scatter (chance {fit.misfit:.2g} for a good one). What the model misses is in u of "
            "the map; compare with --kind auto"
        )
    return found
