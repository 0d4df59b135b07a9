"""Qualify without a sphere: on blocks, pins, bores, several references in one fit."""

from __future__ import annotations

import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Self

from pretravel.base import MICROMETRE, REFERENCE_DIAMETER, PretravelError, checked
from pretravel.task import PAGES, Field, Progress, Result, Task
from pretravel.tasks.qualify.several_tips import STAR

if TYPE_CHECKING:
    from pretravel.files import FileReadings, ReadingOptions
    from pretravel.maps import SetupOptions
    from pretravel.qualification import Qualification, Reference, ReferenceFit
    from pretravel.show import Document
    from pretravel.task import LaboratoryReport
    from pretravel.touches import Touches

_PPM = 1e-6
_USUAL_FORM = 1.0 * MICROMETRE
"""Of a block, where none is stated: parallel faces of a good 1-2-3 block."""
_REFERENCE = re.compile(r"([^=:@/,]+)=([a-z]+)(?::([^:]+))?(?::(\d++(?:\.\d*+)?|\.\d++))?")


class Lengths(tuple[float, ...]):
    """Distances of opposite faces. [mm]"""

    def __str__(self) -> str:
        return ",".join(f"{length:.12g}" for length in self)

    @classmethod
    def parse(cls, text: str) -> Self:
        """One length of a block, or three.

        >>> Lengths.parse("25.4,50.8,76.2")
        (25.4, 50.8, 76.2)
        """
        cells = text.split(",")
        if len(cells) not in (1, 3):
            raise PretravelError(
                f"'{text}': a block has one length, 50.8, or three along x, y and z, 25.4,50.8,76.2"
            )
        lengths = (checked(cell, "a length of the block", REFERENCE_DIAMETER) for cell in cells)  # type: ignore[arg-type]  # text too
        return cls(lengths)


class StatedReference(str):
    """A reference as it is typed: ``ring=ring:50.0003:0.3``."""

    @classmethod
    def parse(cls, text: str) -> Self:
        """Check a reference that is typed.

        >>> StatedReference.parse("plug=pin:unknown")
        'plug=pin:unknown'
        """
        if not _REFERENCE.fullmatch(text):
            raise PretravelError(
                f"'{text}': a reference is NAME=SHAPE:SIZE:u, for example r50=ring:50.0003:0.3 "
                "(size in mm, its standard uncertainty u in µm) or hole=ring:unknown"
            )
        return cls(text)


class OnReferences(Task):
    """Settings of a qualification without a sphere."""

    pin: Annotated[
        bool,
        Field(
            help="The reference is a pin or boss, touched from outside all around. Use --ring for "
            "a ring or bore, touched from inside. Touches may be at several heights.",
            label="The reference is a pin or boss",
            without=("ring", "block", "reference", STAR),
        ),
    ] = False
    unknown_size: Annotated[
        bool,
        Field(
            help="The diameter of the reference is not known: only the shape of the map is "
            "determined, not its mean.",
            label="The diameter is not known",
            without=("block", "reference", STAR),
        ),
    ] = False
    block: Annotated[
        Lengths | None,
        Field(
            help="The reference is a gauge block, a 1-2-3 block or a pair of parallels (lengths "
            "in mm). Give the calibrated distance of opposite faces (50.8), or the three "
            "distances along x, y and z with the block not turned (25.4,50.8,76.2). The column "
            "reference of the file gives the turn of the block in degrees: block@90.",
            metavar="L or X,Y,Z",
            states="a block or a reference gives its shape and size itself",
        ),
    ] = None
    reference: Annotated[
        tuple[StatedReference, ...],
        Field(
            help="One of several references that are fitted together, with SIZE in mm and u in µm, "
            "such as r50=ring:50.0003:0.3. NAME: as in the column reference or at "
            "the beginning of the labels (r50/1); SHAPE: block, ring (bore), pin (boss) or sphere; "
            "SIZE may be unknown; u: standard uncertainty of the size. May be repeated.",
            metavar="NAME=SHAPE:SIZE:u",
            states="a block or a reference gives its shape and size itself",
        ),
    ] = ()
    u_scale_ppm: Annotated[
        float | None,
        Field(
            help="Standard uncertainty of the scales of the machine, in µm/m, if it is known, "
            "for example 20; 0: the scales are exact.",
            range=(0.0, 1e5),
            unit="µm/m",
            only=("block", "reference"),
        ),
    ] = None
    u_squareness_ppm: Annotated[
        float | None,
        Field(
            help="Standard uncertainty of the squareness of the machine's axes, in µm/m.",
            range=(0.0, 1e5),
            unit="µm/m",
            only=("block", "reference"),
        ),
    ] = None
    u_backlash_um: Annotated[
        float | None,
        Field(
            help="Standard uncertainty of the backlash of the machine's axes, in µm; 0 for axes "
            "with linear scales.",
            range=(0.0, 1000.0),
            only=("block", "reference"),
        ),
    ] = None

    @property
    def on_references(self) -> bool:
        """Whether the touches are on a block or on several references."""
        return self.block is not None or bool(self.reference)


def size_warnings(task: OnReferences) -> list[str]:
    """What a size that is not known leaves open."""
    if not task.unknown_size:
        return []
    return [
        (
            "the size of the reference is not known: the shape of the map is determined, its mean "
            "is not (taken as zero, u = 25 µm). Differences between directions and positions of "
            "centres are right, sizes and distances from a face are not"
        )
    ]


def references_of(
    task: OnReferences, *, u_usual: float, u_temperature: float, form: float | None
) -> list[Reference]:
    """The references that are stated.

    Parameters
    ----------
    task : OnReferences
    u_usual : float
        Standard uncertainty of a size whose own is not stated. [mm]
    u_temperature : float
        [K]
    form : float or None
        Deviation of form; None for that of a usual block. [mm]

    Raises
    ------
    PretravelError
        Two of one name.
    """
    from pretravel.qualification import Reference

    common = {"u_temperature": u_temperature, "form": _USUAL_FORM if form is None else form}
    found = []
    if task.block is not None:
        found.append(Reference("block", "block", tuple(task.block), u_usual, **common))
    for text in task.reference:
        match = _REFERENCE.fullmatch(text)
        assert match is not None  # checked where it was typed
        name, shape, size, u = match.groups()
        sizes: Sequence[float] = ()
        if size not in (None, "unknown"):
            sizes = Lengths.parse(size)
        u_size = u_usual if u is None else float(u) * MICROMETRE
        found.append(Reference(name, shape, tuple(sizes), u_size, **common))
    names = [one.name for one in found]
    double = [name for name in names if names.count(name) > 1]
    if double:
        raise PretravelError(
            f"two references are called {double[0]}", inputs=("reference", "block")
        )
    return found


def on_references(options: ReadingOptions, references: Sequence[Reference]) -> ReadingOptions:
    """What is known of the files: work offsets move references as a whole, without a plan.

    The touches of one round reference alone get their normals from its centre.
    """
    options = replace(options, anywhere=options.plan is None)
    shape = references[0].shape if len(references) == 1 else ""
    size = references[0].sizes[0] if len(references) == 1 and references[0].sizes else None
    if shape in ("ring", "pin"):
        return replace(options, ring=True, pin=shape == "pin", reference_diameter=size)
    return replace(options, reference_diameter=size) if shape == "sphere" else options


def fitted_references(
    task: OnReferences,
    touches: Touches,
    references: Sequence[Reference],
    setup: SetupOptions,
    progress: Progress,
) -> tuple[ReferenceFit, tuple[Reference, Qualification] | None]:
    """Fit touches on blocks or several references; a round one among them gives the map.

    Parameters
    ----------
    task : OnReferences
    touches : Touches
        In the axes of the machine.
    references : sequence of Reference
    setup : SetupOptions
        Of the map.
    progress : Progress

    Returns
    -------
    fit : ReferenceFit
    qualified : tuple of Reference and Qualification, or None
    """
    import numpy as np

    from pretravel.maps import MachinePriors, priors_of
    from pretravel.qualification import (
        contradicted_priors,
        fit_references,
        qualified_beside_others,
    )

    backlash = task.u_backlash_um
    priors = priors_of(
        u_scale=None if task.u_scale_ppm is None else task.u_scale_ppm * _PPM,
        u_squareness=None if task.u_squareness_ppm is None else task.u_squareness_ppm * _PPM,
        u_backlash=None if backlash is None else backlash * MICROMETRE,
    )
    with progress.working(f"fitting {len(touches)} touches on {len(references)} references"):
        tip = setup["tip_diameter"]
        found = fit_references(touches, references, tip_diameter=tip, priors=priors)
        if np.any(priors.deviations < MachinePriors().deviations):
            with suppress(PretravelError):  # more unknowns than the touches determine
                free = fit_references(touches, references, tip_diameter=tip)
                said = contradicted_priors(free, priors.deviations)
                found = replace(found, warnings=(*found.warnings, *said))
    with progress.working("qualifying on the round reference"):
        return found, qualified_beside_others(touches, references, found, setup)


@dataclass(frozen=True, eq=False)
class QualifiedReferences(Result):
    """What touches on references say of the machine and the probe.

    Attributes
    ----------
    task : LaboratoryReport
    touches_name : str
        Of the touches, in titles.
    readings : FileReadings
    references : tuple of Reference
    fit : ReferenceFit
    qualified : tuple of Reference and Qualification, or None
        The map of the touches on a round reference, without the terms of the machine.
    """

    task: LaboratoryReport
    touches_name: str
    readings: FileReadings
    references: tuple[Reference, ...]
    fit: ReferenceFit
    qualified: tuple[Reference, Qualification] | None = None

    def document(self) -> Document:
        """The report, with what the laboratory states."""
        from pretravel.task import with_laboratory
        from pretravel.tasks.qualify.references_report import reference_document

        report = reference_document(
            self.fit,
            self.references,
            touches_name=self.touches_name,
            qualified=self.qualified,
            warnings=[*self.readings.notes(), *self.task.statement_warnings()],
        )
        return with_laboratory(report, self.task.statements())

    def write(self, output: str, path: Path) -> None:
        """Write the map (.json), or every term as a table (.csv)."""
        del output
        from pretravel.files import write_csv_table, write_map
        from pretravel.tasks.qualify.references_report import term_columns

        if path.suffix.lower() == ".csv":
            write_csv_table(path, term_columns(self.fit))
        elif self.qualified is None:
            raise without_map(path)
        else:
            write_map(path, self.qualified[1])


def without_map(path: Path) -> PretravelError:
    """What to say where a map is wanted of touches on blocks alone."""
    return PretravelError(
        f"{path.name}: touches on blocks determine terms of the machine and the pretravel in the "
        "touched directions (written as .csv or as a page), not a map. For a map, touch also a "
        "sphere, a ring or a pin of known size",
        inputs=("output",),
    )


TERM_ENDINGS = (".json", ".csv", *PAGES)
"""Of the output of touches on references."""
