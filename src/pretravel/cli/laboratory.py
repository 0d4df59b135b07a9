from __future__ import annotations

import typer


def laboratory() -> None:
    """Print what a calibration certificate states, as TOML to fill in.

    Example: pretravel laboratory > lab.toml
    """
    from pretravel.report.certificate import laboratory_template

    typer.echo(laboratory_template(), nl=False)
