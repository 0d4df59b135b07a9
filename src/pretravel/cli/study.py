from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.files import PAGES, PICTURES, check_files, is_page
from pretravel.cli.options import PictureFile, Verbose
from pretravel.cli.progress import working
from pretravel.cli.showing import save_page, save_picture, show


def study(
    study_file: Annotated[
        str,
        typer.Argument(
            metavar="STUDY",
            help="Study, .toml; or a name of pretravel studies; or results, .nc, to show again.",
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Results: .nc, which xarray opens."),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=1024,
            help="Processes of this computer; the default is one for each core, and 1 for short "
            "studies. More than 1 needs pretravel\\[scale].",
        ),
    ] = None,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS",
            help="Address of a running Dask scheduler, as tcp://host:8786, whose workers compute.",
        ),
    ] = None,
    restart: Annotated[
        bool,
        typer.Option("--restart", help="Begin anew, also where an earlier run was interrupted."),
    ] = False,
    page: Annotated[Path | None, typer.Option(help="A page, .html or .pdf.")] = None,
    plot: PictureFile = None,
    verbose: Verbose = False,
) -> None:
    """Predict many designs of a probe: what varies, and what decides it.

    A study that was interrupted goes on where it ended when the command is run again.

    Example: pretravel study preload-and-seats -o study.nc --plot study.png
    """
    from pretravel.base.errors import PretravelError
    from pretravel.tasks.study import run_or_read

    if output is None and Path(study_file).suffix.lower() != ".nc":
        raise PretravelError(
            "a study needs a file for its results: -o study.nc", inputs=("output",)
        )
    check_files([(output, (".nc",)), (page, PAGES), (plot, PICTURES)], [study_file])
    with working("study"):
        result = run_or_read(
            study_file, output, workers=workers, scheduler=scheduler, restart=restart
        )
    report = result.document()
    save_page(report, page if is_page(page) else None)
    save_picture(report, plot)
    show(report, verbose=verbose)


def studies(
    name: Annotated[str | None, typer.Argument(help="A study of the package, to print.")] = None,
) -> None:
    """List the studies of the package, or print one as TOML.

    Example: pretravel studies what-matters > mine.toml
    """
    from pretravel.studies.definition import STUDIES, load_study
    from pretravel.studies.plan import Plan

    if name is not None:
        typer.echo(STUDIES.text(name), nl=False)
        return
    for entry in STUDIES.names():
        found = load_study(entry)
        typer.echo(f"{entry:20} {found.name}, {found.plan}, {len(Plan(found))} designs")
    typer.echo("\npretravel studies NAME > mine.toml prints a study to edit.")
