"""Processes of their own that begin as a copy of this one: nothing is imported anew.

A reader that runs in a process of its own imports its libraries first, for half a second of
processor time; hundreds of tests read maps and parts. The work, its limits and its crashes are
those of the real process. Tests of the real one use the fixture ``real_processes``.
"""

from __future__ import annotations

import faulthandler
import gc
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path

import h5netcdf  # noqa: F401  (imported once, for all copies)
import netgen.occ  # noqa: F401

from pretravel.files import netcdf, netcdf_worker
from pretravel.surface.cad import file_to_brep, iges_reader, kernel_process, step_reader

REAL = (netcdf.run_worker, kernel_process.run_kernel)


def forked_worker(content: bytes) -> tuple[int, bytes]:
    """As `pretravel.files.netcdf.run_worker`."""

    def work() -> None:
        with os.fdopen(1, "wb", closefd=False) as out:
            out.writelines(netcdf_worker.answer(content, netcdf.largest_content(content)))

    code, answer, _ = _forked(work)
    return code, answer


def forked_kernel(copy: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """As `pretravel.surface.cad.kernel_process.run_kernel`."""
    size = copy.stat().st_size
    memory, written, seconds = (
        limit.fixed + limit.per_byte * size
        for limit in (kernel_process.MEMORY, kernel_process.WRITTEN, kernel_process.TIME)
    )

    def work() -> None:
        most_memory = str(int(memory + _address_space()))
        sys.argv[:] = ["", str(copy), str(folder), most_memory, str(int(written))]
        os.chdir(folder)
        most = int(time.process_time() + seconds)
        resource.setrlimit(resource.RLIMIT_CPU, (most, most + 1))
        file_to_brep.main()

    code, out, err = _forked(work)
    return subprocess.CompletedProcess(
        "forked", code, out.decode(errors="replace"), err.decode(errors="replace")
    )


def use(worker: Callable[..., object], kernel: Callable[..., object]) -> None:
    """Let the readers of maps and parts use these functions."""
    netcdf.run_worker = worker
    iges_reader.run_kernel = step_reader.run_kernel = kernel


def _address_space() -> int:
    """Of this process. [bytes]"""
    pages = int(Path("/proc/self/statm").read_text("ascii").split()[0])
    return pages * resource.getpagesize()


def _forked(work: Callable[[], None]) -> tuple[int, bytes, bytes]:
    """Return code, stdout and stderr of a copy of this process that does some work."""
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # other threads take no part
            child = os.fork()
        if child == 0:
            faulthandler.disable()  # a crash is an answer
            gc.disable()  # it would copy all that this process has in memory
            os.dup2(out.fileno(), 1)
            os.dup2(err.fileno(), 2)
            os._exit(_code_of(work))
        try:
            code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        except BaseException:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            raise
        for written in (out, err):
            written.seek(0)
        return code, out.read(), err.read()


def _code_of(work: Callable[[], None]) -> int:
    """What the interpreter would return after the work."""
    try:
        work()
    except SystemExit as end:
        if isinstance(end.code, str):
            os.write(2, end.code.encode())
        return int(end.code is not None)
    except BaseException as error:
        os.write(2, repr(error).encode())
        return 1
    return 0
