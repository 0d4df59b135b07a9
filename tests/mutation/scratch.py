"""A scratch copy of the project, and processes that have the libraries but nothing of pretravel.

A fault is written into the copy, so that programs which a test starts have it too. A test runs in a
fork of this process: numpy, scipy, netgen and pytest are loaded once, pretravel anew each time.
"""

from __future__ import annotations

import contextlib
import importlib
import os
import pickle
import shutil
import signal
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from select import select
from typing import Any

PROJECT = Path(__file__).parents[2]
ROOMS = (
    "prediction", "surface", "maps", "qualification", "measurement",
    "six_seats", "design", "laboratory", "drawing", "controls",
)  # fmt: skip
"""Rooms of pretravel that get faults."""
# Plugins are loaded before pytest can rewrite them.
PYTEST_OPTIONS = (
    "-q", "-p", "no:cacheprovider", "-W", "ignore::pytest.PytestAssertRewriteWarning",
)  # fmt: skip
_LEFT_OUT = (".*", "__pycache__", "build", "dist", "demo-output", "linuxcnc-demo", "hard-corpus")
_LIBRARIES = (
    "numpy.testing", "scipy.fft", "scipy.integrate", "scipy.interpolate", "scipy.linalg",
    "scipy.ndimage", "scipy.optimize", "scipy.signal", "scipy.sparse.linalg", "scipy.spatial",
    "scipy.special", "scipy.stats", "netgen.occ", "netgen.meshing", "skfem", "skfem.helpers",
    "meshio", "pypardiso", "shapely", "threadpoolctl", "xarray", "h5py", "h5netcdf", "cattrs",
    "tomlkit", "jinja2", "platformdirs", "typer", "typer.testing", "rich.table", "rich.progress",
    "plotly.graph_objects", "matplotlib.pyplot", "GTC", "xml.etree.ElementTree",
    "coverage", "xdist.scheduler",
)  # fmt: skip
_OURS = ("pretravel", "tests", "conftest")
_GRACE = 20.0
"""A process that does not end itself in its time is ended after this in addition. [s]"""


def load_libraries() -> None:
    """Load what every test needs; one that is not installed is left out.

    Raises
    ------
    RuntimeError
        Threads run in this process, so that it must not be forked.
    """
    import matplotlib as mpl

    mpl.use("agg")
    for name in _LIBRARIES:
        with contextlib.suppress(ImportError):
            importlib.import_module(name)
    if any(name.partition(".")[0] == "pretravel" for name in sys.modules):
        raise RuntimeError("pretravel is loaded already: faults in its files would not be seen")
    names = [p.read_text().strip() for p in Path("/proc/self/task").glob("*/comm")]
    # The memory allocator of pyarrow has a thread that a fork may lose.
    if len(names) - names.count("jemalloc_bg_thd") > 1:
        raise RuntimeError(f"threads run ({names}): set OPENBLAS_NUM_THREADS=1, OMP_NUM_THREADS=1")


class Scratch:
    """A copy of the project in a folder, with at most one fault.

    Parameters
    ----------
    folder : Path
        Made here; an older one is removed.
    project : Path
        What is copied.
    """

    def __init__(self, folder: Path, project: Path = PROJECT) -> None:
        self.project = folder / "project"
        self.temporary = folder / "temporary"
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(project, self.project, ignore=shutil.ignore_patterns(*_LEFT_OUT))
        self.temporary.mkdir()
        self._count = 0

    @contextlib.contextmanager
    def changed(self, path: str, content: bytes) -> Iterator[None]:
        """While this lasts, a file has another content."""
        file = self.project / path
        original, times = file.read_bytes(), file.stat()
        try:
            file.write_bytes(content)
            # Compiled modules are known by the second of their file and its size: no two alike.
            self._count += 1
            later = int(times.st_mtime) + 1000 * self._count
            os.utime(file, (later, later))
            yield
        finally:
            file.write_bytes(original)
            os.utime(file, (times.st_atime, times.st_mtime))

    def in_fork(
        self, work: Callable[[Callable[[Any], None]], None], seconds: float
    ) -> tuple[list[Any], str]:
        """Do work in a fork of this process, with the copy as its folder and its pretravel.

        Parameters
        ----------
        work : callable
            Gets a function that sends a value to this process.
        seconds : float
            On the clock; then the process is killed.

        Returns
        -------
        list
            What was sent.
        str
            Empty, or ``crashed`` or ``hangs``.
        """
        reading, writing = os.pipe()
        process = os.fork()
        if process == 0:
            os.close(reading)
            self._child(work, writing)
        os.close(writing)
        content, hangs = _read(reading, seconds)
        os.close(reading)
        # Programs that a test started are in its group.
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(process, signal.SIGKILL)
        _, status = os.waitpid(process, 0)
        sent, whole = _unpickled(content)
        ended = os.WIFEXITED(status) and os.WEXITSTATUS(status) == 0 and whole
        return sent, "hangs" if hangs else "" if ended else "crashed"

    def _child(self, work: Callable[[Callable[[Any], None]], None], writing: int) -> None:
        code = 1
        try:
            os.setpgid(0, 0)
            os.chdir(self.project)
            log = os.open(self.temporary / "log", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(log, 1)
            os.dup2(log, 2)
            source = str(self.project / "src")
            sys.path[:] = [source, str(self.project), *_without_project(sys.path)]
            os.environ["PYTHONPATH"] = source
            for name in [n for n in sys.modules if n.partition(".")[0] in _OURS]:
                del sys.modules[name]

            def send(value: Any) -> None:
                content = pickle.dumps(value)
                view = memoryview(len(content).to_bytes(8, "big") + content)
                while view:
                    view = view[os.write(writing, view) :]

            work(send)
            code = 0
        except BaseException:
            import traceback

            traceback.print_exc()
        finally:
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(code)

    def log(self) -> str:
        """What the last process wrote."""
        return (self.temporary / "log").read_text(encoding="utf-8", errors="replace")


def _without_project(paths: list[str]) -> list[str]:
    ours = {PROJECT, PROJECT / "src"}
    return [p for p in paths if Path(p or ".").resolve() not in ours]


def _read(reading: int, seconds: float) -> tuple[bytes, bool]:
    """All that comes, and whether the time was over before the end."""
    content, end = bytearray(), time.monotonic() + seconds + _GRACE
    while (left := end - time.monotonic()) > 0.0:
        if select([reading], [], [], left)[0]:
            part = os.read(reading, 1 << 20)
            if not part:
                return bytes(content), False
            content += part
    return bytes(content), True


def _unpickled(content: bytes) -> tuple[list[Any], bool]:
    sent, place = [], 0
    while place + 8 <= len(content):
        size = int.from_bytes(content[place : place + 8], "big")
        if place + 8 + size > len(content):
            return sent, False
        sent.append(pickle.loads(content[place + 8 : place + 8 + size]))
        place += 8 + size
    return sent, place == len(content)
