from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from pretravel.base.errors import PretravelError
from pretravel.cli.command import ANSWER
from pretravel.cli.files import PAGES, PICTURES, check_files, is_page
from pretravel.cli.options import Diameter, PictureFile, Verbose
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
    from pretravel.maps.pretravel_map import PretravelMap


def verify(
    touches: TouchFiles,
    map_file: Annotated[Path, typer.Option("--map", help="Map of pretravel qualify, .json.")],
    diameter: Diameter,
    ring: Annotated[bool, typer.Option("--ring", help="The reference is a ring gauge.")] = False,
    false_alarms: Annotated[
        float,
        typer.Option(
            min=0.0001,
            max=49.9,
            help="Accepted false alarms: percentage of unchanged probes reported as changed.",
        ),
    ] = 1.0,
    exclude: Exclude = None,
    units: FileUnits = None,
    columns: TableColumns = None,
    decimal: DecimalSign = None,
    plan: RunPlan = None,
    feed: FeedOfTouches = None,
    history: Annotated[
        Path | None,
        typer.Option(help="History file of this probe, .sqlite; created when it does not exist."),
    ] = None,
    accept: Annotated[
        Path | None,
        typer.Option(help="Qualify again with the new touches and write the new map: .json."),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Result: .json; or a page, .html or .pdf.")
    ] = None,
    plot: PictureFile = None,
    verbose: Verbose = False,
) -> None:
    """Test whether a probe has changed since its qualification. Exit code 0: no; 3: yes.

    The old map is kept unless --accept names a new one.

    Example: pretravel verify today.csv --map map.json --diameter 24.9987 --history probe.sqlite
    """
    from pretravel.base.whole_file import write_json
    from pretravel.files.map_file import read_map
    from pretravel.files.probe_history import add_verification, check_history, read_history
    from pretravel.qualification.qualify import qualify_like
    from pretravel.qualification.verification import verify as verify_probe
    from pretravel.tasks.reports.verification_report import (
        verification_document,
        verification_values,
    )

    files, name = files_of_touches(touches)
    check_files(
        [(output, (".json", *PAGES)), (plot, PICTURES), (accept, (".json",))],
        [*files, map_file, history, plan],
    )
    if history is not None and history.suffix.lower() not in (".sqlite", ".db"):
        raise PretravelError(f"--history {history}: the ending must be .sqlite or .db")
    old_map = read_map(map_file)
    options = reading_options(
        columns=columns,
        units=units,
        decimal=decimal,
        exclude=exclude,
        plan=plan,
        tip_diameter=2.0 * old_map.tip_radius,
        reference_diameter=diameter,
        ring=ring,
    )
    readings = read_and_show(files, options, feed=feed).in_machine_axes()
    measured = readings.touches
    rate = 0.01 * false_alarms
    result = verify_probe(measured, old_map, diameter, ring=ring, false_alarm_rate=rate)
    if history is not None:
        check_history(history, old_map)
    new_map = None
    if accept is not None:
        new_map = qualify_like(measured, old_map, diameter, ring=ring).pretravel_map
    decision = "kept" if accept is None else f"accepted {accept.name}"
    with _new_map(accept, new_map):
        if history is not None:
            add_verification(
                history,
                result,
                pretravel_map=old_map,
                map_name=map_file.name,
                touches_name=name,
                decision=decision,
            )
    report = verification_document(
        result,
        decision,
        title=f"{name} against {map_file.name}",
        entries=[] if history is None else read_history(history),
        warnings=readings.notes(),
    )
    if output is not None and not is_page(output):
        write_json(output, verification_values(result, decision))
    save_page(with_reading(report, readings), output)
    save_picture(report, plot)
    show(report, verbose=verbose)
    if result.changed:
        raise typer.Exit(ANSWER)


@contextmanager
def _new_map(path: Path | None, pretravel_map: PretravelMap | None) -> Iterator[None]:
    """Write the new map when what is done within succeeds: the map and its entry, or neither."""
    from pretravel.base.whole_file import whole_file
    from pretravel.files.map_file import write_map

    if path is None or pretravel_map is None:
        yield
        return
    with whole_file(path) as temporary:
        write_map(temporary, pretravel_map)
        yield
