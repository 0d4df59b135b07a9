"""The server of the workbench: pages, uploads, and how it starts and ends."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from urllib.parse import parse_qs, quote

from fastapi import Request
from fastapi.responses import JSONResponse, PlainTextResponse, Response
from nicegui import app, background_tasks, ui
from nicegui.server import Server
from starlette.requests import ClientDisconnect
from starlette.types import ASGIApp, Receive, Scope, Send

from pretravel.app.access import Access, Guard
from pretravel.app.jobs import WORKS, listen_to_library
from pretravel.app.project import LARGEST_PROJECT, Project, StoredFile
from pretravel.app.project_file import PROJECT_ENDING, project_bytes, project_of
from pretravel.app.project_page import project_page
from pretravel.app.recognised import Kind, kind_elsewhere
from pretravel.app.screens import SCREENS, Screen, title_of_screen
from pretravel.app.session import NO_PROJECT, SESSION, address_in
from pretravel.app.shell import STATIC, all_tasks_page, help_page, home_page, screen_page, task_page
from pretravel.app.terminal_text import OneLine
from pretravel.app.uploads import UPLOADS, Slot, limited_content, parted
from pretravel.base import PretravelError
from pretravel.show import FIT_SCRIPT


def serve(access: Access, port: int, *, listening: Callable[[], None]) -> None:
    """Run the server until it is interrupted.

    Parameters
    ----------
    access : Access
    port : int
    listening : callable
        Called when the server answers.
    """
    _add_pages()
    app.add_middleware(_KnownProject)
    app.add_middleware(Guard, access=access)  # the one that is added last is asked first
    # Its bar has no name for readers of a screen; uploads and work show their own progress.
    app.config.quasar_config["loadingBar"]["skipHijack"] = True
    listen_to_library()
    for name in ("nicegui", "uvicorn", "uvicorn.error", "uvicorn.access"):
        logging.getLogger(name).addFilter(OneLine())

    async def announce() -> None:
        while not Server.instance.started:
            await asyncio.sleep(0.02)
        listening()

    app.on_startup(lambda: background_tasks.create(announce()))
    app.on_shutdown(_end)
    with suppress(KeyboardInterrupt):  # the way to end it
        ui.run(
            host=access.host,
            port=port,
            title="pretravel",
            language="en-US",
            dark=None,
            reload=False,
            show=False,
            show_welcome_message=False,
            tailwind=False,
            favicon=Path(__file__).parent / "static" / "icon.svg",
            uvicorn_logging_level="error",
            timeout_graceful_shutdown=2,
            # A browser that is busy with a picture in space, or a computer with finite elements,
            # answers late; it must not load the page again while something is typed.
            reconnect_timeout=60.0,
            server_header=False,
        )


def _end() -> None:
    SESSION.save_now()  # first: what was dropped while something was computed is not lost
    WORKS.stop_all()


class _KnownProject:
    """Answers 404 where the project of an address is none, instead of showing another one."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve."""
        if scope["type"] == "http":
            query = parse_qs(scope.get("query_string", b"").decode("latin-1"))
            asked = query.get("project", [""])[-1]
            if asked and SESSION.of(asked) is None:
                await PlainTextResponse(NO_PROJECT, 404)(scope, receive, send)
                return
        await self._app(scope, receive, send)


def _add_pages() -> None:
    app.add_static_file(local_file=FIT_SCRIPT, url_path=f"{STATIC}/fit.js")
    app.add_static_files(STATIC, str(Path(__file__).parent / "static"))
    ui.page("/")(home_page)
    ui.page("/help")(help_page)
    ui.page("/project")(project_page)
    for screen in SCREENS:
        ui.page(f"/{screen.name}")(_page_of(screen))
    ui.page("/tasks")(all_tasks_page)
    ui.page("/task/{name}")(task_page)
    app.post("/upload/{project}/{screen}/{purpose}")(receive_file)
    app.post("/project/open")(receive_project)
    app.get("/project/download")(send_project)


_LARGEST_FILE = 100_000_000
"""Of a file that is taken to another screen."""
_BROKEN = JSONResponse({"error": "the file arrived incomplete: give it again"}, status_code=400)


def _page_of(screen: Screen) -> Callable[[], None]:
    def show() -> None:
        screen_page(screen)

    return show


async def receive_file(
    project: str, screen: str, purpose: str, name: str, request: Request, head: int = 0
) -> JSONResponse:
    """Take files for a slot; the answer to a fault is its text, and where the file belongs.

    With a `head` there are several; see `parted`.
    """
    try:
        slot = UPLOADS.slot(project, screen, purpose)
        slot.check_name(name)
        limit = LARGEST_PROJECT if head else slot.limit
        content = await limited_content(request.stream(), limit, name)
        session = SESSION.of(project)
        if session is None or slot.state is not session.project.screen(screen):
            raise PretravelError(f"the project was closed: load this page, and give {name} again")
        files = parted(content, head) if head else (StoredFile(name, content),)
        for file in files:
            slot.check_name(file.name)
            if len(file.content) > slot.limit:
                raise PretravelError(f"{file.name} is larger than {slot.limit / 1e6:g} MB")
            elsewhere = kind_elsewhere(file.content, purpose)
            if elsewhere is not None:
                return _belongs(file.name, elsewhere, session.project)
        slot.store(files, session.project.size)
        if slot.state.files[purpose]:  # not one that only filled in fields
            session.project.named_after(files[0].name)
    except PretravelError as error:
        return JSONResponse({"error": str(error)}, status_code=422)
    except ClientDisconnect:
        return _BROKEN
    return JSONResponse({"error": ""})


def _belongs(name: str, kind: Kind, project: Project) -> JSONResponse:
    """What is said of a file that belongs to another screen, with the way there."""
    answer = {"error": f"{name} is {kind.words}. Nothing was changed."}
    if not kind.screen:
        answer |= {
            "offer": "Open this project",
            "url": "/project/open",
            "address": address_in("/project", project),
        }
        return JSONResponse(answer, status_code=422)
    state = project.screen(kind.screen)
    UPLOADS.open(
        project.identity,
        Slot(state, kind.purpose, (), kind.several, _LARGEST_FILE, settings=kind.settings),
    )
    answer |= {
        "offer": f"Take it to “{title_of_screen(kind.screen)}”",
        "url": f"/upload/{project.identity}/{kind.screen}/{kind.purpose}",
        "address": address_in(f"/{kind.screen}", project),
    }
    return JSONResponse(answer, status_code=422)


async def receive_project(name: str, request: Request) -> JSONResponse:
    """Open a project that the browser sends."""
    try:
        content = await limited_content(request.stream(), LARGEST_PROJECT, name)
        session = SESSION.take(await asyncio.to_thread(project_of, content, name))
    except PretravelError as error:
        return JSONResponse({"error": str(error)}, status_code=422)
    except ClientDisconnect:
        return _BROKEN
    return JSONResponse({"error": "", "address": address_in("/", session.project)})


async def send_project(project: str = "") -> Response:
    """A project, by its identity, as a file."""
    session = SESSION.of(project) if project else SESSION.current
    if session is None:
        return PlainTextResponse(NO_PROJECT, 404)
    snapshot = session.project.snapshot()
    content = await asyncio.to_thread(project_bytes, snapshot)
    name = quote("".join(c if c.isalnum() else "-" for c in snapshot.name) + PROJECT_ENDING)
    headers = {"Content-Disposition": f"attachment; filename*=UTF-8''{name}"}
    return Response(content, media_type="application/zip", headers=headers)
