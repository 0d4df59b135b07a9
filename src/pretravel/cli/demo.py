from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.files import refuse_other_kinds
from pretravel.cli.options import Verbose
from pretravel.cli.progress import working
from pretravel.cli.running import note_inputs, record_of_command
from pretravel.cli.showing import show


def demo(
    data: Annotated[
        Path | None,
        typer.Option(
            help="Folder of sphere_touches.csv, part_touches.csv and kp3_ring.csv; the default is "
            "the example data of the package."
        ),
    ] = None,
    output: Annotated[
        Path,
        typer.Option("--output", "-o", help="Folder for the points, the pictures and the page."),
    ] = Path("demo-output"),
    verbose: Verbose = False,
) -> None:
    """Qualify, compensate and compare with the example data, and write a page.

    Example: pretravel demo -o demo-output
    """
    from pretravel.tasks.example_data import example_folder
    from pretravel.tasks.reports.demonstration import DATA_FILES
    from pretravel.tasks.reports.demonstration_report import (
        DEMONSTRATION_FILES,
        write_demonstration,
    )

    folder = data or example_folder()
    note_inputs(folder / name for name in DATA_FILES)
    refuse_other_kinds(output / name for name in DEMONSTRATION_FILES)
    with working("qualifying, compensating, drawing"):
        report = write_demonstration(
            folder, output, written=_say_written, record=record_of_command()
        )
    show(report, verbose=verbose)
    typer.echo(
        f"\nLook at {(output / 'index.html').resolve()}\n"
        "(points.csv, map.json and the pictures are beside it)"
    )


def _say_written(path: Path) -> None:
    typer.echo(f"written: {path}", err=True)
