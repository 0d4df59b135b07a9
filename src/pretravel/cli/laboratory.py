from __future__ import annotations

import typer


def laboratory() -> None:
    """Print what a laboratory states in reports and certificates (--lab), as TOML to fill in.

    Example: pretravel laboratory > lab.toml
    """
    from pretravel.files.laboratory_file import laboratory_template

    typer.echo(laboratory_template(), nl=False)
