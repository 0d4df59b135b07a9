from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.files import PAGES, PICTURES, check_files, is_page
from pretravel.cli.options import PictureFile, Verbose
from pretravel.cli.progress import working
from pretravel.cli.showing import save_page, save_picture, show


def faces(
    step: Annotated[Path, typer.Argument(help="A STEP or IGES file.")],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="The list: .csv; or a page, .html or .pdf."),
    ] = None,
    plot: PictureFile = None,
    verbose: Verbose = False,
) -> None:
    """List the faces of a STEP or IGES file, with the numbers that part.step#face uses.

    Example: pretravel faces part.step --plot faces.png
    """
    from pretravel.files.csv_table import write_csv_table
    from pretravel.files.plan_csv import faces_table
    from pretravel.surface.cad.part_file import read_part
    from pretravel.tasks.reports.part_report import faces_document

    check_files([(output, (".csv", *PAGES)), (plot, PICTURES)], [step])
    with working(f"reading {step.name}"):
        part = read_part(step)
        table = faces_table(part)
    if output is not None and not is_page(output):
        write_csv_table(output, table)
    report = faces_document(part, table)
    save_page(report, output)
    save_picture(report, plot)
    show(report, verbose=verbose)
