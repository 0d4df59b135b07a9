from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NamedTuple

import typer

from pretravel.base.errors import PretravelError
from pretravel.cli.arguments import Vector, one_of, parser, unit_vector, vector
from pretravel.cli.command import ANSWER
from pretravel.cli.files import PAGES, PICTURES, check_files, is_page
from pretravel.cli.laboratory_option import (
    LaboratoryFile,
    laboratory_statements,
    statements_left_out,
)
from pretravel.cli.options import PictureFile, Verbose
from pretravel.cli.showing import save_page, save_picture, show

if TYPE_CHECKING:
    from pretravel.laboratory.certificate import LaboratoryStatements
    from pretravel.show.document import Document
    from pretravel.tasks.measure import MeasuredFeatures

_NUMBER = r"[+-]?\d*\.?\d+(?:[eE][+-]?\d+)?"


class ToleranceText(NamedTuple):
    """Limits, or deviations from a nominal size, in mm; None: there is no such limit."""

    low: float | None
    high: float | None
    are_limits: bool

    def __str__(self) -> str:
        """As it can be typed."""
        if self.are_limits:
            ends = ("" if end is None else f"{end:.12g}" for end in (self.low, self.high))
            return "..".join(ends)
        return f"{self.high:+.12g}/{self.low:+.12g}"


@parser(ToleranceText)
def tolerance(text: str) -> ToleranceText:
    """Limits ``20.000..20.021``, ``20..`` or ``..20.021``, or deviations ``+0.021/0``, ``±0.01``.

    >>> tolerance("20..20.021"), tolerance("+0.021/0")
    (ToleranceText(low=20.0, high=20.021, are_limits=True), \
ToleranceText(low=0.0, high=0.021, are_limits=False))
    >>> str(tolerance("+0.021/0")), str(tolerance("20..20.021"))
    ('+0.021/+0', '20..20.021')
    >>> str(tolerance("0..")), str(tolerance("..20.021"))
    ('0..', '..20.021')
    >>> tolerance("±0.01")
    ToleranceText(low=-0.01, high=0.01, are_limits=False)
    """
    tight = text.replace(" ", "").replace("−", "-")
    if both := re.fullmatch(rf"(?:±|\+-|\+/-)({_NUMBER})", tight):
        half = abs(float(both[1]))
        return _nonempty(text, -half, half, False)
    if limits := re.fullmatch(rf"({_NUMBER})?\.\.({_NUMBER})?", tight):
        low, high = (None if limit is None else float(limit) for limit in limits.groups())
        if low is not None and high is not None:
            return _nonempty(text, low, high, True)
        only = high if low is None else low
        if only is not None and math.isfinite(only):
            return ToleranceText(low, high, True)
    if parts := re.fullmatch(rf"({_NUMBER})/({_NUMBER})", tight):
        return _nonempty(text, float(parts[2]), float(parts[1]), False)
    advice = "; the decimal sign is a point" if "," in text else ""
    raise typer.BadParameter(
        f"{text}: expected limits as 20.000..20.021, one limit as 20.. or ..20.021, or with a "
        f"nominal size the upper and lower deviation as +0.021/0 or ±0.01, in mm{advice}"
    )


def _nonempty(text: str, low: float, high: float, are_limits: bool) -> ToleranceText:
    if not (math.isfinite(low) and math.isfinite(high) and low < high):
        order = "the lower limit comes first" if are_limits else "the upper deviation comes first"
        raise typer.BadParameter(f"{text}: this tolerance is empty; {order}")
    return ToleranceText(low, high, are_limits)


def _features() -> list[str]:
    from pretravel.measurement.association import ASSOCIATIONS

    return list(ASSOCIATIONS)


def measure(
    points: Annotated[
        Path, typer.Argument(help="Points from compensate: .csv, .parquet, .json or .nc.")
    ],
    feature: Annotated[
        str,
        typer.Option(
            parser=one_of(_features),
            metavar="FEATURE",
            help="circle, bore, boss, sphere, plane, line, cylinder or cone.",
        ),
    ],
    select: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LABELS",
            help='Points by label, with * and ?: "bore1*"; or by number: 10..21. Each --select is '
            "one feature.",
        ),
    ] = None,
    group: Annotated[
        bool,
        typer.Option("--group", help="One feature for each name before a number: bore1-1, …"),
    ] = False,
    axis: Annotated[
        Vector | None,
        typer.Option(
            parser=unit_vector,
            metavar="X,Y,Z",
            help="Axis of a circle, bore or boss; without it, across the plane of the points. Of a "
            "cylinder or cone: where the search starts.",
        ),
    ] = None,
    at: Annotated[
        Vector | None,
        typer.Option(
            parser=vector,
            metavar="X,Y,Z",
            help="Nominal position, in mm. Axes, planes and the diameter of a cone are evaluated "
            "at their point nearest to it.",
        ),
    ] = None,
    size_tolerance: Annotated[
        ToleranceText | None,
        typer.Option(
            "--tolerance",
            parser=tolerance,
            metavar="LIMITS",
            help="Of the diameter, in mm: 20.000..20.021, 20.. or ..20.021; or with --nominal "
            "+0.021/0, ±0.01.",
        ),
    ] = None,
    nominal: Annotated[
        float | None, typer.Option(min=0.0, max=1e5, help="Nominal diameter, in mm.")
    ] = None,
    position_tolerance: Annotated[
        float | None,
        typer.Option(
            min=1e-6,
            max=1e3,
            help="Diameter of the zone around the nominal position (plane, line: width), in mm.",
        ),
    ] = None,
    form_tolerance: Annotated[
        float | None,
        typer.Option(
            min=1e-6, max=1e3, help="Roundness, flatness, straightness, cylindricity, form, in mm."
        ),
    ] = None,
    probability: Annotated[
        float,
        typer.Option(min=0.5, max=0.9999, help="At which a decision is proven (ISO 14253-1)."),
    ] = 0.95,
    u_machine: Annotated[
        float,
        typer.Option(
            min=0.0,
            max=1e4,
            help="Standard uncertainty of a length by the machine's geometry, temperature and "
            "clamping, in µm.",
        ),
    ] = 0.0,
    lab: LaboratoryFile = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="Results: .csv, .parquet or .json; or a page, .html or .pdf."
        ),
    ] = None,
    plot: PictureFile = None,
    verbose: Verbose = False,
) -> None:
    """Measure features from compensated points: form, size, position, conformity.

    Exit code 3: a feature does not conform to its tolerances.

    Example: pretravel measure points.csv --feature bore --select "bore1*" --tolerance 20..20.021
    -o bore.html
    """
    from pretravel.base.units import MICROMETRE
    from pretravel.files.points_reading import read_points
    from pretravel.measurement.tolerances import FeatureTolerances
    from pretravel.tasks.measure import FeatureWish, measure_features

    check_files(
        [(output, (".csv", ".parquet", ".json", *PAGES)), (plot, PICTURES)],
        [points, lab],
    )
    statements = laboratory_statements(lab)
    tolerances = FeatureTolerances(
        _limits(size_tolerance, nominal), position_tolerance, form_tolerance, probability
    )
    wish = FeatureWish(
        feature, tuple(select or ()), group, axis, at, u_machine * MICROMETRE, tolerances
    )
    found = measure_features(read_points(points), wish)
    warnings = []
    if tolerances.any_stated and not u_machine:
        warnings.append(
            "u contains the errors of probing alone; a verdict also needs those of the machine's "
            "geometry, of temperature and clamping: --u-machine"
        )
    warnings += statements_left_out(lab, output, verbose=verbose, kept_in=(".json",))
    report = found.document(points.name, warnings=warnings, statements=statements)
    if output is not None:
        _write(output, found, report, statements)
    save_picture(report, plot)
    show(report, verbose=verbose)
    if found.some_fail:
        raise typer.Exit(ANSWER)


def _limits(size: ToleranceText | None, nominal: float | None) -> tuple[float, float] | None:
    """The limits of a diameter, in mm."""
    if size is None:
        if nominal is not None:
            raise PretravelError("--nominal needs the deviations from it: --tolerance +0.021/0")
        return None
    if size.are_limits:
        if nominal is not None:
            raise PretravelError("--tolerance has limits already; leave out --nominal")
        return (-math.inf if size.low is None else size.low,
                math.inf if size.high is None else size.high)  # fmt: skip
    if nominal is None:
        raise PretravelError("deviations in --tolerance need the nominal diameter: --nominal 20")
    assert size.low is not None
    assert size.high is not None
    return nominal + size.low, nominal + size.high


def _write(
    output: Path,
    found: MeasuredFeatures,
    report: Document,
    statements: LaboratoryStatements | None,
) -> None:
    from pretravel.base.whole_file import write_json
    from pretravel.files.tables import write_table

    ending = output.suffix.lower()
    if is_page(output):
        save_page(report, output)
    elif ending == ".json":
        write_json(output, found.values(statements))
    else:
        write_table(output, found.table())
