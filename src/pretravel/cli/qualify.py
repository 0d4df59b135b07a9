from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from pretravel.base.quantities import ANGLE, TIP_BALL, limits
from pretravel.base.units import DEGREE
from pretravel.cli.arguments import Length, Vector, length_or_none, one_of
from pretravel.cli.files import MAPS, PICTURES, check_files, is_page
from pretravel.cli.laboratory_option import (
    LaboratoryFile,
    laboratory_statements,
    statements_left_out,
)
from pretravel.cli.map_update import qualify_with_prior
from pretravel.cli.options import Diameter, PictureFile, ProbeAxis, Verbose
from pretravel.cli.progress import working
from pretravel.cli.showing import save_page, save_picture, show
from pretravel.cli.touch_files import (
    DecimalSign,
    Exclude,
    FeedOfTouches,
    FileUnits,
    RunPlan,
    TableColumns,
    TouchFiles,
    files_of_touches,
    read_and_show,
    reading_options,
    with_reading,
)

if TYPE_CHECKING:
    from pretravel.files.file_format import FileReadings
    from pretravel.maps.pretravel_map import PretravelMap
    from pretravel.show.document import Document


def _kinds() -> list[str]:
    from pretravel.tasks.qualify import kind_names

    return kind_names()


def qualify(
    touches: TouchFiles,
    diameter: Diameter,
    tip_diameter: Annotated[
        float | None,
        typer.Option(
            **limits(TIP_BALL),
            help="Diameter of the tip, in mm. Without it, the mean of the map is zero and heights "
            "are less certain, usually by 5 to 15 µm.",
        ),
    ] = None,
    kind: Annotated[
        str,
        typer.Option(
            parser=one_of(_kinds),
            metavar="KIND",
            help="Kind of map: auto (the average of the kinds that predict left-out directions); "
            "or one of them: physical (a fitted six-seat probe), harmonic (a smooth series), "
            "wozniak (one constant), mean (one radius), sectors (a table).",
        ),
    ] = "auto",
    ring: Annotated[bool, typer.Option("--ring", help="The reference is a ring gauge.")] = False,
    u_diameter: Annotated[
        float | None,
        typer.Option(
            min=0.0,
            max=1000.0,
            help="Standard uncertainty of the diameter, in µm: U of the certificate, divided by "
            "its k; 0.2 is assumed when not given.",
        ),
    ] = None,
    u_temperature: Annotated[
        float,
        typer.Option(
            min=0.0, max=50.0, help="Standard uncertainty of the reference's temperature, in K."
        ),
    ] = 0.2,
    sphere_form: Annotated[
        float,
        typer.Option(
            min=0.0,
            max=100.0,
            help="Deviation of the reference from its form, in µm; the default is a grade 5 ball.",
        ),
    ] = 0.13,
    exclude: Exclude = None,
    units: FileUnits = None,
    columns: TableColumns = None,
    decimal: DecimalSign = None,
    plan: RunPlan = None,
    feed: FeedOfTouches = None,
    axial_pretravel: Annotated[
        Length,
        typer.Option(
            parser=length_or_none,
            metavar="UM",
            help="Assumed pretravel along the probe axis, in µm, for kind harmonic: touches on a "
            "sphere do not determine it; none: least-squares centre.",
        ),
    ] = Length(1.0),
    lobe_azimuth: Annotated[
        float | None,
        typer.Option(
            **limits(ANGLE, DEGREE),
            help="Kind wozniak: azimuth of the largest pretravel, opposite a rod, in degrees; the "
            "default is determined from 8 directions or more.",
        ),
    ] = None,
    transducer: Annotated[
        Literal["contact", "piezo"],
        typer.Option(help="Kind wozniak: contact (the map has lobes) or piezo (it has none)."),
    ] = "contact",
    axis: ProbeAxis = Vector(0, 0, 1),
    prior: Annotated[
        Path | None,
        typer.Option(
            help="Old map of this probe, .json: a few touches (5 or more directions, see pretravel "
            "plan-touches) bring it up to date. Kind, axis and conventions are those of the old "
            "map."
        ),
    ] = None,
    lab: LaboratoryFile = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "--output", "-o", help="Map: .json, or a .csv table; or a page, .html or .pdf."
        ),
    ] = None,
    plot: PictureFile = None,
    verbose: Verbose = False,
) -> None:
    """Qualify a probe on a reference sphere or ring: centre, radius, map, uncertainty.

    Touches at two or more feeds (column feed_mm_min) also determine the signal delay.

    A shop's own table is read as it is, for example X;Y;Z;I;J;K with decimal commas:
    pretravel qualify shop.csv --units inch --diameter 25.4 --tip-diameter 6 -o map.json

    Example: pretravel qualify sphere.csv --diameter 25 --tip-diameter 6 -o map.json
    """
    from pretravel.base.units import MICROMETRE
    from pretravel.maps.provenance import QualificationSetup
    from pretravel.tasks.qualify import KindWish, qualify_probe
    from pretravel.tasks.reports.laboratory_report import with_laboratory

    files, name = files_of_touches(touches)
    options = reading_options(
        columns=columns,
        units=units,
        decimal=decimal,
        exclude=exclude,
        plan=plan,
        tip_diameter=tip_diameter,
        reference_diameter=diameter,
        ring=ring,
    )
    if prior is not None:
        qualify_with_prior(
            files,
            options,
            prior,
            feed=feed,
            tip_diameter=tip_diameter,
            plan=plan,
            lab=lab,
            outputs=(output, plot),
            verbose=verbose,
        )
        return
    check_files([(output, MAPS), (plot, PICTURES)], [*files, plan, lab])
    statements = laboratory_statements(lab)
    wish = KindWish(kind, None if lobe_azimuth is None else lobe_azimuth * DEGREE, transducer)
    readings = read_and_show(files, options, feed=feed).in_machine_axes()
    with working(f"qualifying on {len(readings.touches)} touches"):
        setup = QualificationSetup(
            diameter,
            tip_diameter=tip_diameter,
            ring=ring,
            u_diameter=None if u_diameter is None else u_diameter * MICROMETRE,
            u_temperature=u_temperature,
            sphere_form=sphere_form * MICROMETRE,
            axial_pretravel=axial_pretravel.millimetres,
            axis=axis,
        )
        result = qualify_probe(readings, setup, wish)
    report = result.document(
        name,
        warnings=statements_left_out(lab, output, verbose=verbose),
        excluded=_left_out(exclude or (), readings),
        saved=output is not None and not is_page(output),
    )
    report = with_laboratory(report, statements)
    if output is not None:
        _write(output, result.pretravel_map, with_reading(report, readings))
    save_picture(report, plot)
    show(report, verbose=verbose)


def _left_out(exclude: Sequence[str], readings: FileReadings) -> list[str]:
    """What was excluded; in a file without labels a number is a line, not a running number."""
    labelled = readings.touches.labels is not None
    return [f"line {name}" if name.isdecimal() and not labelled else name for name in exclude]


def _write(output: Path, pretravel_map: PretravelMap, report: Document) -> None:
    from pretravel.files.map_file import write_map

    if is_page(output):
        save_page(report, output)
    else:
        write_map(output, pretravel_map)
