"""The start of the workbench: address, project, and then the server."""

from __future__ import annotations

import gc
import os
import signal
import socket
import tempfile
import threading
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from html import escape
from pathlib import Path

from pretravel.base import PretravelError, needed

USUAL_PORT = 8765
_USUAL_GARBAGE = 700, 10, 10
"""Of Python: a command that ends soon leaves its garbage, a server runs all day."""


def start(
    project: Path | None,
    host: str,
    port: int | None,
    *,
    browser: bool,
    say: Callable[[str], None],
) -> None:
    """Start the server, and return when it is interrupted.

    Parameters
    ----------
    project : Path or None
        None: the last one.
    host : str
        Address to listen on.
    port : int or None
        0: any free one. None: the usual one, or any free one.
    browser : bool
        Whether a browser is opened.
    say : callable
        Prints a line.

    Raises
    ------
    PretravelError
        The port is in use, or the project cannot be opened.
    MissingExtraError
        Without the extra ``app``.
    """
    needed("nicegui", "app")
    chosen = free_port(host, port)
    from pretravel.app.access import Access
    from pretravel.app.session import SESSION

    access = Access.of(host)
    reached = own_address() if host in ("0.0.0.0", "::") else host
    shown = f"[{reached}]" if ":" in reached else reached
    address = f"http://{shown}:{chosen}/"
    SESSION.start(project, address, say)
    # NiceGUI reads it when it is imported; nothing is stored there.
    os.environ["NICEGUI_STORAGE_PATH"] = os.devnull
    from pretravel.app.server import serve

    page = f"{address}?token={access.token}"
    # Of this user alone. A browser that is a snap reads no temporary folder, but the user's own.
    place = Path.home() if Path("/snap/bin").is_dir() else None
    with tempfile.TemporaryDirectory(prefix="pretravel-", dir=place) as folder:

        def listening() -> None:
            gc.freeze()  # what was imported stays
            gc.set_threshold(*_USUAL_GARBAGE)
            say(f"The workbench is at {page} (Ctrl-C ends it)")
            say(f"The project is saved in {SESSION.current.path}")
            if browser:
                shown = _forwarding(Path(folder), page)
                # A browser in the terminal, or one that was not running, can keep it waiting.
                threading.Thread(target=webbrowser.open, args=(shown,), daemon=True).start()

        try:
            with ended_by_signals():
                serve(access, chosen, listening=listening)
        finally:
            said = SESSION.end()
        if said:
            raise PretravelError("; ".join(said))


@contextmanager
def ended_by_signals() -> Iterator[None]:
    """The end of a terminal and SIGTERM end the server as Ctrl-C does: projects are saved."""

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    def ask(*_: object) -> None:
        os.kill(os.getpid(), signal.SIGTERM)  # the server has taken it over

    ways = {"SIGTERM": interrupt, "SIGHUP": ask}
    before = {
        getattr(signal, name): signal.signal(getattr(signal, name), way)
        for name, way in ways.items()
        if hasattr(signal, name)  # not on Windows
    }
    try:
        with suppress(KeyboardInterrupt):  # the server raises it again when it has ended
            yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _forwarding(folder: Path, address: str) -> str:
    """The address of a page that forwards: other users can read with what a browser is started."""
    page = folder / "open.html"
    page.touch(mode=0o600)
    page.write_text(
        '<!doctype html><meta charset="utf-8"><meta name="referrer" content="no-referrer">'
        f'<meta http-equiv="refresh" content="0; url={escape(address)}"><title>pretravel</title>'
        f'<a href="{escape(address)}">Open the workbench</a>\n',
        encoding="utf-8",
    )
    return page.as_uri()


def own_address() -> str:
    """The address of this computer for others in its network; of this computer without one.

    >>> own_address().count(".")
    3
    """
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # of no computer (RFC 5737); nothing is sent
            return str(probe.getsockname()[0])
        except OSError:
            return "127.0.0.1"


def free_port(host: str, port: int | None) -> int:
    """A port that can be listened on.

    Raises
    ------
    PretravelError
        The port that was asked for is in use, or the address is not of this computer.
    """
    reason = ""
    for one in (USUAL_PORT, 0) if port is None else (port,):
        try:
            with socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET) as probe:
                if os.name == "posix":  # a port that was left just now is free
                    probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                probe.bind((host, one))
                return int(probe.getsockname()[1])
        except OSError as error:
            reason = error.strerror or str(error)
    raise PretravelError(
        f"cannot listen on {host}{'' if port is None else f', port {port}'}: {reason}. Is another "
        "workbench running there? Choose another port (0 takes any free one), or an address of "
        "this computer",
        inputs=("host", "port"),
    )
