from __future__ import annotations

import typer


def laboratory() -> None:
    """Print the statements of a calibration certificate, as TOML to fill in.

    Example: pretravel laboratory > lab.toml
    """
    from pretravel.formats.laboratory_file import laboratory_template

    typer.echo(laboratory_template(), nl=False)
