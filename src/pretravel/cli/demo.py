from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.progress import working


def demo(
    data: Annotated[
        Path, typer.Option(help="Folder of sphere_touches.csv, part_touches.csv and kp3_ring.csv.")
    ] = Path("examples/data"),
    output: Annotated[
        Path,
        typer.Option("--output", "-o", help="Folder for the points, the pictures and the page."),
    ] = Path("demo-output"),
) -> None:
    """Qualify, compensate and compare with the example data, and write a page.

    Example: pretravel demo -o demo-output
    """
    from pretravel.report.demonstration import demonstrate

    with working("qualifying, compensating, drawing"):
        summary = demonstrate(data, output)
    typer.echo(summary)
