"""The reports of results, as the commands show them."""

from __future__ import annotations

import typer

from pretravel.show import Document, grouped_warnings, printable, terminal_text


def show(document: Document, *, verbose: bool) -> None:
    """Print a report on stdout, and its warnings on stderr, of one kind in one line."""
    typer.echo(terminal_text(document, verbose=verbose))
    for warning in document.warnings if verbose else grouped_warnings(document.warnings):
        typer.echo(f"Warning: {printable(warning)}", err=True)
