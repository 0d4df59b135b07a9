"""End commands that write at random moments: ``python -m tests.hard.interrupted_writes``.

A moment is a kill (signal 9) after a random time or before a random call that changes a file, a
disk that is full after a random number of bytes, or a folder that cannot be written. After each,
every output must be the old file or the whole new one; a fault must end with exit code 2. After the
next run that is not disturbed nothing is left beside the outputs.
"""

from __future__ import annotations

import argparse
import contextlib
import ctypes
import io
import os
import random
import resource
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pretravel.base.errors import PretravelError
from pretravel.files.probe_history import read_history
from tests.support.touches_of_days import day_of

_OLD = b'"the old output, of a run that ended well; <html>"\n'
_BEGIN = {
    ".nc": b"\x89HDF\r\n\x1a\n",
    ".parquet": b"PAR1",
    ".pdf": b"%PDF-",
    ".png": b"\x89PNG\r\n\x1a\n",
    ".zip": b"PK\x03\x04",
}
EXAMPLES = Path(__file__).parents[2] / "examples" / "data"
SPHERE = EXAMPLES / "sphere_touches.csv"
_CHANGES = {"os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.chmod", "os.truncate"}
"""Audit events of calls that change files, beside opening for writing."""
_LONGEST = 120.0
"""A command that takes longer hangs. [s]"""


@dataclass(frozen=True)
class WritingCommand:
    """A command line; ``{}`` is the folder of its inputs and outputs.

    Attributes
    ----------
    kept : tuple of str
        What a run that fails leaves, so that the next one goes on where it ended.
    """

    name: str
    line: str
    outputs: tuple[str, ...]
    needs: tuple[str, ...] = ()
    kept: tuple[str, ...] = ()

    def arguments(self, folder: Path) -> list[str]:
        """The words after ``pretravel``."""
        return [self.name.split(":")[0], *self.line.format(folder).split()]


MAP = ("map.json",)
HARMONIC = ("h.json",)
COMMANDS = tuple(
    WritingCommand(*row)
    for row in (
        ("qualify", (f"{SPHERE} --diameter 24.9987 --tip-diameter 6 --kind mean -o {{0}}/map.json "
         "--plot {0}/map.png"), ("map.json", "map.png")),
        ("study", "preload-and-seats --workers 1 -o {0}/study.nc", ("study.nc",), (),
         ("study.nc.journal",)),
        ("qualify:csv", (f"{SPHERE} --diameter 24.9987 --tip-diameter 6 --kind mean "
         "-o {0}/mean.csv"), ("mean.csv",)),
        ("qualify:harmonic", (f"{SPHERE} --diameter 24.9987 --tip-diameter 6 --kind harmonic "
         "-o {0}/h.json"), HARMONIC),
        ("predict", "omp40-2 --azimuth 0:350:10 -o {0}/predicted.csv", ("predicted.csv",)),
        ("predict:json", "omp40-2 --azimuth 0:350:10 -o {0}/predicted.json",
         ("predicted.json",)),
        ("predict:nc", "omp40-2 --azimuth 0:350:10 -o {0}/predicted.nc", ("predicted.nc",)),
        ("predict:html", "omp40-2 --azimuth 0:330:30 -o {0}/p.html", ("p.html",)),
        ("report", "{0}/p.html -o {0}/bound.html", ("bound.html",), ("p.html",)),
        ("slide", "omp40-2 --surface convex --at 0.5,0.5 -o {0}/slide.csv", ("slide.csv",)),
        ("plan", "sphere:radius=12.5 --grid 6x4 --max-polar 60 -o {0}/plan.csv", ("plan.csv",)),
        ("simulate", (f"omp40-2 --surface sphere:radius=12.5 --targets {EXAMPLES}/targets.csv "
         "--leave-out -o {0}/touches.csv"), ("touches.csv",)),
        ("machine", "-o {0}/mill.toml", ("mill.toml",)),
        ("convert", f"{SPHERE} -o {{0}}/t.qif", ("t.qif",)),
        ("convert:parquet", f"{SPHERE} -o {{0}}/t.parquet", ("t.parquet",)),
        ("compensate", f"{SPHERE} --map {{0}}/map.json -o {{0}}/points.csv", ("points.csv",), MAP),
        ("compensate:nc", f"{SPHERE} --map {{0}}/map.json -o {{0}}/points.nc", ("points.nc",), MAP),
        ("export", "{0}/map.json --to linuxcnc -o {0}/subroutines", ("subroutines/",), MAP),
        ("export:file", "{0}/map.json --to renishaw -o {0}/radii.txt", ("radii.txt",), MAP),
        ("plan-touches", "--map {0}/h.json --count 9 -o {0}/few.csv", ("few.csv",), HARMONIC),
        ("verify", ("{0}/day1.csv --map {0}/h.json --diameter 24.9987 --history {0}/probe.jsonl "
         "-o {0}/v.json"), ("v.json", "probe.jsonl"), HARMONIC),
        ("compare", "{0}/map.json -o {0}/compare.csv", ("compare.csv",), MAP),
        ("check", f"iso10360-5 {SPHERE} --diameter 24.9987 --tip-diameter 6 -o {{0}}/check.json",
         ("check.json",)),
        ("pattern", "iso10360-5 --diameter 25 -o {0}/pattern.csv", ("pattern.csv",)),
        ("program sphere", "{0}/mill.toml --diameter 25 -o {0}/s.ngc", ("s.ngc",), ("mill.toml",)),
        ("program mdi", "-o {0}/mdi", ("mdi/",)),
        ("rig", " ".join(map(str, sorted((EXAMPLES / "rig").glob("*.csv"))[:4]))
         + " -o {0}/rig.csv", ("rig.csv",)),
        ("separate", f"{EXAMPLES}/redundancy_24x24.csv -o {{0}}/separation.csv",
         ("separation.csv",)),
        ("separation-plan", "--directions 12 --u-systematic 0.5 -o {0}/form.csv", ("form.csv",)),
        ("hysteresis", "omp40-2 --model rigid --azimuth 0 --cycles 2 --steps 30 -o {0}/h.csv",
         ("h.csv",)),
        (
            "verify:accept",
            (
                f"{SPHERE} --map {{0}}/h.json --diameter 24.9987 --history {{0}}/probe.jsonl "
                "--accept {0}/new.json"
            ),
            ("new.json",),
            HARMONIC,
        ),
        (
            "history",
            "{0}/probe.jsonl -o {0}/history.csv --plot {0}/history.png",
            ("history.csv", "history.png"),
            ("h.json", "probe.jsonl"),
        ),
        ("history:touches", (f"{SPHERE} --diameter 24.9987 --tip-diameter 6 --kind harmonic "
         "-o {0}/drift.csv --plot {0}/drift.png"), ("drift.csv", "drift.png")),
        (
            "program part",
            "{0}/mill.toml {0}/plan.csv -o {0}/p.ngc",
            ("p.ngc",),
            ("mill.toml", "plan.csv"),
        ),
        (
            "identify",
            "{0}/predicted.json --probe omp40-2 --free preload -o {0}/i.toml",
            ("i.toml",),
            ("predicted.json",),
        ),
        ("align", (f"{EXAMPLES}/bracket_touches.csv --part {EXAMPLES}/bracket.step "
         "--tip-diameter 6 --start 212,-48,-210,0,0,33 -o {0}/place.json --points {0}/part.csv"),
         ("place.json", "part.csv")),
        ("reversal", f"{EXAMPLES}/reversal_touches.csv -o {{0}}/means.csv", ("means.csv",)),
        ("repeat", f"{SPHERE} -o {{0}}/repeat.csv", ("repeat.csv",)),
        ("orientation", "{0}/h.json --probe omp40-2 --axis 0,1,0 -o {0}/turned.json",
         ("turned.json",), HARMONIC),
        ("check-budget", (f"{SPHERE} --diameter 24.9987 --tip-diameter 6 --kind harmonic "
         "--sets 20 -o {0}/shares.csv"), ("shares.csv",)),
        ("bundle", f"{SPHERE} --diameter 24.9987 -o {{0}}/bundle.zip", ("bundle.zip",)),
        ("measure", "{0}/points.csv --feature sphere -o {0}/ball.json", ("ball.json",),
         ("map.json", "points.csv")),
    )
)  # fmt: skip


@dataclass
class Outcome:
    """What happened at the moments of one command."""

    command: str
    moments: Counter[str] = field(default_factory=Counter)
    broken: list[str] = field(default_factory=list)


class Folder:
    """A folder of one command: its inputs, its outputs, and nothing else."""

    def __init__(self, command: WritingCommand) -> None:
        self.command = command
        self.path = Path(tempfile.mkdtemp(prefix="interrupted-"))
        self.path.chmod(0o755)
        (self.path / "tmp").mkdir()
        day_of(self.path, 1)  # not the touches of the map
        for other in COMMANDS:
            if set(other.outputs) & set(command.needs):
                self.run(other)
        self.inputs = self._listed()
        self._import_what_it_uses()
        began = time.perf_counter()
        assert self.run() in (0, 3), command
        self.seconds = time.perf_counter() - began
        self.expected = self._listed()
        self.outputs = sorted(name for name in self.expected - self.inputs if name != "probe.jsonl")
        assert self.outputs, command
        self.new = {name: (self.path / name).read_bytes() for name in self.outputs}

    def run(self, command: WritingCommand | None = None, **disturbed: float) -> int:
        """Run the command in a process of its own; return its exit code, or minus the signal."""
        child = os.fork()
        if child == 0:
            _work((command or self.command).arguments(self.path), self.path, **disturbed)
        deadline = time.monotonic() + disturbed.get("time", _LONGEST)
        while True:
            done, status = os.waitpid(child, os.WNOHANG)
            if done:
                return os.waitstatus_to_exitcode(status)
            if time.monotonic() > deadline:
                os.kill(child, signal.SIGKILL)
                os.waitpid(child, 0)
                return -signal.SIGKILL if "time" in disturbed else -signal.SIGALRM
            time.sleep(2e-4)

    def _import_what_it_uses(self) -> None:
        """Run the command here: its copies then begin at once, and die while they work."""
        words = self.command.arguments(self.path)
        with (
            contextlib.redirect_stdout(io.StringIO()),
            contextlib.redirect_stderr(io.StringIO()),
            contextlib.suppress(SystemExit),
        ):
            _run(words)

    def disturb(self, kind: str, chance: random.Random) -> str:
        """One moment; returns what is wrong after it, or nothing."""
        for name in self.outputs:
            (self.path / name).write_bytes(_old(name))
        if kind == "kill":
            if chance.random() < 0.5:
                code = self.run(time=chance.uniform(0.0, 1.1 * self.seconds))
            else:
                code = self.run(change=chance.randrange(40 + 8 * len(self.outputs)))
            allowed = {0, 3, -signal.SIGKILL}
        elif kind == "full disk":
            largest = max(len(content) for content in self.new.values())
            code = self.run(bytes=int(chance.uniform(0.0, 1.05 * largest)))
            allowed = {0, 2, 3}
        else:
            code = self.run(read_only=1)
            allowed = {2}
        wrong = [name for name in self.outputs if not self._whole(name)]
        if code not in allowed:
            wrong.append(f"exit code {code}")
        more = [name for name in self._litter() if name not in self.command.kept]
        if kind != "kill" and more:
            wrong.append(f"left: {', '.join(more)}")
        return "; ".join(wrong)

    def settled(self) -> str:
        """What is left after a run that is not disturbed."""
        code = self.run()
        wrong = [] if code in (0, 3) else [f"exit code {code}"]
        wrong += [f"left: {name}" for name in self._litter()]
        wrong += [f"old: {n}" for n in self.outputs if (self.path / n).read_bytes() == _old(n)]
        if (self.path / "probe.jsonl").exists():
            try:
                read_history(self.path / "probe.jsonl")
            except PretravelError as error:
                wrong.append(str(error))
        return "; ".join(wrong)

    def _litter(self) -> list[str]:
        return sorted(self._listed() - self.expected)

    def _listed(self) -> set[str]:
        files = (p for p in self.path.rglob("*") if p.is_file() or p.parent.name == "tmp")
        return {str(p.relative_to(self.path)) for p in files}

    def _whole(self, name: str) -> bool:
        """Whether a file is the old one or the new one; those that state the time differ."""
        content, new = (self.path / name).read_bytes(), self.new[name]
        if content in (_old(name), new):
            return True
        if name.endswith((".nc", ".html", ".png", ".qif", ".json", ".parquet")):
            return abs(len(content) - len(new)) < 64 and content[-4:] == new[-4:]
        return False


def _old(name: str) -> bytes:
    """An old output, of the kind that the ending says."""
    return _BEGIN.get(Path(name).suffix, b"") + _OLD


def _work(arguments: Sequence[str], folder: Path, **disturbed: float) -> None:
    """In the child: run the command line, disturbed; this never returns."""
    try:
        null = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(null, stream)
        os.environ["TMPDIR"] = tempfile.tempdir = str(folder / "tmp")
        if "change" in disturbed:
            sys.addaudithook(_Killer(int(disturbed["change"])))
        if "bytes" in disturbed:
            limit = int(disturbed["bytes"])
            resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))
        if "read_only" in disturbed:
            _make_read_only(folder)
        _run(arguments)
    except SystemExit as stop:
        os._exit(int(stop.code or 0))
    except BaseException:
        os._exit(99)
    os._exit(0)


def _run(arguments: Sequence[str]) -> None:
    from pretravel.cli.main import run

    sys.argv = ["pretravel", *[a for word in arguments for a in word.split()]]
    run()


def _make_read_only(folder: Path) -> None:
    """Mount a folder as read-only, for this process alone; as root, who may write everywhere."""
    libc = ctypes.CDLL(None, use_errno=True)
    own, private, bind, remount, read_only = 0x20000, 0x44000, 0x1000, 0x20, 0x1
    where = os.fsencode(folder)
    calls = (
        lambda: libc.unshare(own),
        lambda: libc.mount(b"none", b"/", None, private, None),
        lambda: libc.mount(where, where, None, bind, None),
        lambda: libc.mount(b"none", where, None, bind | remount | read_only, None),
    )
    for call in calls:
        if call():
            raise OSError(ctypes.get_errno(), "the folder cannot be made read-only")


class _Killer:
    """Ends this process before its n-th call that changes a file."""

    def __init__(self, number: int) -> None:
        self.left = number

    def __call__(self, event: str, arguments: tuple[object, ...]) -> None:
        writes = event == "open" and isinstance(arguments[2], int) and bool(
            arguments[2] & (os.O_WRONLY | os.O_RDWR | os.O_CREAT)
        )  # fmt: skip
        if writes or event in _CHANGES:
            self.left -= 1
            if self.left < 0:
                os.kill(os.getpid(), signal.SIGKILL)


def try_command(command: WritingCommand, moments: int, seed: int = 1) -> Outcome:
    """Disturb a command at random moments."""
    chance = random.Random(f"{seed} {command.name}")
    outcome = Outcome(command.name)
    kinds = ["kill", "kill", "full disk", *(["read-only"] if os.geteuid() == 0 else [])]
    folder = Folder(command)
    try:
        for number in range(moments):
            kind = kinds[number % len(kinds)]
            outcome.moments[kind] += 1
            wrong = folder.disturb(kind, chance)
            if number % 10 == 9 or number == moments - 1:
                wrong = "; ".join(filter(None, (wrong, folder.settled())))
            if wrong:
                outcome.broken.append(f"moment {number}, {kind}: {wrong}")
    finally:
        shutil.rmtree(folder.path, ignore_errors=True)
    return outcome


def main() -> None:
    """Try all commands, or those that are named."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--moments", type=int, default=500)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("commands", nargs="*", help="all where none is named")
    given = parser.parse_args()
    total, broken = 0, 0
    for command in COMMANDS:
        if given.commands and command.name not in given.commands:
            continue
        began = time.perf_counter()
        outcome = try_command(command, given.moments, given.seed)
        total += sum(outcome.moments.values())
        broken += len(outcome.broken)
        counts = ", ".join(f"{count} {kind}" for kind, count in outcome.moments.items())
        seconds = time.perf_counter() - began
        print(
            f"{command.name}: {counts}; {len(outcome.broken)} broken ({seconds:.0f} s)", flush=True
        )
        for line in outcome.broken[:5]:
            print(f"  {line}", flush=True)
    print(f"{total} moments, {broken} broken")


if __name__ == "__main__":
    main()
