"""Commands that are made from the descriptions of tasks, and what a command does with a result."""

from __future__ import annotations

import inspect
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager
from dataclasses import MISSING, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from pretravel.cli.command import OPTIONS, OUTPUT, SPECIAL, TYPED, Command
from pretravel.cli.files import check_files
from pretravel.cli.lean_start import without_unused_parts
from pretravel.cli.running import input_files, record_of
from pretravel.cli.typed_values import Group, read_here
from pretravel.task import (
    FOLDER,
    PAGES,
    PICTURES,
    PROGRAMS,
    Progress,
    Result,
    Setting,
    Task,
    settings_of,
)

if TYPE_CHECKING:
    from pretravel.show import InputFile, WorkRecord


def command_of(task: type[Task]) -> Any:
    """The command of a task.

    Parameters
    ----------
    task : type of Task

    Returns
    -------
    click.Command
    """

    def callback(context: typer.Context, **values: Any) -> None:
        without_unused_parts()
        typed = frozenset(filter(partial(_is_typed, context), values))
        code = deliver(task_of(task, {**values, "given": typed}), context.meta[TYPED])
        if code:
            raise typer.Exit(code)

    context = inspect.Parameter("context", inspect.Parameter.KEYWORD_ONLY, annotation=typer.Context)
    signature = inspect.Signature([context, *_parameters(task)])
    callback.__signature__ = signature  # type: ignore[attr-defined]
    callback.__annotations__ = {}
    alone = typer.Typer(add_completion=False, rich_markup_mode=None)
    alone.command(
        task.name.split()[-1],
        cls=Command,
        help=inspect.cleandoc(task.__doc__ or "").partition("\n\nAttributes\n")[0],
        epilog=f"Example: {task.example}",
        context_settings={"max_content_width": 100},
    )(callback)
    command: Any = typer.main.get_command(alone)
    command.settings = {setting.name: setting for setting in settings_of(task)}
    for parameter in command.params:
        if parameter.name in command.settings:
            read_here(parameter, command.settings[parameter.name])
    return command


def _is_typed(context: typer.Context, name: str) -> bool:
    source = context.get_parameter_source(name)
    return source is not None and source.name == "COMMANDLINE"


def group_of(name: str, text: str, tasks: Sequence[type[Task]]) -> Any:
    """The group of commands that begin with the same word.

    Parameters
    ----------
    name, text : str
        The word, and the help.
    tasks : sequence of types of Task

    Returns
    -------
    click.Group
    """
    app = typer.Typer(add_completion=False, rich_markup_mode=None)
    app.add_typer(
        typer.Typer(name=name, cls=Group, help=text, no_args_is_help=True, add_completion=False)
    )
    group: Any = typer.main.get_command(app).commands[name]  # type: ignore[attr-defined]
    for task in tasks:
        command = command_of(task)
        command.short_help = " ".join((command.help or "").partition("\n\n")[0].split())
        group.add_command(command)
    return group


def _parameters(task: type[Task]) -> Iterator[inspect.Parameter]:
    for setting in settings_of(task):
        default = inspect.Parameter.empty if _required(setting) else setting.default
        if setting.several and not _required(setting):
            default = list(setting.default) or None
        yield inspect.Parameter(
            setting.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=default,
            annotation=Annotated[_type(setting), _information(setting, _section(task, setting))],
        )


def _required(setting: Setting) -> bool:
    return setting.default is MISSING


def _type(setting: Setting) -> Any:
    # What has a parser or a registry is a text for typer; its words are read when a command runs.
    own = setting.parse is not None or setting.field.names is not None
    kind = str if own else setting.kind
    kind = list[kind] if setting.several else kind  # type: ignore[valid-type]
    return kind if _required(setting) else kind | None


def _section(task: type[Task], setting: Setting) -> str:
    """The part of the help in which an option stands."""
    if setting.field.writes:
        return OUTPUT
    if setting.field.only:
        return SPECIAL
    declared = (
        each for each in task.__mro__ if setting.name in vars(each).get("__annotations__", ())
    )
    return str(vars(next(declared, task)).get("section", "")) or OPTIONS


def _information(setting: Setting, section: str) -> Any:
    field = setting.field
    metavar = field.metavar or ("FOLDER" if field.writes == FOLDER else None)
    common: dict[str, Any] = {"metavar": metavar, "rich_help_panel": section}
    if setting.parse is not None or field.names is not None:
        common["parser"] = str  # what its words say is read in typed_values
    elif setting.kind in (float, int) and field.range is not None:
        common["min"], common["max"] = map(setting.kind, setting.limits)
    if field.positional:
        return typer.Argument(**common)
    names = (setting.option, *filter(None, (field.short,)))
    return typer.Option(*names, **common)


def task_of(task: type[Task], values: dict[str, Any]) -> Task:
    """The settings; several values that nobody typed are the default."""
    several = {setting.name for setting in settings_of(task) if setting.several}
    arguments: dict[str, Any] = {
        name: tuple(value) if name in several and value is not None else value
        for name, value in values.items()
        if not (name in several and value is None)
    }
    return task(**arguments)


@dataclass(frozen=True)
class ShownProgress(Progress):
    """Statements on stdout, stages on stderr.

    Attributes
    ----------
    task : Task
    typed : sequence of str
        The arguments of its command.
    inputs : list of InputFile, or None
        Files that the task reads, noted before it runs, where a record is needed.
    """

    task: Task
    typed: Sequence[str]
    inputs: list[InputFile] | None = None

    def say(self, text: str) -> None:
        """Print a statement."""
        typer.echo(text)

    def working(self, what: str) -> AbstractContextManager[None]:
        """Show the stage of long work."""
        from pretravel.cli.progress import working

        return working(what)

    def record(self) -> WorkRecord:
        """The record of the command, with the files that it reads."""
        inputs = input_files(self.task) if self.inputs is None else self.inputs
        return record_of(self.task, self.typed, inputs)


def _endings(task: Task, setting: Setting, path: Path) -> tuple[str, ...]:
    """Those that an output can have: where a page is one, the values of the report too."""
    allowed = task.endings(setting.name)
    pages = set(PAGES) <= set(allowed)
    return (*allowed, ".json") if pages and setting.is_report(path) else allowed


def deliver(task: Task, typed: Sequence[str] = ()) -> int:
    """Do a task as a command does: check its files, run it, write and show what it made.

    Parameters
    ----------
    task : Task
    typed : sequence of str
        The arguments of its command.

    Returns
    -------
    int
        The exit code.
    """
    inputs = task.read_files()
    outputs = list(task.written_files())
    named = [(path, _endings(task, setting, path)) for setting, path in outputs]
    check_files(
        [each for each in named if each[1] != FOLDER],
        inputs,
        programs=all(setting.field.writes in (PROGRAMS, FOLDER) for setting, _ in outputs),
    )
    has_page = any(setting.is_report(path) for setting, path in outputs)
    progress = ShownProgress(task, typed, input_files(task) if has_page else None)
    result: Result = task.run(progress)
    report = result.document()
    for setting, path in outputs:
        if setting.field.in_run:
            continue
        if setting.field.writes == PICTURES:
            with progress.working(f"drawing {path.name}"):
                result.picture(report, path)
        elif setting.is_report(path):
            with progress.working(f"writing {path.name}"):
                result.write_report(path, progress.record())
        else:
            result.write(setting.name, path)
    if result.text:
        typer.echo(result.text, nl=False)
    if report is not None:
        from pretravel.cli.showing import show

        verbose = getattr(task, "verbose", False)
        show(report if verbose else result.in_brief(report), verbose=verbose)
    else:
        for warning in result.cautions:
            from pretravel.show import printable

            typer.echo(f"Warning: {printable(warning)}", err=True)
    if result.advice:
        typer.echo(result.advice)
    return result.exit_code
