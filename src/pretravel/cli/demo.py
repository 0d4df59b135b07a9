from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pretravel.cli.arguments import working


def demo(
    data: Annotated[
        Path, typer.Option(help="Folder with sphere_touches.csv, part_touches.csv, kp3_ring.csv.")
    ] = Path("examples/data"),
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Folder for points, pictures and the page.")
    ] = Path("demo-output"),
) -> None:
    """Run the main job on the example data: qualify, compensate, compare; with a page.

    Example: pretravel demo -o demo-output
    """
    from pretravel.report.demonstration import demonstrate

    with working("qualifying, compensating, drawing"):
        summary = demonstrate(data, output)
    typer.echo(summary)
