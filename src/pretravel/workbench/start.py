"""The start of the workbench: address, data folder, and then the server."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable
from pathlib import Path

from pretravel.errors import PretravelError

USUAL_PORT = 8765


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
    """
    del project
    chosen = free_port(host, port)
    # NiceGUI reads it when it is imported; nothing is stored there.
    os.environ["NICEGUI_STORAGE_PATH"] = os.fspath(Path(os.devnull))
    from pretravel.workbench.server import serve

    say(f"The workbench is at http://{host}:{chosen}/ (Ctrl-C ends it)")
    serve(host, chosen, show=browser)


def free_port(host: str, port: int | None) -> int:
    """A port that can be listened on.

    Raises
    ------
    PretravelError
        The port that was asked for is in use, or the address is not of this computer.
    """
    wanted = (USUAL_PORT, 0) if port is None else (port,)
    for one in wanted:
        family = socket.AF_INET6 if ":" in host else socket.AF_INET
        with socket.socket(family) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((host, one))
            except OSError as error:
                reason = error.strerror or str(error)
                continue
            return int(probe.getsockname()[1])
    raise PretravelError(
        f"cannot listen on {host}, port {port}: {reason}. Is another workbench running there? "
        "Choose another port; 0 takes any free one",
        inputs=("port",),
    )
