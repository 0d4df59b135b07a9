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
