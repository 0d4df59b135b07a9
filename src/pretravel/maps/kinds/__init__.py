"""The kinds of map, one file each: functions, fit, form in files, form on controls.

A kind is two classes: a `KindOfMap`, which is its fit, and a `MapBasis`, which is its functions.
Those of this package are listed in `KINDS`; another package adds its own by an entry point.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pretravel.base import Plugins, PretravelError
from pretravel.maps.basis import MapBasis, StoredBasis
from pretravel.maps.kind import KindOfMap

ENTRY_POINTS = "pretravel.kinds"
"""Group of entry points: the name of a kind, and where its `KindOfMap` is."""
AUTO = "auto"
"""The word for an average of kinds, instead of one of them."""

KINDS: Plugins[KindOfMap] = Plugins(
    ENTRY_POINTS,
    own={
        "mean": "pretravel.maps.kinds.mean:MeanKind",
        "sectors": "pretravel.maps.kinds.sectors:SectorsKind",
        "wozniak": "pretravel.maps.kinds.wozniak:WozniakKind",
        "harmonic": "pretravel.maps.kinds.harmonic:HarmonicKind",
        "physical": "pretravel.six_seats.physical:PhysicalKind",
    },
    make=lambda kind: kind(),
)
"""What `kinds` returns."""


def kinds() -> Mapping[str, KindOfMap]:
    """All kinds that are fitted to touches, by name.

    Returns
    -------
    mapping of str to KindOfMap
        Those of this package, then those of others: a package that states
        ``belt = "its_module:BeltKind"`` in its group of entry points ``pretravel.kinds`` adds one.

    >>> list(kinds())[:3], kinds()["mean"].title
    (['mean', 'sectors', 'wozniak'], 'one radius for all')
    """
    return KINDS


def kind_named(name: str, **settings: Any) -> KindOfMap:
    """A kind of map by its name.

    Parameters
    ----------
    name : str
    **settings
        Fields of the kind itself, such as ``lobe_azimuth`` of wozniak.

    Raises
    ------
    PretravelError
        No such kind; a setting that it does not have.

    >>> kind_named("wozniak", transducer="piezo").transducer
    'piezo'
    """
    if name not in kinds():
        known = ", ".join([*kinds(), AUTO])
        raise PretravelError(f"map kind '{name}' is not known; there are {known}", inputs=("kind",))
    try:
        return type(kinds()[name])(**settings)
    except TypeError as error:
        raise PretravelError(f"kind {name} has no setting of this name: {error}") from None


def restored_basis(kind: str, stored: StoredBasis) -> MapBasis:
    """The basis of a stored map.

    Raises
    ------
    PretravelError
        A kind that this version does not contain.
    """
    from pretravel.maps.kinds.averaged import AveragedBasis, stored_parts
    from pretravel.maps.kinds.tabulated import TabulatedBasis

    if kind == AveragedBasis.kind:
        return AveragedBasis(tuple(restored_basis(*part) for part in stored_parts(stored)))
    if kind == TabulatedBasis.kind:
        return TabulatedBasis.restored(stored)
    for basis in kinds()[kind].bases if kind in kinds() else ():
        found = basis.restored(stored)
        if found is not None:
            return found
    raise PretravelError(f"maps of kind '{kind}' are not known to this version")
