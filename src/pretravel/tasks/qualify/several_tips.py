"""The tips of a star stylus as they are stated, and what comes of them."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple, Self

from pretravel.base import MICROMETRE, TIP_BALL, PretravelError, checked
from pretravel.task import PAGES, Field, Result, Task, UnitVector, When

if TYPE_CHECKING:
    from collections.abc import Mapping

    from pretravel.files import FileReadings
    from pretravel.measurement import Points, StarStylus
    from pretravel.qualification import Qualification
    from pretravel.show import Document
    from pretravel.task import LaboratoryReport

TIP_ENDINGS = (".json", *PAGES)
"""Of the output of several tips."""
_TIP = re.compile(r"([^=@,/]+)=(\d++(?:\.\d*+)?|\.\d++)(?:@([-\d.,]+))?")


def _with_diameters(tips: object) -> bool:
    """A project can state anything."""
    return any("=" in str(tip) for tip in (tips if isinstance(tips, list | tuple) else (tips,)))


STAR = When("tip", is_so=_with_diameters, what="several tips")
"""The mode of several tips; a name alone chooses the touches of one."""


class StatedTip(str):
    """A tip as it is typed: ``front=4@0,1,0``, or its name alone."""

    @property
    def is_name(self) -> bool:
        """Whether it is the name alone."""
        return "=" not in self

    @property
    def parts(self) -> TipParts:
        """Its name, diameter and axis."""
        match = _TIP.fullmatch(self)
        assert match is not None  # checked where it was typed
        name, diameter, axis = match.groups()
        return TipParts(name, float(diameter), UnitVector.parse(axis or "0,0,1"))

    @classmethod
    def parse(cls, text: str) -> Self:
        """Check a tip that is typed: its name, or with its diameter and axis.

        >>> StatedTip.parse("front=4@0,1,0").parts.diameter
        4.0
        """
        if text.strip() and not set("=@/") & set(text):
            return cls(text)  # the name alone: its touches are taken
        if not _TIP.fullmatch(text):
            raise PretravelError(
                f"'{text}': a tip is NAME=DIAMETER@X,Y,Z, for example front=4@0,1,0: its diameter "
                "in mm, and the direction from the tip to its hub (0,0,1 where it is left out)"
            )
        found = cls(text)
        checked(found.parts.diameter, "the tip's diameter", TIP_BALL)
        return found


class TipParts(NamedTuple):
    """What is stated of a tip: diameter in mm, and direction from the tip to its hub."""

    name: str
    diameter: float
    axis: UnitVector


class OfSeveralTips(Task):
    """Settings of a qualification of several tips."""

    tip: Annotated[
        tuple[StatedTip, ...],
        Field(
            help="One tip of several, by name, diameter in mm and direction from the tip to its "
            "hub, such as front=4@0,1,0. Repeat the option "
            "for each tip: --tip down=6 --tip front=4@0,1,0. The column tip of the file "
            "contains the names; the default direction is 0,0,1. All tips touch the same "
            "sphere, which is not moved; offsets refer to the first tip. A name alone: use "
            "only the touches of this tip.",
            states="--tip gives the diameter and axis of each tip, and all tips touch one sphere",
            without=("block", "reference"),
            metavar="NAME=D@X,Y,Z",
        ),
    ] = ()

    @property
    def star(self) -> tuple[StatedTip, ...]:
        """The tips that are qualified together.

        Raises
        ------
        PretravelError
            Some are stated by their names alone, others with their diameters; one is stated twice.
        """
        names = [str(one).partition("=")[0] for one in self.tip]
        if len(set(names)) < len(names):
            again = next(name for name in names if names.count(name) > 1)
            raise PretravelError(
                f"the tip {again} is given twice; state each tip once", inputs=("tip",)
            )
        named = [one for one in self.tip if one.is_name]
        if named and len(self.tip) > 1:
            raise PretravelError(
                f"the tip {named[0]} is given without its diameter: one tip is chosen by its name "
                "alone, several are given with their diameters, such as front=4@0,1,0",
                inputs=("tip",),
            )
        return () if named else self.tip

    @property
    def chosen_tip(self) -> str | None:
        """The one tip that is chosen by its name."""
        return str(self.tip[0]) if self.tip and not self.star else None


@dataclass(frozen=True, eq=False)
class QualifiedTips(Result):
    """The tips of a star stylus, each with its qualification.

    Attributes
    ----------
    task : LaboratoryReport
    touches_name : str
        Of the touches, in titles.
    readings : FileReadings
    qualifications : mapping of str to Qualification
    star : StarStylus
    """

    task: LaboratoryReport
    touches_name: str
    readings: FileReadings
    qualifications: Mapping[str, Qualification]
    star: StarStylus

    def document(self) -> Document:
        """The report, with what the laboratory states."""
        import numpy as np

        from pretravel.show import Column, Digits, Document, KeyFigure, Table, decimals
        from pretravel.task import with_laboratory

        star, made = self.star, list(self.qualifications.values())
        offsets = np.array([star.offset(name) for name in star.names])
        u, of_points = (
            np.array([np.sqrt(np.diag(star.offset_covariance(n, of_points=p))) for n in star.names])
            for p in (False, True)
        )
        two = Digits(2, significant=True)
        table = Table(
            (
                Column.of("tip", star.names),
                *(Column.of(a, offsets[:, i], "mm", decimals(4)) for i, a in enumerate("xyz")),
                *(
                    Column.of(f"u {a}", u[:, i] / MICROMETRE, "µm", two)
                    for i, a in enumerate("xyz")
                ),
                Column.of("u of points", of_points.max(axis=1) / MICROMETRE, "µm", two),
                Column.of("repeats to", [q.repeatability / MICROMETRE for q in made], "µm", two),
            ),
            f"Offsets of the tips from {star.names[0]}:",
            "u: of the offset, including the part by which a centre and its map cannot be "
            "separated. u of points: the largest u that the offset adds to points compensated with "
            "these maps.",
        )
        warnings = [f"tip {n}: {w}" for n, q in self.qualifications.items() for w in q.warnings]
        report = Document(
            title=f"{self.touches_name}: {len(made)} tips on one sphere",
            verdict=f"{len(made)} tips, each with its map and its offset from {star.names[0]}",
            figures=tuple(
                KeyFigure(f"effective radius, {name}", q.effective_radius, "mm", decimals(5),
                          u=q.u_effective_radius / MICROMETRE, u_unit="µm", u_digits=two)
                for name, q in self.qualifications.items()
            ),
            tables=(table,),
            warnings=(*self.readings.notes(), *warnings, *self.task.statement_warnings()),
        )  # fmt: skip
        return with_laboratory(report, self.task.statements())

    def write(self, output: str, path: Path) -> None:
        """Write all tips to one file."""
        del output
        from pretravel.files import write_star

        write_star(path, self.star)


@dataclass(frozen=True, eq=False)
class CompensatedTips(Result):
    """Surface points of several tips.

    Attributes
    ----------
    touches_name : str
        Of the touches, in titles.
    readings : FileReadings
    star : StarStylus
    points : Points
        In the frame of the first tip.
    """

    touches_name: str
    readings: FileReadings
    star: StarStylus
    points: Points

    def document(self) -> Document:
        """The report."""
        from pretravel.tasks.compensate import points_document

        document = points_document(
            self.points, touches_name=self.touches_name, warnings=self.readings.notes()
        )
        note = f"Points are in the frame of the tip {self.star.names[0]}."
        return replace(document, notes=(*document.notes, note))

    def write(self, output: str, path: Path) -> None:
        """Write the points."""
        del output
        from pretravel.files import write_points

        touches = self.readings.touches
        note = f"{self.touches_name} compensated with the tips {', '.join(self.star.names)}"
        write_points(path, self.points, note, nominal_points=touches.nominal_points)
