"""The command ``pretravel``: its subcommands, and the form of errors and warnings."""

from __future__ import annotations

import os
import sys
import traceback
import warnings
from collections.abc import Callable
from contextlib import suppress
from typing import Annotated, NoReturn, TextIO

import typer

from pretravel.base.errors import PretravelError
from pretravel.cli import (
    check,
    compare,
    compensate,
    convert,
    demo,
    design,
    export,
    faces,
    fem,
    history,
    hysteresis,
    identify,
    laboratory,
    machine,
    measure,
    plan,
    plan_touches,
    predict,
    probes,
    program,
    qualify,
    report,
    rig,
    separate,
    simulate,
    slide,
    study,
    verify,
)
from pretravel.cli.app import app as app_command
from pretravel.cli.command import ANSWER, FAULT, INTERRUPTED, Command
from pretravel.show.style import ignore_settings_of_folder

app = typer.Typer(
    name="pretravel",
    help="Predict, calibrate and compensate the pretravel of touch-trigger probes."
    "\n\nThe command demo shows a result of example data. The command app opens the workbench in "
    "the browser. With your own files: convert FILE shows how pretravel reads your touches, "
    "qualify makes a map from touches on a sphere, compensate and measure use the map on touches "
    "on a part.",
    epilog="Example: pretravel qualify sphere.csv --diameter 25 --tip-diameter 6 -o map.json"
    f"\n\nExit codes: 0: done. {FAULT}: a fault, with a message. {ANSWER}: a result that a script "
    "must notice: the probe has changed (verify), a value is outside its limit or tolerance "
    f"(check, measure). {INTERRUPTED}: interrupted.",
    no_args_is_help=True,
    context_settings={"help_option_names": ["--help", "-h"]},
    add_completion=False,
    pretty_exceptions_enable=False,
)


def _version(wanted: bool) -> None:
    if wanted:
        from pretravel.base.version import installed_version

        typer.echo(f"pretravel {installed_version()}")
        raise typer.Exit


@app.callback()
def _main(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    del version


GROUPS: dict[str, tuple[Callable[..., None], ...]] = {
    "Start": (demo.demo, app_command),
    "Qualify": (qualify.qualify, verify.verify, history.history, plan_touches.plan_touches),
    "Measure": (
        compensate.compensate,
        measure.measure,
        compare.compare,
        faces.faces,
        plan.plan,
    ),
    "Control": (export.export, machine.machine),
    "Predict": (
        probes.probes,
        predict.predict,
        simulate.simulate,
        slide.slide,
        fem.fem,
        hysteresis.hysteresis,
        identify.identify,
        study.study,
        study.studies,
        design.design,
        design.wishes,
    ),
    "Laboratory": (
        rig.rig,
        laboratory.laboratory,
        separate.separate,
        separate.separation_plan,
        check.check,
        check.pattern,
    ),
    "Files": (convert.convert, convert.formats, report.report),
}
"""The commands in the groups of the help; each group begins with what is needed first."""

for group, commands in GROUPS.items():
    for command in commands:
        summary, _, example = (command.__doc__ or "").rpartition("Example: ")
        app.command(
            cls=Command,
            help=summary.strip(),
            epilog=f"Example: {example.strip()}",
            rich_help_panel=group,
        )(command)

app.add_typer(program.app, rich_help_panel="Control")


def run() -> None:
    """Run the command line; faults become one message and exit code 2, no traceback."""
    warnings.showwarning = _show_warning
    ignore_settings_of_folder()
    try:
        app()
    except SystemExit as stop:
        # typer exits with 1, for example when the reader of a pipe has closed it
        _end(FAULT if stop.code == 1 else stop.code)
    except PretravelError as error:
        _fail(str(error))
    except MemoryError:
        _fail("there is not enough memory for this; use fewer directions or touches")
    except OSError as error:
        _fail(f"{error.filename or ''}: {error.strerror or error}".lstrip(": "))
    except ModuleNotFoundError as error:
        _fail(f"the Python package '{error.name}' is missing: pip install {error.name}")
    except Exception:
        _fail(f"{traceback.format_exc()}\nthis is a flaw of pretravel; please report it")


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
    typer.echo(f"Warning: {message}", err=True)


def _fail(message: str) -> NoReturn:
    with suppress(OSError):  # of a closed pipe
        typer.echo(f"Error: {message}", err=True)
    _end(FAULT)


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
    sys.exit(code)
