"""Give commands values that mean nothing: ``python -m tests.hard.nonsensical_options``.

Each trial replaces or adds one to three options of a command line that works. The command must do
its work, or refuse with exit code 2 and a message: no traceback, no hang, no memory without end.
"""

from __future__ import annotations

import argparse
import os
import random
import resource
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import typer

from pretravel.cli.main import app
from tests.hard.interrupted_writes import COMMANDS, EXAMPLES, SPHERE, Folder, WritingCommand

LONGEST = 60.0
"""[s], on a machine with other work; the law of 5 s is for readers."""
MEMORY = 4 * 2**30
NUMBERS = (
    "nan", "inf", "-inf", "-nan", "0", "-0", "-1", "1e308", "-1e308", "1e400", "1e-308", "0.000001",
    "1000000", "99999", "9" * 400, "1" * 5000, "0x10", "1_000", "1e", "",
)  # fmt: skip
TEXTS = (
    "²", "٣", "１２", "½", "−5", "1,2", "1,2,3", "0,0,0", "nan,nan,nan", "1e308,1e308,1e308",
    "1,2,3,4,5,6", "0:1e9:1e-9", "5:1:1", "0:360:0", "::", ",", "1x1", "99999x99999", "²x3", "a",
    "=1", "é" * 300, "none", "-", "{title[a]}", "%s%n", "/dev/null", "/", ".", "x=1,y=2", "x=nan",
    "a\nb", "\x00", "/nowhere/x.csv", "(((", "[a", "*" * 50, "step",
)  # fmt: skip
MORE = (
    WritingCommand("probes", "omp40-2", ()),
    WritingCommand("faces", f"{EXAMPLES}/part.step", ()),
    WritingCommand("formats", "", ()),
    WritingCommand("demo", f"--data {EXAMPLES.parent}/nowhere -o {{0}}/demo", ()),
    WritingCommand("studies", "what-matters", ()),
    WritingCommand("wishes", "stylus-50mm", ()),
    WritingCommand("convert:look", f"{SPHERE}", ()),
)  # fmt: skip


@dataclass
class Options:
    """What a command did with nonsensical values."""

    command: str
    codes: Counter[int] = field(default_factory=Counter)
    slowest: float = 0.0
    faults: list[str] = field(default_factory=list)


def commands(group: str = "") -> list[str]:
    """Names of the commands, or of those of a group."""
    found: Any = typer.main.get_command(app)
    return list((found.commands[group] if group else found).commands)


def options_of(name: str) -> list[tuple[str, tuple[str, ...]]]:
    """The options of a command, with values for each; none for an option without a value.

    The ends of the range of a number are among them: they pass the check of the range.
    """
    command: Any = typer.main.get_command(app)
    for word in name.split(":")[0].split():
        command = command.commands[word]
    return [
        (max(parameter.opts, key=len), _values(parameter))
        for parameter in command.params
        if parameter.opts[0].startswith("-") and "--output" not in parameter.opts
    ]


def _values(parameter: Any) -> tuple[str, ...]:
    if getattr(parameter, "is_flag", False):
        return ()
    ends = [getattr(parameter, name, None) for name in ("min", "max")]
    known = tuple(
        f"{end:g}" if isinstance(end, float) else str(end) for end in ends if end is not None
    )
    return NUMBERS + TEXTS + 10 * known


def _changed(
    words: list[str], options: list[tuple[str, tuple[str, ...]]], chance: random.Random
) -> list[str]:
    """A command line with one to three values that mean nothing."""
    words = list(words)
    count = chance.choice((1, 1, 2, 3))
    for option, values in chance.sample(options, min(len(options), count)):
        if not values:
            words.append(option)
        elif option in words:
            words[words.index(option) + 1] = chance.choice(values)
        else:
            words += [option, chance.choice(values)]
    return words


def try_options(command: WritingCommand, trials: int, seed: int = 1) -> Options:
    """Try a command with nonsensical values."""
    result = Options(command.name)
    options = options_of(command.name)
    if not options:
        return result
    folder = _folder(command)
    words = [w for word in command.arguments(folder) for w in word.split()]
    for number in range(trials):
        given = _changed(words, options, random.Random(f"{seed} {command.name} {number}"))
        began = time.perf_counter()
        code, said = run_apart(given, folder)
        seconds = time.perf_counter() - began
        result.codes[code] += 1
        result.slowest = max(result.slowest, seconds)
        if code not in (0, 2, 3) or "Traceback" in said or (code == 2 and not said.strip()):
            shown = " ".join(repr(word[:60]) for word in given)
            result.faults.append(f"{number}: exit code {code}: {shown}\n{said[-1500:]}")
    return result


def _folder(command: WritingCommand) -> Path:
    """A folder with the inputs of a command."""
    place = Folder.__new__(Folder)
    place.command, place.path = command, Path(tempfile.mkdtemp(prefix="options-"))
    (place.path / "tmp").mkdir()
    for name in _makers(command):
        place.run(name)
    return place.path


def _makers(command: WritingCommand) -> Iterator[WritingCommand]:
    for other in COMMANDS:
        if set(other.outputs) & set(command.needs) and other.name != command.name:
            yield from _makers(other)
            yield other


def run_apart(words: list[str], folder: Path) -> tuple[int, str]:
    """Run a command line in a process of its own: exit code, and what it said on stderr."""
    said = folder / "tmp" / "stderr"
    child = os.fork()
    if child == 0:
        _work(words, folder, said)
    deadline = time.monotonic() + LONGEST
    while True:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status), said.read_text(errors="replace")
        if time.monotonic() > deadline:
            os.kill(child, signal.SIGKILL)
            os.waitpid(child, 0)
            return -signal.SIGALRM, "it hangs"
        time.sleep(1e-3)


def _work(words: list[str], folder: Path, said: Path) -> None:
    try:
        os.chdir(folder)
        streams = os.open(os.devnull, os.O_RDWR), os.open(said, os.O_CREAT | os.O_RDWR | os.O_TRUNC)
        for stream, target in ((0, streams[0]), (1, streams[0]), (2, streams[1])):
            os.dup2(target, stream)
        sys.stdout, sys.stderr = os.fdopen(1, "w"), os.fdopen(2, "w")
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        from pretravel.cli.main import run

        sys.argv = ["pretravel", *words]
        run()
    except SystemExit as stop:
        sys.stderr.flush()
        os._exit(int(stop.code or 0))
    except BaseException:
        os._exit(99)
    os._exit(0)


def main() -> None:
    """Try all commands, or those that are named."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("commands", nargs="*", help="all where none is named")
    given = parser.parse_args()
    total, faults = 0, 0
    for command in (*COMMANDS, *MORE):
        if given.commands and command.name not in given.commands:
            continue
        result = try_options(command, given.trials, given.seed)
        total, faults = total + sum(result.codes.values()), faults + len(result.faults)
        codes = ", ".join(f"{count} of code {code}" for code, count in sorted(result.codes.items()))
        print(
            f"{command.name}: {codes}; {len(result.faults)} faults, {result.slowest:.1f} s at most"
        )
        for line in result.faults[:4]:
            print(f"  {line}", flush=True)
    print(f"{total} trials, {faults} faults")


if __name__ == "__main__":
    main()
