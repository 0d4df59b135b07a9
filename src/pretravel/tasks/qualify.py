"""Qualify a probe: touches on a reference, from files, to a map and its report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

from pretravel.base.errors import PretravelError
from pretravel.files.file_format import FileReadings
from pretravel.maps.kinds import AUTO, KINDS
from pretravel.maps.kinds.wozniak import WozniakKind
from pretravel.maps.pretravel_map import PretravelMap
from pretravel.maps.provenance import QualificationSetup
from pretravel.qualification.qualification import KindScore, Qualification
from pretravel.qualification.qualify import choose
from pretravel.show.document import Document
from pretravel.tasks.reports.qualification_report import qualification_document

Transducer: TypeAlias = Literal["contact", "piezo"]


@dataclass(frozen=True)
class KindWish:
    """Which kind of map is wanted.

    Attributes
    ----------
    name : str
        "auto": the average of the kinds that predict left-out directions.
    lobe_azimuth : float or None
        Kind wozniak: azimuth of the largest pretravel. [rad]
    transducer : str
        Kind wozniak: "contact" (the map has lobes) or "piezo" (it has none).

    Raises
    ------
    PretravelError
        A setting of kind wozniak for another kind; lobes of a probe that has none.

    >>> KindWish("mean", lobe_azimuth=0.5)
    Traceback (most recent call last):
    ...
    pretravel.base.errors.PretravelError: the azimuth of a lobe and the transducer are only for ...
    """

    name: str = AUTO
    lobe_azimuth: float | None = None
    transducer: Transducer = "contact"

    def __post_init__(self) -> None:
        stated = self.lobe_azimuth is not None or self.transducer != "contact"
        if stated and self.name not in (WozniakKind().name, AUTO):
            raise PretravelError(
                "the azimuth of a lobe and the transducer are only for kind wozniak",
                inputs=("lobe_azimuth", "transducer", "kind"),
            )
        if self.lobe_azimuth is not None and self.transducer == "piezo":
            raise PretravelError(
                "a piezo probe has no lobes: leave the azimuth of the lobe out",
                inputs=("lobe_azimuth",),
            )

    @property
    def wozniak(self) -> WozniakKind:
        """The kind wozniak with its settings, which no other kind has."""
        return WozniakKind(self.lobe_azimuth, self.transducer)


def kind_names() -> list[str]:
    """The names that a wish can have."""
    return [*KINDS, AUTO]


@dataclass(frozen=True)
class QualifiedProbe:
    """A qualification with the touches that it is of.

    Attributes
    ----------
    readings : FileReadings
    qualification : Qualification
    scores : tuple of KindScore
        How the kinds of map predict left-out directions, where the kind was chosen.
    """

    readings: FileReadings
    qualification: Qualification
    scores: tuple[KindScore, ...] = field(default=())

    @property
    def pretravel_map(self) -> PretravelMap:
        """The map of the probe."""
        return self.qualification.pretravel_map

    def document(
        self,
        touches_name: str = "",
        *,
        warnings: Sequence[str] = (),
        excluded: Sequence[str] = (),
        saved: bool = True,
    ) -> Document:
        """The report; parameters as those of `qualification_document`."""
        return qualification_document(
            self.qualification,
            touches_name=touches_name,
            scores=self.scores,
            warnings=[*self.readings.notes(), *warnings],
            excluded=excluded,
            saved=saved,
        )


def qualify_probe(
    readings: FileReadings, setup: QualificationSetup, wish: KindWish = KindWish()
) -> QualifiedProbe:
    """Qualify a probe on the touches of files.

    Parameters
    ----------
    readings : FileReadings
        From `read_series`, in the axes of the machine.
    setup : QualificationSetup
    wish : KindWish

    Returns
    -------
    QualifiedProbe

    Raises
    ------
    PretravelError
        The touches do not determine a map.
    """
    wozniak = wish.wozniak
    chosen = wozniak if wish.name == wozniak.name else wish.name
    choice = choose(readings.touches, setup, chosen, candidates=[wozniak])
    return QualifiedProbe(readings, choice.qualification, tuple(choice.scores))
