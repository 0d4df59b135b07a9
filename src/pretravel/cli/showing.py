"""The reports of results, as the commands show them."""

from __future__ import annotations

from pathlib import Path

import typer

from pretravel.report.document import Document
from pretravel.report.terminal import terminal_text


def show(document: Document, *, verbose: bool) -> None:
    """Print a report on stdout, and its warnings on stderr."""
    typer.echo(terminal_text(document, verbose=verbose))
    for warning in document.warnings:
        typer.echo(f"Warning: {warning}", err=True)


def save_picture(document: Document, path: Path | None) -> None:
    """Write the main picture of a report to a file, where one is asked for."""
    if path is None:
        return
    from pretravel.report.style import save_picture_file

    save_picture_file(document.pictures[0], path)
