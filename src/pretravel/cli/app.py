from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def app(
    project: Annotated[
        Path | None, typer.Argument(help="Project file (.pretravel); default: the last one.")
    ] = None,
    host: Annotated[str, typer.Option(help="Address to listen on.")] = "127.0.0.1",
    port: Annotated[
        int | None,
        typer.Option(min=0, max=65535, help="Port; 0: any free one; default: 8765 if it is free."),
    ] = None,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in a browser.")
    ] = True,
) -> None:
    """Open the workbench: the jobs of pretravel as a page in the browser.

    Example: pretravel app --no-browser
    """
    from pretravel.app.start import start

    start(project, host, port, browser=browser, say=typer.echo)
