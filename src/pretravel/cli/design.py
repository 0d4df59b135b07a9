from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.files import PAGES, PICTURES, check_files, is_page
from pretravel.cli.options import PictureFile, Verbose
from pretravel.cli.progress import working
from pretravel.cli.showing import save_page, save_picture, show


def design(
    wish: Annotated[
        str, typer.Argument(metavar="WISH", help="Wish, .toml; or a name of pretravel wishes.")
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Description of the best probe: .toml.")
    ],
    page: Annotated[Path | None, typer.Option(help="A page, .html or .pdf.")] = None,
    plot: PictureFile = None,
    verbose: Verbose = False,
) -> None:
    """Search the probe that fits a wish best, within ranges and limits.

    Example: pretravel design stylus-50mm -o best.toml --plot best.png
    """
    from pretravel.tasks.design import design_probe

    check_files([(output, (".toml",)), (page, PAGES), (plot, PICTURES)], [wish])
    with working("searching designs"):
        result = design_probe(wish)
    report = result.document()
    result.write(output)
    save_page(report, page if is_page(page) else None)
    save_picture(report, plot)
    show(report, verbose=verbose)


def wishes(
    name: Annotated[str | None, typer.Argument(help="A wish of the package, to print.")] = None,
) -> None:
    """List the wishes of the package, or print one as TOML.

    Example: pretravel wishes stylus-100mm > wish.toml
    """
    from pretravel.studies.wish import WISHES, load_wish

    if name is not None:
        typer.echo(WISHES.text(name), nl=False)
        return
    for entry in WISHES.names():
        typer.echo(f"{entry:14} {load_wish(entry).study.name}")
    typer.echo("\npretravel wishes NAME > wish.toml prints a wish to edit.")
