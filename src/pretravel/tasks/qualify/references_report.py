"""Report and picture of touches on blocks and several references: machine, sizes, pretravel."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from pretravel.base import MICROMETRE
from pretravel.qualification import Qualification, Reference, ReferenceFit, Term
from pretravel.show import (
    Axis,
    Column,
    Digits,
    Document,
    Dots,
    KeyFigure,
    Picture,
    PlaneChart,
    Rule,
    Section,
    Table,
    View,
    decimals,
    value_text,
)
from pretravel.tasks.qualify.report import qualification_document

_PPM = 1e-6


def _scale(term: Term) -> tuple[float, str]:
    """Unit of a term as it is shown."""
    ratio = term.name.startswith(("scale", "squareness"))
    return (_PPM, "µm/m") if ratio else (MICROMETRE, "µm")


def reference_document(
    fit: ReferenceFit,
    references: Sequence[Reference],
    *,
    touches_name: str = "",
    qualified: tuple[Reference, Qualification] | None = None,
    warnings: Sequence[str] = (),
) -> Document:
    """The report of a fit of several references.

    Parameters
    ----------
    fit : ReferenceFit
    references : sequence of Reference
    touches_name : str
    qualified : tuple of Reference and Qualification, or None
        The map of the touches on one of them.
    warnings : sequence of str
    """
    known = [term for term in fit.terms if term.determined]
    words = f"{len(known)} of {len(fit.terms)} terms of the machine are determined"
    figures = [
        KeyFigure("noise of a touch", fit.noise / MICROMETRE, "µm", decimals(2),
                  remark=f"{fit.dof:.0f} degrees of freedom"),
        *(_figure(term) for term in fit.terms),
        *(_figure(pair) for pair in fit.pairs),
        *(_length_figure(size) for size in fit.sizes),
    ]  # fmt: skip
    pictures = [
        Picture("Errors of the machine with U, and the residuals", lambda: reference_view(fit))
    ]
    sections: tuple[Section, ...] = ()
    said = list(warnings)
    if qualified is not None:
        reference, made = qualified
        report = qualification_document(made, touches_name=touches_name, scores=made.scores)
        heading = f"Map of the touches on {reference.name}, without the terms of the machine"
        sections = (report.as_section(heading),)
        pictures = [*report.pictures[:1], *pictures]
        said = [*said, *report.warnings, *_in_the_map(fit)]
    return Document(
        title=f"{touches_name or 'Touches'}: machine and probe on {_names(references)}",
        verdict=words if fit.terms else "pretravel in the directions that were touched",
        figures=tuple(figures),
        tables=(_directions_table(fit),),
        sections=sections,
        pictures=tuple(pictures),
        notes=(
            (
                "U with k by Student's distribution, for 95 %. A term that is not determined "
                "is listed with what these touches do not distinguish from it."
            ),
            *_assumptions(references),
            *_same_directions(fit, references),
        ),
        warnings=(*said, *fit.warnings),
        data=(Table.of(term_columns(fit), "Terms"),),
    )


def _in_the_map(fit: ReferenceFit) -> list[str]:
    """Terms of the machine that the map contains, because they are not distinguished from it."""
    left = [term.name for term in fit.terms if not term.determined]
    if not left:
        return []
    return [
        (
            f"the map and what it compensates contain the {', '.join(left)} of the machine, which "
            "these touches do not determine"
        )
    ]


def _names(references: Sequence[Reference]) -> str:
    return ", ".join(f"{one.name}" if one.name == one.shape else f"{one.name} ({one.shape})"
                     for one in references)  # fmt: skip


def _assumptions(references: Sequence[Reference]) -> list[str]:
    known = [one for one in references if one.sizes]
    if not known:
        return ["No size is known: the scale of the machine is not determined."]
    return [
        f"{one.name}: {', '.join(f'{size:g}' for size in one.sizes)} mm with u = "
        f"{one.u_size / MICROMETRE:g} µm"
        + (f", faces parallel to {one.form / MICROMETRE:g} µm" if one.shape == "block" else "")
        for one in known
    ]


def _same_directions(fit: ReferenceFit, references: Sequence[Reference]) -> list[str]:
    """What separates scale and pretravel, where several sizes are known and did not."""
    open_scales = [
        term.name
        for term in fit.terms
        if term.name.startswith("scale") and not term.determined and "pretravel" in term.told_from
    ]
    if not open_scales or sum(bool(one.sizes) for one in references) < 2:
        return []
    said = (
        f"To determine the {', '.join(open_scales)}, touch the references in the same directions: "
        "their pretravel is one if their normals differ by less than 1°."
    )
    return [said]


def _digits(u: float) -> Digits:
    """Decimals of a value by its uncertainty, both in the unit that is shown."""
    if not u > 0.0 or not math.isfinite(u):
        return Digits(1, signed=True)
    return Digits(min(max(1 - math.floor(math.log10(u)), 0), 3), signed=True)


def _figure(term: Term) -> KeyFigure:
    unit, name = _scale(term)
    title, _, more = term.name.partition(", ")
    if title.startswith("squareness"):
        title, more = term.name, ""
    more = f"; {more}" if more else ""
    if not term.determined:
        others = " or ".join(term.told_from)
        why = f"; cannot be distinguished from {others}" if others else "; nothing touched shows it"
        return KeyFigure(title, f"not determined{why}{more}")
    u = term.expanded / unit
    digits = Digits(_digits(u).count)
    return KeyFigure(title, term.value / unit, name, _digits(u), u=term.u / unit,
                     u_digits=digits, coverage_factor=term.factor,
                     remark=f"U = {value_text(u, name, digits)}{more}")  # fmt: skip


def _length_figure(term: Term) -> KeyFigure:
    if not term.determined or term.name.startswith("squareness"):
        return replace(_figure(term), detail=True)
    return KeyFigure(term.name, term.value, "mm", decimals(4), u=term.u / MICROMETRE, u_unit="µm",
                     u_digits=decimals(2), coverage_factor=term.factor)  # fmt: skip


def _directions_table(fit: ReferenceFit) -> Table:
    return Table(
        (
            Column.of("direction", [term.name for term in fit.pretravel]),
            Column.of("pretravel", [t.value / MICROMETRE if t.determined else math.nan
                                    for t in fit.pretravel], "µm", decimals(2)),
            Column.of("U", [t.expanded / MICROMETRE if t.determined else math.nan
                            for t in fit.pretravel], "µm", decimals(2)),
            Column.of("remark", [
                "" if t.determined else f"not distinguished from {', '.join(t.told_from[:2])}"
                for t in fit.pretravel
            ]),
        ),
        "Pretravel by the outward normal of the surface:",
        "The pretravel of a single direction is separated from the place of the reference only "
        "if the opposite direction was touched and the backlash of the axis is known.",
        detail=True,
        certificate=True,
    )  # fmt: skip


def term_columns(fit: ReferenceFit) -> dict[str, npt.ArrayLike]:
    """Columns of a file: a row for each term.

    Returns
    -------
    mapping of str to values
        term, value, expanded_uncertainty, k, unit, determined (1 or 0), told_from.
    """
    rows = []
    for term in (*fit.terms, *fit.pairs, *fit.sizes, *fit.pretravel):
        unit, name = _scale(term)
        if term.name.startswith(("length", "diameter")):
            unit, name = 1.0, "mm"
        rows.append((term.name, term.value / unit, term.expanded / unit, term.factor, name,
                     int(term.determined), "; ".join(term.told_from)))  # fmt: skip
    names = ("term", "value", "expanded_uncertainty", "k", "unit", "determined", "told_from")
    return {
        name: np.array(cells) if isinstance(cells[0], float | int) else list(cells)
        for name, cells in zip(names, zip(*rows, strict=True), strict=True)
    }


def reference_view(fit: ReferenceFit) -> View:
    """Terms of the machine with U, and the residuals in the order of the touches."""
    charts = []
    for title, unit, start in (
        ("scale and squareness", "µm/m", ("scale", "squareness")),
        ("backlash", "µm", ("backlash",)),
    ):
        terms = [t for t in fit.terms if t.determined and t.name.startswith(start)]
        if not terms:
            continue
        size = _scale(terms[0])[0]
        place = np.arange(float(len(terms)))
        value = np.array([t.value for t in terms]) / size
        u = np.array([t.expanded for t in terms]) / size
        charts.append(
            PlaneChart(title, Axis("", categories=tuple(_short(t.name) for t in terms)),
                       Axis("value with U", unit),
                       (Rule(0.0), Dots(place, value, "value with U", "series1", u=u)))
        )  # fmt: skip
    number = np.arange(1.0, len(fit.residuals) + 1.0)
    charts.append(
        PlaneChart("residuals", Axis("touch"), Axis("residual", "µm"),
                   (Rule(0.0), Dots(number, fit.residuals / MICROMETRE, "touches", "series1")))
    )  # fmt: skip
    return View("Machine and probe", tuple(charts), 2)


def _short(name: str) -> str:
    return name.replace("squareness of ", "").replace(" and ", "–").replace(" of ", " ")
