"""Options that several commands share, worded once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, TypeAlias

import typer

ProbeName: TypeAlias = Annotated[
    str, typer.Argument(help="Catalogue name, or path of a TOML description.")
]
Workpiece: TypeAlias = Annotated[str, typer.Option(help="Material of the part.")]
Gravity: TypeAlias = Annotated[
    str | None,
    typer.Option(help="Direction x,y,z in which weight pulls, machine frame; else left out."),
]
Picture: TypeAlias = Annotated[Path | None, typer.Option(help="Picture: .png, .svg or .pdf.")]
Verbose: TypeAlias = Annotated[
    bool, typer.Option("--verbose", help="Print the full report, not its key figures alone.")
]
Place: TypeAlias = Annotated[
    str | None,
    typer.Option(
        help="Where the part's frame is in the machine: x,y,z in mm, then turns about the "
        "machine's x, y, z in degrees, in that order; the probe stays as it is described."
    ),
]
Frame: TypeAlias = Annotated[
    str, typer.Option(help="Frame of the touches with --place: part or machine.")
]
