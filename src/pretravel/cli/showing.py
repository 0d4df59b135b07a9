"""The reports of results, as the commands show them."""

from __future__ import annotations

from pathlib import Path

import typer

from pretravel.cli.files import is_page
from pretravel.cli.progress import working
from pretravel.cli.running import record_of_command
from pretravel.show.document import Document
from pretravel.show.terminal import terminal_text


def show(document: Document, *, verbose: bool) -> None:
    """Print a report on stdout, and its warnings on stderr."""
    typer.echo(terminal_text(document, verbose=verbose))
    for warning in document.warnings:
        typer.echo(f"Warning: {warning}", err=True)


def save_page(document: Document, path: Path | None, *, template: str = "page.html") -> None:
    """Write a report as a page (.html or .pdf) with what was done, where a page is asked for."""
    if path is None or not is_page(path):
        return
    from pretravel.show.page import write_page

    with working(f"writing {path.name}"):
        write_page(path, document, record=record_of_command(), template=template)
