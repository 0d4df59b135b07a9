"""The server of the workbench: pages, uploads, and how it starts and ends."""

from __future__ import annotations

import logging
from pathlib import Path

from fastapi import Request
from fastapi.responses import JSONResponse
from nicegui import app, ui

from pretravel.errors import PretravelError
from pretravel.workbench.screens import SCREENS, Screen
from pretravel.workbench.shell import STATIC, help_page, home_page, screen_page
from pretravel.workbench.tasks import WORKS, StageHandler
from pretravel.workbench.uploads import UPLOADS, limited_content


def serve(host: str, port: int, *, show: bool) -> None:
    """Run the server until it is interrupted.

    Parameters
    ----------
    host : str
    port : int
    show : bool
        Whether a browser is opened.
    """
    _add_pages()
    logger = logging.getLogger("pretravel")
    logger.addHandler(StageHandler(logging.INFO))
    logger.setLevel(logging.INFO)
    app.on_shutdown(WORKS.cancel_all)
    ui.run(
        host=host,
        port=port,
        title="pretravel",
        language="en-US",
        dark=None,
        reload=False,
        show=show,
        show_welcome_message=False,
        tailwind=False,
        favicon=Path(__file__).parent / "static" / "icon.svg",
        uvicorn_logging_level="error",
        timeout_graceful_shutdown=2,
    )


def _add_pages() -> None:
    app.add_static_files(STATIC, str(Path(__file__).parent / "static"))
    ui.page("/")(home_page)
    ui.page("/help")(help_page)
    for screen in SCREENS:
        ui.page(f"/{screen.name}")(_page_of(screen))
    app.post("/upload/{screen}/{purpose}")(receive_file)


def _page_of(screen: Screen):  # type: ignore[no-untyped-def]
    def show() -> None:
        screen_page(screen)

    return show


async def receive_file(screen: str, purpose: str, name: str, request: Request) -> JSONResponse:
    """Take a file for a slot; the answer to a fault is its text."""
    try:
        slot = UPLOADS.slot(screen, purpose)
        slot.check_name(name)
        slot.store(name, await limited_content(request.stream(), slot.limit, name))
    except PretravelError as error:
        return JSONResponse({"error": str(error)}, status_code=422)
    return JSONResponse({"error": ""})
