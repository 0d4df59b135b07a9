from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.files import PAGES, check_files
from pretravel.cli.progress import working


def report(
    pages: Annotated[
        list[Path],
        typer.Argument(metavar="PAGES", help="Pages that pretravel wrote (-o page.html)."),
    ],
    output: Annotated[
        Path, typer.Option("--output", "-o", help="All of them in one page: .html or .pdf.")
    ],
    title: Annotated[
        str | None, typer.Option(help="Title of the page; the default names the results.")
    ] = None,
) -> None:
    """Bind the pages of several results into one, or make a PDF of a page.

    Results, pictures and what was done with what are taken over; each page keeps its date.

    Example: pretravel report qualify.html part.html bore.html -o report.pdf
    """
    from pretravel.show.page import write_contents
    from pretravel.show.page_content import read_page

    check_files([(output, PAGES)], pages)
    contents = [content for page in pages for content in read_page(page)]
    name = title or (", ".join(page.stem for page in pages) if len(contents) > 1 else "")
    with working(f"writing {output.name}"):
        write_contents(output, contents, title=name)
    count = f"{len(contents)} results" if len(contents) > 1 else "1 result"
    typer.echo(f"{output}: {count}")
