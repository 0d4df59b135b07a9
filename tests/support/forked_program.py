"""A program that begins as a copy of this process: what is imported here is imported there."""

from __future__ import annotations

import asyncio
import faulthandler
import gc
import logging
import os
import runpy
import signal
import subprocess
import sys
import time
import traceback
import warnings
from collections.abc import Mapping
from pathlib import Path
from typing import TextIO

from tests.support import forked_processes

OF_THE_PROGRAM = ("nicegui", "pretravel.workbench")
"""Packages with a state of a server; the copy imports them anew."""


class ForkedProgram:
    """A running program, with what `subprocess.Popen` has.

    Attributes
    ----------
    pid : int
    stdout : file
        What it prints, on both channels.
    """

    def __init__(
        self, program: tuple[str, ...], folder: Path, environment: Mapping[str, str]
    ) -> None:
        source, sink = os.pipe()
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # other threads take no part
            self.pid = os.fork()
        if self.pid == 0:
            _become(program, folder, environment, sink)
        os.close(sink)
        self.stdout: TextIO = os.fdopen(source, encoding="utf-8")
        self._code: int | None = None

    def poll(self) -> int | None:
        """The exit code; None while it runs."""
        if self._code is None:
            ended, status = os.waitpid(self.pid, os.WNOHANG)
            if ended:
                self._code = os.waitstatus_to_exitcode(status)
        return self._code

    def wait(self, timeout: float) -> int:
        """The exit code, once it has ended within a time in seconds."""
        stop = time.monotonic() + timeout
        while (code := self.poll()) is None:
            if time.monotonic() > stop:
                raise subprocess.TimeoutExpired("forked", timeout)
            time.sleep(0.02)
        return code

    def send_signal(self, number: int) -> None:
        """Send a signal to a process that runs."""
        if self.poll() is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        """End it at once."""
        self.send_signal(signal.SIGKILL)
        self.wait(timeout=60.0)


def _become(
    program: tuple[str, ...], folder: Path, environment: Mapping[str, str], output: int
) -> None:
    """Run the program in this process, which is a copy, and end."""
    code = 1
    try:
        _without_the_tests(folder, environment, output)
        if program[0] == "-m":
            sys.argv = ["pretravel", *program[2:]]
            runpy.run_module(program[1], run_name="__main__", alter_sys=True)
        else:
            sys.argv = list(program)
            runpy.run_path(program[0], run_name="__main__")
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stdout.flush()
        os._exit(code)


def _without_the_tests(folder: Path, environment: Mapping[str, str], output: int) -> None:
    """Take away what pytest, and the browser's event loop, have put into this process."""
    gc.freeze()  # a look at the objects of the tests would copy them
    faulthandler.disable()
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    asyncio._set_running_loop(None)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.closerange(3, os.sysconf("SC_OPEN_MAX"))
    sys.stdout = os.fdopen(1, "w", buffering=1, encoding="utf-8", closefd=False)
    sys.stderr = os.fdopen(2, "w", buffering=1, encoding="utf-8", closefd=False)
    logging.getLogger().handlers.clear()
    warnings.resetwarnings()
    for category in (DeprecationWarning, ImportWarning, ResourceWarning):
        warnings.simplefilter("ignore", category)  # as Python begins
    sys.path[:] = [str(Path(place).resolve()) for place in sys.path]
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    forked_processes.use(*forked_processes.REAL)  # threads of a server are not copied
    for name in list(sys.modules):
        if name.startswith(OF_THE_PROGRAM):
            del sys.modules[name]
