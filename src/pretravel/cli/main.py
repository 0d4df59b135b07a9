"""The command ``pretravel``: its subcommands, and the form of errors and warnings."""

from __future__ import annotations

import os
import re
import sys
import traceback
import warnings
from contextlib import suppress
from typing import Annotated, Any, NoReturn, TextIO

import typer

from pretravel.base import PretravelError
from pretravel.cli.app import App
from pretravel.cli.command import FAULT, INTERRUPTED
from pretravel.cli.lean_start import end_lean, start_lean
from pretravel.cli.typed_values import Group
from pretravel.task import ANSWER, GROUPS, PLACES, SUBCOMMANDS, Task, task_named

_OWN = {"Start": (App.name,)}
"""Tasks of the command line itself, by the group of the help."""
_EVERY_DAY = (
    *("demo", "app", "convert", "qualify", "export", "program"),
    *("compensate", "align", "faces", "measure", "verify", "history"),
)
"""Commands of every day, in the order of the work; the help begins with them."""
_FEW = "pretravel.few"
"""Where the context says that only the commands of every day are listed."""
_LINE = 60
"""Characters of what the list says of a command: one line of 80 with the longest name before it."""


class Commands(Group):
    """The commands, each made when it is asked for; their list needs their first lines alone."""

    def __init__(self, *args: Any, **settings: Any) -> None:
        super().__init__(*args, **settings)
        self.commands = _LazyCommands()

    def list_commands(self, ctx: Any) -> list[str]:
        """Their names in the order of the help."""
        del ctx
        return list(self.commands)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help as plain text: libraries for frames and colours take longer than it."""
        self.format_usage(ctx, formatter)
        self.format_help_text(ctx, formatter)
        self.format_options(ctx, formatter)
        self.format_epilog(ctx, formatter)

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write what the commands do: those of every day, then the rest by `tasks.GROUPS`."""
        for title, names in _sections().items():
            with formatter.section(title):
                formatter.write_dl([(name, _in_a_line(_summary(name))) for name in names])
            if ctx.meta.get(_FEW):
                formatter.write_text(f"{len(self.commands) - len(names)} more: pretravel --help")
                return

    def format_epilog(self, ctx: Any, formatter: Any) -> None:
        """Write the example and the exit codes, where all commands are listed."""
        if not ctx.meta.get(_FEW):
            super().format_epilog(ctx, formatter)

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the words; without any, show the commands of every day alone."""
        if not args and not ctx.resilient_parsing:
            ctx.meta[_FEW] = True
            typer.echo(self.get_help(ctx))
            ctx.exit(FAULT)
        return super().parse_args(ctx, args)


class _LazyCommands(dict[str, Any]):
    """Commands by their names; a value is made when it is read."""

    def __init__(self) -> None:
        super().__init__(dict.fromkeys(name for names in _groups().values() for name in names))

    def __getitem__(self, name: str) -> Any:
        made = super().__getitem__(name)
        if made is None:
            made = self[name] = _command(name)
        return made

    def get(self, name: str, default: Any = None) -> Any:
        return self[name] if name in self else default  # noqa: SIM401  # it would call itself

    def items(self) -> Any:
        return [(name, self[name]) for name in self]

    def values(self) -> Any:
        return [self[name] for name in self]


def _groups() -> dict[str, tuple[str, ...]]:
    """The commands in the groups of the help; each group begins with what is needed first."""
    every = {group: (*tasks, *_OWN.get(group, ())) for group, tasks in GROUPS.items()}
    first_words = {group: (name.split()[0] for name in names) for group, names in every.items()}
    return {group: tuple(dict.fromkeys(names)) for group, names in first_words.items()}


def _sections() -> dict[str, tuple[str, ...]]:
    """The commands of the help below their titles, each once."""
    rest = {
        group: tuple(name for name in names if name not in _EVERY_DAY)
        for group, names in _groups().items()
    }
    return {"Every day": _EVERY_DAY} | {group: names for group, names in rest.items() if names}


def _tasks(name: str) -> list[type[Task]]:
    """The task of a command, or those whose commands begin with this word."""
    if name == App.name:
        return [App]
    return [task_named(task) for task in PLACES if task.split()[0] == name]


def _command(name: str) -> Any:
    from pretravel.cli.derived import command_of, group_of

    if name in SUBCOMMANDS:
        return group_of(name, SUBCOMMANDS[name], _tasks(name))
    return command_of(_tasks(name)[0])


def _summary(name: str) -> str:
    text = SUBCOMMANDS.get(name) or (_tasks(name)[0].__doc__ or "").partition("\n\n")[0]
    return " ".join(text.split())


def _in_a_line(summary: str) -> str:
    """The first sentence of a summary, without its last clauses where it is longer than a line."""
    text = re.split(r"(?<=[\w)])\. ", summary, maxsplit=1)[0].rstrip(".")
    for clause in (r"[:;] .*$", *(r", (?:and|as|for|from|or|which|with|within) [^,]*$",) * 2):
        if len(text) > _LINE:
            text = re.sub(clause, "", text)
    return f"{text}."


app = typer.Typer(
    name="pretravel",
    cls=Commands,
    help="Predict, calibrate and compensate the pretravel of touch-trigger probes."
    "\n\nThe command demo shows a result from the example data. The command app opens the "
    "workbench in the browser. With your own files: convert FILE shows how pretravel reads your "
    "touches, qualify makes a map from touches on a sphere, compensate applies the map to touches "
    "on a part, measure evaluates the points.",
    epilog="Example: pretravel qualify sphere.csv --diameter 25 --tip-diameter 6 -o map.json"
    f"\n\nExit codes: 0: done. {FAULT}: a fault, with a message. {ANSWER}: a result that a script "
    "must notice: the probe has changed, or could not be tested (verify); a value is outside its "
    f"limit or tolerance, or this cannot be decided (check, measure). {INTERRUPTED}: interrupted.",
    context_settings={"help_option_names": ["--help", "-h"]},
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


def _version(wanted: bool) -> None:
    if wanted:
        from pretravel.base import installed_version

        typer.echo(f"pretravel {installed_version()}")
        raise typer.Exit


@app.callback()
def _main(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    del version


def run() -> None:
    """Run the command line; faults become one message and exit code 2, no traceback."""
    start_lean()
    warnings.showwarning = _show_warning
    try:
        app()
    except SystemExit as stop:
        # typer exits with 1, for example when the reader of a pipe has closed it
        _end(FAULT if stop.code == 1 else stop.code)
    except PretravelError as error:
        _fail(str(error), error.exit_code)
    except MemoryError:
        _fail("there is not enough memory for this; use fewer directions or touches")
    except OSError as error:
        _fail(f"{error.filename or ''}: {error.strerror or error}".lstrip(": "))
    except Exception as error:
        if isinstance(error, ModuleNotFoundError) and not str(error.name).startswith("pretravel"):
            _fail(f"the Python package '{error.name}' is missing: pip install {error.name}")
        _fail(f"{traceback.format_exc()}\nthis is an internal error of pretravel; please report it")


def _show_warning(
    message: Warning | str,
    category: type[Warning],
    filename: str,
    lineno: int,
    file: TextIO | None = None,
    line: str | None = None,
) -> None:
    """Print a warning of the library as the commands print theirs."""
    del category, filename, lineno, file, line
    from pretravel.show import printable

    typer.echo(f"Warning: {printable(str(message))}", err=True)


def _fail(message: str, code: int = FAULT) -> NoReturn:
    with suppress(OSError):  # of a closed pipe
        typer.echo(f"Error: {message}", err=True)
    _end(code)


def _end(code: int | str | None) -> NoReturn:
    """Exit. What cannot be printed any more is dropped: Python would exit with a code of its own.

    See https://docs.python.org/3/library/signal.html#note-on-sigpipe.
    """
    for stream in filter(None, (sys.stdout, sys.stderr)):  # None: closed from the beginning
        try:
            stream.flush()
        except OSError:
            code = FAULT
            with suppress(OSError):
                os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
    end_lean()
    sys.exit(code)
