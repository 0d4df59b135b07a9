"""How large an installation is; how soon the workbench shows a page and a verdict, its memory."""

from __future__ import annotations

import os
import re
import socket
import subprocess
import tempfile
import time
import urllib.error
import urllib.request
from collections.abc import Iterator, Sequence
from importlib.metadata import PackageNotFoundError, distribution, requires
from importlib.util import find_spec
from pathlib import Path

import psutil
from packaging.requirements import Requirement

from benchmarks.commands import PRETRAVEL, python_file, spent
from benchmarks.results import Figures, Row, memory_text, seconds_text
from benchmarks.sizes import Sizes
from pretravel.task.example_data import example_folder
from tests.browser.screens import settled
from tests.browser.workbench_server import (
    CHROMIUM,
    WITHOUT_SCENES,
    new_context,
    opened,
    running_browser,
    running_workbench,
)

_MOST_WAIT = 60.0
_EMPTY_PAGE = """
from nicegui import ui
ui.label("empty")
ui.run(port={port}, show=False, reload=False)
"""


def _needed(name: str, extras: Sequence[str] = ()) -> Iterator[str]:
    """The packages that a package requires, where they are installed."""
    environments = [{"extra": extra} for extra in ("", *extras)]
    for text in requires(name) or ():
        one = Requirement(text)
        if one.marker is None or any(map(one.marker.evaluate, environments)):
            yield one.name.lower()


def _with_all_needed(names: Sequence[str]) -> set[str]:
    found: set[str] = set()
    left = list(names)
    while left:
        name = left.pop()
        if name in found:
            continue
        try:
            left += _needed(name)
        except PackageNotFoundError:
            continue
        found.add(name)
    return found


def _size(name: str) -> float:
    """Bytes of the files of an installed package, without what Python compiles from them."""
    found = distribution(name)
    paths = [Path(str(found.locate_file(file))) for file in found.files or ()]
    return float(sum(p.stat().st_size for p in paths if p.suffix != ".pyc" and p.is_file()))


_GOALS = {"the core": 340e6, "all extras": 1.2e9}
"""Sizes of an installation. [bytes]"""


def _installation() -> list[Row]:
    """The core and all extras with all that they need, against the libraries of the arithmetic."""
    extras = set(distribution("pretravel").metadata.get_all("Provides-Extra") or ()) - {"all"}
    libraries = _with_all_needed(["numpy", "scipy", "matplotlib"])
    theirs = sum(map(_size, libraries))
    rows = []
    for what, chosen in (("the core", ()), ("all extras", sorted(extras))):
        sizes = {name: _size(name) for name in _with_all_needed(list(_needed("pretravel", chosen)))}
        ours, largest = sum(sizes.values()), max(sizes, key=lambda name: sizes[name])
        said = "met" if ours <= _GOALS[what] else "missed, for solver, mesher and tables"
        note = (
            f"goal {memory_text(_GOALS[what])}, {said}: {memory_text(ours)} in {len(sizes)} "
            f"packages beside pretravel, of it {largest} {memory_text(sizes[largest])}; numpy, "
            "scipy and matplotlib with all that they need: "
            f"{memory_text(theirs)} in {len(libraries)}"
        )
        rows.append(
            Row(f"installation of {what}", "", None, "numpy, scipy, matplotlib", None, note)
        )
    return rows


def _first_page(command: Sequence[str], port: int, folder: Path) -> tuple[float, float]:
    """Time of the processor until a server has sent its first page, and its memory then."""
    environment = {
        **os.environ,
        **dict.fromkeys(("XDG_CACHE_HOME", "XDG_DATA_HOME", "XDG_CONFIG_HOME"), str(folder)),
        "PYTHONDONTWRITEBYTECODE": "",
    }
    environment.pop("PYTEST_CURRENT_TEST", None)  # NiceGUI behaves otherwise under pytest
    said = folder / "said.txt"
    opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
    with said.open("wb") as stream:
        running = subprocess.Popen(
            command, cwd=folder, env=environment, stdout=stream, stderr=stream
        )
        try:
            process, end = psutil.Process(running.pid), time.monotonic() + _MOST_WAIT
            while True:
                # The workbench says its address with a key.
                address = re.search(rf"http://127.0.0.1:{port}/[?]\S*", said.read_text())
                try:
                    url = address[0] if address else f"http://127.0.0.1:{port}/"
                    with opener.open(url, timeout=30.0) as page:
                        page.read()
                    break
                except (urllib.error.URLError, ConnectionError):
                    if time.monotonic() > end or running.poll() is not None:
                        raise
                    time.sleep(0.02)
            times = process.cpu_times()
            return times.user + times.system, float(process.memory_info().rss)
        finally:
            running.terminate()
            running.wait()


def _free_port() -> int:
    with socket.socket() as asked:
        asked.bind(("127.0.0.1", 0))
        return int(asked.getsockname()[1])


_MOST_AFTER_UPLOADS = 200e6
"""Memory of the server. [bytes]"""


def _drops(uploads: int) -> list[Row]:
    """The first verdict after the drop of a file, and memory after more of them, in a browser."""
    touches = (example_folder() / "sphere_touches.csv").read_bytes()
    with (
        tempfile.TemporaryDirectory() as name,
        running_workbench(Path(name)) as workbench,
        running_browser(WITHOUT_SCENES) as browser,
    ):
        server = psutil.Process(workbench.process.pid)
        page = new_context(browser, reduced_motion="reduce").new_page()
        opened(page, f"{workbench.address}engineer")
        page.get_by_label("Diameter of the reference [mm]").fill("24.9987")
        page.get_by_label("Diameter of the tip [mm]").fill("6")
        page.get_by_label("Diameter of the tip [mm]").blur()
        taken, clock = [], []
        for count in range(1 + uploads):  # what is imported before is none of a verdict
            before, start = server.cpu_times(), time.monotonic()
            dropped = {"name": f"{count}.csv", "mimeType": "text/csv", "buffer": touches}
            page.set_input_files('.file-drop-input[data-url$="/engineer/touches"]', dropped)
            page.wait_for_selector(f".file-name:has-text('{count}.csv')")
            page.wait_for_selector(".verdict-card")
            settled(page)
            after = server.cpu_times()
            clock.append(time.monotonic() - start)
            taken.append(after.user + after.system - before.user - before.system)
        memory = float(server.memory_info().rss)
    path = str(example_folder() / "sphere_touches.csv")
    words = ("qualify", path, "--diameter", "24.9987", "--tip-diameter", "6")
    command = spent([*PRETRAVEL, *words], {"PYTHONDONTWRITEBYTECODE": ""}).processor
    said = "met" if taken[0] <= max(1.0, 1.2 * command) else "missed: the fit, and the pictures"
    note = (
        f"goal 1 s, on a quiet computer 1.2 times the command, {said}; its server, with the "
        f"pictures; {seconds_text(clock[0])} by the clock"
    )
    kept = "met" if memory <= _MOST_AFTER_UPLOADS else "missed: its modules take 130 MB"
    goal = memory_text(_MOST_AFTER_UPLOADS)
    return [
        Row("first verdict after a drop into the workbench", "", taken[0],
            "the command", command, note),
        Row("uploads into the workbench", f"{uploads}", None,
            note=f"memory: goal {goal}, {kept}: {memory_text(memory)}"),
    ]  # fmt: skip


def _workbench(repeats: int) -> Row:
    """The workbench's first page against an empty page of NiceGUI."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        ours: list[tuple[float, float]] = []
        theirs: list[tuple[float, float]] = []
        for _ in range(1 + repeats):  # modules are compiled in the first one
            port = _free_port()
            command = [*PRETRAVEL, "app", "--no-browser", "--port", str(port)]
            ours.append(_first_page(command, port, folder))
            port = _free_port()
            empty = python_file(folder, "empty.py", _EMPTY_PAGE.format(port=port))
            theirs.append(_first_page(empty, port, folder))
    middle = repeats // 2
    (first, memory), (reference, _) = (sorted(each[1:])[middle] for each in (ours, theirs))
    said = "met" if first <= 1.5 * reference else "missed: modules of the tasks that it lists"
    note = f"goal 1.5 times, {said}; {memory_text(memory)} then"
    other = "an empty page of NiceGUI"
    return Row("first page of the workbench", "", first, other, reference, note)


def installed(sizes: Sizes) -> Figures:
    """Size of the installation, and the start of the workbench."""
    rows = _installation()
    if find_spec("nicegui") is not None:
        rows.append(_workbench(min(sizes.repeats, 3)))
        if CHROMIUM.exists():
            rows += _drops(sizes.sets // 3)
    return Figures(tuple(rows))
