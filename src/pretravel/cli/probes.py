from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.files import PAGES, PICTURES, check_files
from pretravel.cli.showing import save_page, show


def probes(
    name: Annotated[
        str | None,
        typer.Argument(help="A probe of the catalogue, to print; or a TOML file, to check."),
    ] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Picture of the named probe: .png, .svg or .pdf.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="A page, .html or .pdf.")
    ] = None,
) -> None:
    """List the catalogue of probes, or print one description as TOML.

    Example: pretravel probes omp40-2 > mine.toml
    """
    from pretravel.base.errors import PretravelError
    from pretravel.prediction.catalogue import catalogue_names, description_text, load_probe
    from pretravel.tasks.reports.probe_report import (
        catalogue_document,
        probe_document,
        probe_picture,
    )

    check_files([(plot, PICTURES), (output, PAGES)], [name])
    if plot is not None:
        from pretravel.show.style import save_picture_file

        if name is None:
            raise PretravelError(
                "--plot draws one probe: pretravel probes omp40-2 --plot probe.png"
            )
        save_picture_file(probe_picture(load_probe(name)), plot)
    if name is not None:
        save_page(probe_document(load_probe(name)), output)
    if name is not None and name in catalogue_names():
        typer.echo(description_text(name), nl=False)
        return
    if name is not None:  # a file: say what it holds, or what is wrong with it
        typer.echo(f"{name}: {load_probe(name).name}, a valid description")
        return
    report = catalogue_document({entry: load_probe(entry) for entry in catalogue_names()})
    save_page(report, output)
    show(report, verbose=False)
    typer.echo("\npretravel probes NAME > mine.toml prints a description to edit.")
