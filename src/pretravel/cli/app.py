"""Open the workbench; it is the command line's own task, because no task uses the workbench."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pretravel.task import SILENT, Field, Progress, Result, Task


class App(Task):
    """Open the workbench: the jobs of pretravel as a page in the browser."""

    name = "app"
    example = "pretravel app --no-browser"

    project: Annotated[
        Path | None,
        Field(help="Project file (.pretravel); without it the last project.", positional=True),
    ] = None
    host: Annotated[str, Field(help="Address to listen on.")] = "127.0.0.1"
    port: Annotated[
        int | None,
        Field(
            help="Port; 0: any free port; default: 8765, or another free port.", range=(0, 65535)
        ),
    ] = None
    browser: Annotated[bool, Field(help="Open the page in a browser.")] = True

    def run(self, progress: Progress = SILENT) -> Result:
        """Serve until it is interrupted."""
        from pretravel.app import start

        start(self.project, self.host, self.port, browser=self.browser, say=progress.say)
        return Result()
