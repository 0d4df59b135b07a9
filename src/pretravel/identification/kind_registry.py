"""All kinds of map by name, and qualification with any of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Unpack

from threadpoolctl import threadpool_limits

from pretravel.base.errors import PretravelError
from pretravel.identification.average import AUTO, Choice, qualify_on_average
from pretravel.identification.physical import PhysicalKind
from pretravel.maps.basis import MapBasis, StoredBasis
from pretravel.maps.kind import KindOfMap
from pretravel.maps.kinds.averaged import AveragedBasis, stored_parts
from pretravel.maps.kinds.harmonic import HarmonicBasis, HarmonicKind
from pretravel.maps.kinds.mean import MeanBasis, MeanKind
from pretravel.maps.kinds.sectors import SectorBasis, SectorsKind
from pretravel.maps.kinds.tabulated import TabulatedBasis
from pretravel.maps.kinds.wozniak import WozniakBasis, WozniakKind
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import QualificationSetup, SetupOptions
from pretravel.prediction.response import ResponseBasis
from pretravel.prediction.six_seat_basis import SixSeatBasis
from pretravel.qualification import qualification
from pretravel.qualification.delay import several_feeds
from pretravel.qualification.qualification import Qualification
from pretravel.touches import Touches

KINDS: Mapping[str, type[KindOfMap]] = {
    kind.name: kind for kind in (MeanKind, SectorsKind, WozniakKind, HarmonicKind, PhysicalKind)
}
"""Kinds that are fitted to touches, by name. A new kind is one file, listed here."""

BASES: tuple[type[MapBasis], ...] = (
    MeanBasis,
    SectorBasis,
    WozniakBasis,
    HarmonicBasis,
    TabulatedBasis,
    SixSeatBasis,
    ResponseBasis,
)
"""Bases of maps in files."""


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
    if name not in KINDS:
        known = ", ".join([*KINDS, AUTO])
        raise PretravelError(f"map kind '{name}' is not known; there are {known}", inputs=("kind",))
    try:
        return KINDS[name](**settings)
    except TypeError as error:
        raise PretravelError(f"kind {name} has no setting of this name: {error}") from None


def restored_basis(kind: str, stored: StoredBasis) -> MapBasis:
    """The basis of a stored map.

    Raises
    ------
    PretravelError
        A kind that this version does not contain.
    """
    if kind == AveragedBasis.kind:
        return AveragedBasis(tuple(restored_basis(*part) for part in stored_parts(stored)))
    for basis in BASES:
        found = basis.restored(stored) if basis.kind == kind else None
        if found is not None:
            return found
    raise PretravelError(f"maps of kind '{kind}' are not known to this version")


def qualify(
    touches: Touches,
    diameter: float,
    *,
    kind: str | KindOfMap = AUTO,
    **options: Unpack[SetupOptions],
) -> Qualification:
    """Qualify a probe on a reference sphere or ring, with any kind of map.

    Parameters
    ----------
    touches : Touches
        In the order in which they were made.
    diameter : float
        Calibrated diameter of the sphere or ring. [mm]
    kind : str or KindOfMap
        auto: the average of the kinds that predict directions left out of their fits; or one kind:
        mean, sectors, wozniak, harmonic, physical.
    **options
        ring, tip_diameter, u_diameter, u_temperature, sphere_form, axial_pretravel, axis,
        search_outliers: see `QualificationSetup`. Lengths are in mm, also small ones.

    Returns
    -------
    Qualification

    Raises
    ------
    PretravelError
        As `pretravel.qualification.qualification.qualify`; an unknown kind.

    >>> from pretravel.base.directions import sphere_pattern_25
    >>> n = sphere_pattern_25()
    >>> touches = Touches(n * (12.5 + 3.0 - 0.010), n)
    >>> qualify(touches, 25.0, tip_diameter=6.0, kind="mean").pretravel_map.kind
    'mean'
    """
    return choose(touches, setup_of(diameter, options), kind).qualification


def setup_of(diameter: float, options: SetupOptions) -> QualificationSetup:
    """Diameter and keywords as one value."""
    return QualificationSetup(diameter, **options)  # type: ignore[arg-type]  # axis: any array


def choose(
    touches: Touches,
    setup: QualificationSetup,
    kind: str | KindOfMap = AUTO,
    *,
    candidates: Sequence[KindOfMap] = (),
) -> Choice:
    """As `qualify`, with the comparison of kinds that led to the map.

    Parameters
    ----------
    touches : Touches
    setup : QualificationSetup
    kind : str or KindOfMap
    candidates : sequence of KindOfMap
        Kinds with settings of their own, in place of those of the same name that ``auto``
        compares.

    Returns
    -------
    Choice

    Raises
    ------
    PretravelError
        As `qualify`.
    """
    # For matrices of this size threads gain nothing, and cost much on a busy machine.
    with threadpool_limits(1, user_api="blas"):
        return _chosen(touches, setup, kind, candidates)


def _chosen(
    touches: Touches,
    setup: QualificationSetup,
    kind: str | KindOfMap,
    candidates: Sequence[KindOfMap],
) -> Choice:
    if kind == AUTO:
        kinds = {name: made() for name, made in KINDS.items()}
        kinds |= {candidate.name: candidate for candidate in candidates}
        return qualify_on_average(touches, setup, kinds)
    chosen = kind_named(kind) if isinstance(kind, str) else kind
    return Choice(qualification.qualify(touches, setup, chosen), chosen.name, ())


def qualify_like(
    touches: Touches, earlier: PretravelMap, diameter: float, *, ring: bool = False
) -> Qualification:
    """A new map of the same kind and with the same setup as an earlier one.

    Parameters
    ----------
    touches : Touches
        New ones on the reference.
    earlier : PretravelMap
        Of a qualification.
    diameter : float
        Of the reference. [mm]
    ring : bool
        The reference is a ring.

    Returns
    -------
    Qualification

    Raises
    ------
    PretravelError
        As `qualify`; a map with a signal delay and touches that do not determine one.

    Notes
    -----
    Maps of earlier versions do not contain their setup. What they contain is used: tip, axis and
    the uncertainty of the radius, which is half that of the reference's diameter.
    """
    if earlier.delay is not None and not several_feeds(touches):
        raise PretravelError(
            "the old map contains the signal delay, which touches at one feed do not determine; "
            "touch the reference at two feeds"
        )
    made = earlier.provenance
    setup = made.setup or QualificationSetup(
        diameter,
        tip_diameter=2.0 * earlier.tip_radius,
        u_diameter=2.0 * earlier.u_tip_radius,
        u_temperature=0.0,
        sphere_form=0.0,
        axis=tuple(earlier.rotation[:, 2]),
    )
    setup = replace(setup, diameter=diameter, ring=ring)
    if earlier.kind == AveragedBasis.kind:
        return choose(touches, setup).qualification
    kind = kind_named(earlier.kind, **made.kind_settings)
    return qualification.qualify(touches, setup, kind)
