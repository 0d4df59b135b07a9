from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pretravel.base.errors import PretravelError
from pretravel.base.quantities import TIP_BALL, limits
from pretravel.base.units import MICROMETRE
from pretravel.cli.arguments import one_of
from pretravel.cli.files import PAGES, PICTURES, check_files, is_page
from pretravel.cli.options import PictureFile, Verbose
from pretravel.cli.progress import working
from pretravel.cli.showing import save_page, save_picture, show
from pretravel.cli.touch_files import (
    DecimalSign,
    FileUnits,
    RunPlan,
    TableColumns,
    reading_options,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from pretravel.maps.pretravel_map import PretravelMap
    from pretravel.maps.provenance import QualificationSetup
    from pretravel.show.document import Document
    from pretravel.tasks.history import HistorySetup

_DATABASES = (".sqlite", ".db")


def _kinds() -> tuple[str, ...]:
    """Kinds of map that follow the probe closely enough to be compared with."""
    return "auto", "harmonic", "physical"


def history(
    places: Annotated[
        list[Path],
        typer.Argument(
            metavar="HISTORY",
            help="History file of one probe, .sqlite; or a folder with touches on the reference, "
            "one file for each day or shift, with the date in its name (2026-03-14, 20260314, "
            "14-03-2026; else the time of its last change). Several files or a name with * too.",
        ),
    ],
    diameter: Annotated[
        float | None,
        typer.Option(
            min=0.001,
            max=10000.0,
            help="Of touches: calibrated diameter of the sphere (or ring), in mm.",
        ),
    ] = None,
    tip_diameter: Annotated[
        float | None,
        typer.Option(**limits(TIP_BALL), help="Of touches: diameter of the tip, in mm."),
    ] = None,
    map_file: Annotated[
        Path | None,
        typer.Option(
            "--map",
            help="Of touches: map of pretravel qualify, .json, that every day is compared with; "
            "without it, the first file is qualified.",
        ),
    ] = None,
    kind: Annotated[
        str | None,
        typer.Option(
            parser=one_of(_kinds),
            metavar="KIND",
            help="Of touches: kind of the first file's map, auto, harmonic or physical.",
        ),
    ] = None,
    ring: Annotated[bool, typer.Option("--ring", help="The reference is a ring gauge.")] = False,
    limit: Annotated[
        float | None,
        typer.Option(
            min=0.001,
            max=1000.0,
            help="Allowed change of the map, in µm: a new qualification is due when the drift "
            "exceeds it. By default the expanded uncertainty of the map (U = 2 u).",
        ),
    ] = None,
    units: FileUnits = None,
    columns: TableColumns = None,
    decimal: DecimalSign = None,
    plan: RunPlan = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Table: .csv; or a page, .html or .pdf.")
    ] = None,
    plot: PictureFile = None,
    verbose: Verbose = False,
) -> None:
    """Show how a probe drifts over time, and when its next qualification is due.

    From a folder of touches, one file a day; or from the verifications of pretravel verify
    --history, with their control chart.

    Example: pretravel history logs --diameter 25 --tip-diameter 6 --limit 1 --plot drift.png
    """
    from pretravel.tasks.history import HistorySetup, history_of_verifications
    from pretravel.tasks.reports.history_report import history_columns

    allowed = None if limit is None else limit * MICROMETRE
    if len(places) == 1 and _is_database(places[0]):
        given = {
            "diameter": diameter, "tip_diameter": tip_diameter, "map": map_file, "kind": kind,
            "ring": ring or None, "units": units, "columns": columns, "decimal": decimal,
            "plan": plan,
        }  # fmt: skip
        _refuse_options_of_touches(name for name, value in given.items() if value is not None)
        check_files([(output, (".csv", *PAGES)), (plot, PICTURES)], places)
        found = history_of_verifications(places[0], allowed)
        report = found.document(places[0].name)
        _show(report, history_columns(found.entries), output, plot, verbose=verbose)
        return
    options = reading_options(
        columns=columns,
        units=units,
        decimal=decimal,
        plan=plan,
        tip_diameter=tip_diameter,
        reference_diameter=diameter,
        ring=ring,
    )
    reference, old_map = _reference(diameter, tip_diameter, map_file, kind, ring=ring)
    setup = HistorySetup(
        reference,
        options,
        limit=allowed,
        kind=kind or "auto",
        pretravel_map=old_map,
        map_name="" if map_file is None else map_file.name,
    )
    _history_of_touches(places, setup, (output, plot), [map_file, plan], verbose=verbose)


def _is_database(place: Path) -> bool:
    """Whether the argument is the file of verifications, not touches."""
    return place.suffix.lower() in _DATABASES and not place.is_dir()


def _refuse_options_of_touches(names: Iterable[str]) -> None:
    given = tuple(names)
    if given:
        raise PretravelError(
            "this history contains verifications, which state their reference and map; for them "
            "leave out what describes touches",
            inputs=given,
        )


def _reference(
    diameter: float | None,
    tip_diameter: float | None,
    map_file: Path | None,
    kind: str | None,
    *,
    ring: bool,
) -> tuple[QualificationSetup, PretravelMap | None]:
    """The reference, and the map that the days are compared with where one is given."""
    from pretravel.files.map_file import read_map
    from pretravel.maps.provenance import QualificationSetup

    if diameter is None:
        raise PretravelError(
            "a history of touches needs the calibrated diameter of the reference (a file of "
            "verifications, .sqlite, does not)",
            inputs=("diameter",),
        )
    if map_file is None:
        return QualificationSetup(diameter, tip_diameter=tip_diameter, ring=ring), None
    if tip_diameter is not None or kind is not None:
        raise PretravelError(
            "the map states its tip and its kind: leave them out beside a map",
            inputs=("map", *(("tip_diameter",) if tip_diameter is not None else ("kind",))),
        )
    old_map = read_map(map_file)
    return QualificationSetup(diameter, 2.0 * old_map.tip_radius, ring=ring), old_map


def _history_of_touches(
    places: list[Path],
    setup: HistorySetup,
    outputs: tuple[Path | None, Path | None],
    inputs: list[Path | None],
    *,
    verbose: bool,
) -> None:
    from pretravel.files.several_files import files_of
    from pretravel.tasks.history import history_of_files
    from pretravel.tasks.reports.drift_report import day_columns, folder_document

    files = [path for path in files_of(places) if path not in outputs]
    check_files([(outputs[0], (".csv", *PAGES)), (outputs[1], PICTURES)], [*files, *inputs])
    with working(f"history of {len(files)} files"):
        found = history_of_files(files, setup)
    name = places[0].name if len(places) == 1 else f"{files[0].name} … {files[-1].name}"
    _show(folder_document(found, name), day_columns(found), *outputs, verbose=verbose)


def _show(
    report: Document,
    columns: Mapping[str, npt.ArrayLike],
    output: Path | None,
    plot: Path | None,
    *,
    verbose: bool,
) -> None:
    from pretravel.files.csv_table import write_csv_table

    if output is not None and not is_page(output):
        write_csv_table(output, columns)
    save_page(report, output)
    save_picture(report, plot)
    show(report, verbose=verbose)
