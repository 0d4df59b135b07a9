"""What a task is: a frozen type of settings whose fields are described once, and which runs.

The command, the form of the workbench, the texts "the same command" and "the same Python", the
record on a page, the reference pages and the check of limits are derived from the description. A
task prints nothing; what it has to say while it works goes to its `Progress`.

A module of a task is imported to list the commands: it imports the library inside its functions.
"""

from __future__ import annotations

import math
import shlex
import types
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import MISSING, dataclass, fields, replace
from dataclasses import field as data_field
from pathlib import Path
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    Literal,
    NamedTuple,
    TypeAlias,
    Union,
    dataclass_transform,
    get_args,
    get_origin,
    get_type_hints,
)

from pretravel.base import PretravelError, QuantityRange

if TYPE_CHECKING:
    from pretravel.files import FileReadings
    from pretravel.show import Document, WorkRecord

PICTURES = (".png", ".svg", ".pdf")
MAPS = (".json", ".csv")
PAGES = (".html", ".pdf")
REPORT_VALUES = ".report.json"
"""End of the name of a report's values, on every output that can be a page."""
PROGRAMS = (".ngc", ".nc", ".gcode", ".tap")
"""Of programs for machines: text, also with the ending .nc."""
FOLDER = ("",)
"""Of an output that takes several files; the task checks it."""
ANSWER = 3
"""Exit code of an answer that a script must notice: changed, does not conform."""
_UNITS = {"_um": "µm", "_deg": "°"}
"""The unit that the end of a name states; the option is called without it."""
_TYPED_UNITS = {"µm": 1e-3, "°": math.pi / 180.0}
"""In the units of the library: mm, rad."""
_SMALLEST_U_UM = 0.005
"""A standard uncertainty that is smaller was typed in mm. [µm]"""


class Progress:
    """What a task says while it works; this one is silent."""

    def say(self, text: str) -> None:
        """State something that the user should know now, such as how a file was read."""

    def working(self, what: str) -> AbstractContextManager[None]:
        """State what is done within, for work that can be long."""
        del what
        return nullcontext()

    def record(self) -> WorkRecord | None:
        """What is done with what, for a page that the task itself writes."""
        return None


SILENT = Progress()


@dataclass(frozen=True)
class When:
    """A mode of a task: another setting is stated, or is one of some words, or a kind of file.

    A command with modes stands for several tasks. Settings are of a mode by `Field.only` and
    `Field.without`; what is stated and not of the mode is refused where a task is made.

    Attributes
    ----------
    key : str
        The setting that chooses.
    one_of : sequence of str, or callable
        Words of it; a callable gives them from a registry.
    is_so : callable or None
        Whether a value is what ``what`` says.
    what : str
        In the help and in messages: "a map".
    """

    key: str
    one_of: Sequence[str] | Callable[[], Iterable[str]] = ()
    is_so: Callable[[Any], bool] | None = None
    what: str = ""

    def holds(self, task: type[Task], values: Mapping[str, Any]) -> bool:
        """Whether settings, or the stored values of a form, are in this mode."""
        setting = by_name(task)[self.key]
        value = values.get(self.key)
        if value is None or value == "":
            value = None if setting.default is MISSING else setting.default
        if self.is_so is not None:
            return value is not None and self.is_so(value)
        if words := self.words:
            return value in words
        return value is not None and value != setting.default and value != ()

    @property
    def words(self) -> tuple[str, ...]:
        """The words among which it is."""
        return tuple(self.one_of() if callable(self.one_of) else self.one_of)

    def said(self, name: str) -> str:
        """The mode in words, with the name of its setting where the words are not enough."""
        return self.what or f"{name} {_either(self.words)}".strip()


def _either(words: Sequence[str]) -> str:
    return " or ".join(filter(None, (", ".join(words[:-1]), *words[-1:])))


SettingsOfModes: TypeAlias = Mapping[str, tuple[str | When, ...]] | None
"""Modes by the names of settings."""


@dataclass(frozen=True, kw_only=True)
class Field:
    """Description of one setting, in addition to its type and its default.

    Attributes
    ----------
    help : str or callable
        One sentence or two, with the unit; it stands in the help, the form and the reference. A
        callable makes it from a registry.
    label, hint : str
        In forms: its words, by default the name with blanks, and a short sentence below it.
    words : mapping of str to str, or callable
        In forms: how the choices are called.
    range : QuantityRange or pair of float
        Limits: of a quantity, in the units of the library, or as they are typed.
    unit : str
        As it is typed; by default that of the name's end (``_um``, ``_deg``) or of the quantity.
    option : str
        By default the name without the unit: ``--tip-diameter``.
    short : str
        ``-o``.
    positional : bool
        An argument, not an option.
    metavar : str
        The form of a value in the help.
    names : callable or None
        Returns the names that are allowed, from a registry of the library.
    reads : callable, bool
        The value names files that are read; a callable gives the paths.
    grows : str
        The run adds to the file that it reads, and makes it where there is none: its ending.
    word : callable or None
        Where the value can also be a word, such as a probe of the catalogue: whether a text is
        one. Of a project that somebody sent, nothing else that is typed is taken.
    connects : bool
        The value is an address to which a connection is opened; a project states none.
    writes : tuple of str
        The value is a file that is written, with one of these endings.
    report_json : bool
        Whether .json among them is the report as values, as `show.result_file` writes it.
    in_run : bool
        The run itself writes it, not the result afterwards.
    only, without : tuple of str or When
        The modes with this setting: one of the first must hold where there are some, none of the
        others may. The name of a setting means that it is stated.
    states : str
        What a statement of this setting says already, for the message that refuses others.
    """

    help: str | Callable[[], str]
    label: str = ""
    hint: str = ""
    words: Mapping[str, str] | Callable[[], Mapping[str, str]] | None = None
    range: QuantityRange | tuple[float, float] | None = None
    unit: str = ""
    option: str = ""
    short: str = ""
    positional: bool = False
    metavar: str = ""
    names: Callable[[], Iterable[str]] | None = None
    reads: Callable[[Any], Sequence[Path]] | bool = False
    grows: str = ""
    word: Callable[[str], bool] | None = None
    connects: bool = False
    writes: tuple[str, ...] = ()
    report_json: bool = False
    in_run: bool = False
    only: tuple[str | When, ...] = ()
    without: tuple[str | When, ...] = ()
    states: str = ""


@dataclass(frozen=True, kw_only=True)
class InModes:
    """The modes in which one task uses a setting that several share: `Field.only`, `Field.without`.

    Attributes
    ----------
    only, without : tuple of str or When
    """

    only: tuple[str | When, ...] = ()
    without: tuple[str | When, ...] = ()


class Setting(NamedTuple):
    """A field of a task with its name, type and default.

    Attributes
    ----------
    name : str
    kind : Any
        Its type without None; that of the elements where there can be several.
    several : bool
    optional : bool
        It can be None.
    default : Any
        `dataclasses.MISSING` where it must be stated.
    field : Field
    """

    name: str
    kind: Any
    several: bool
    optional: bool
    default: Any
    field: Field

    @property
    def parse(self) -> Callable[[str], Any] | None:
        """Makes the value from text, where its type says how."""
        parse: Callable[[str], Any] | None = getattr(self.kind, "parse", None)
        return parse

    @property
    def shown_words(self) -> Mapping[str, str]:
        """What a form calls the values."""
        words = self.field.words or {}
        return words() if callable(words) else words

    @property
    def help(self) -> str:
        """What it is, in a sentence or two, and in which modes it is used."""
        return self.field.help() if callable(self.field.help) else self.field.help

    @property
    def unit(self) -> str:
        """The unit in which it is typed."""
        quantity = self.field.range
        stated = quantity.unit if isinstance(quantity, QuantityRange) else ""
        by_name = next((u for end, u in _UNITS.items() if self.name.endswith(end)), "")
        return self.field.unit or by_name or stated

    @property
    def plain_name(self) -> str:
        """The name without the unit."""
        end = next((end for end in _UNITS if self.name.endswith(end)), "")
        return self.name.removesuffix(end)

    @property
    def option(self) -> str:
        """The option as it is typed; what is so by default has one that turns it off, too."""
        word = self.plain_name.replace("_", "-")
        usual = f"--{word}/--no-{word}" if self.default is True else f"--{word}"
        return self.field.option or usual

    @property
    def words(self) -> str:
        """The setting in a message."""
        return self.plain_name.removesuffix("_file").replace("_", " ")

    @property
    def option_or_argument(self) -> str:
        """As the help shows it."""
        if self.field.positional:
            return (self.field.metavar or self.plain_name).upper()
        return self.option.partition("/")[0]

    @property
    def label(self) -> str:
        """The words in a form."""
        return self.field.label or self.plain_name.replace("_", " ").capitalize()

    @property
    def limits(self) -> tuple[float, float]:
        """The smallest and the largest value, as it is typed."""
        quantity = self.field.range
        if quantity is None:
            return -math.inf, math.inf
        if isinstance(quantity, QuantityRange):
            ends = quantity.limits(_TYPED_UNITS.get(self.unit, 1.0))
            return ends["min"], ends["max"]
        return quantity

    @property
    def choices(self) -> tuple[str, ...]:
        """The words that the value can be; empty where it is not a choice."""
        if self.field.names is not None:
            return tuple(self.field.names())
        return get_args(self.kind) if get_origin(self.kind) is Literal else ()

    def is_choice(self, value: Any) -> bool:
        """Whether a value is one of the choices; those of other packages are asked last."""
        names = self.field.names
        return any(value == each for each in (self.choices if names is None else names()))

    def is_report(self, path: Path) -> bool:
        """Whether a file of this output is the report: a page, or its values."""
        if self.field.in_run or not set(PAGES) <= set(self.field.writes):
            return False
        own = (".json",) if self.field.report_json else ()
        return path.name.lower().endswith((*PAGES, REPORT_VALUES, *own))

    def text(self, value: Any) -> str:
        """A value as it is typed."""
        return repr(value).removesuffix(".0") if isinstance(value, float) else str(value)

    def inside(self, value: Any) -> Any:
        """A value in the units of the library: mm, rad."""
        factor = _TYPED_UNITS.get(self.unit)
        return value if factor is None or value is None else value * factor

    def checked(self, value: Any) -> Any:
        """A value of the type of the field, within its limits.

        Raises
        ------
        PretravelError
            It is not; the message names the setting.
        """
        if value is None:
            if self.optional:
                return None
            raise PretravelError(f"{self.plain_name} must be given", inputs=(self.plain_name,))
        if self.several:
            single = isinstance(value, str | Path) or not isinstance(value, Iterable)
            return tuple(self._one(each) for each in ((value,) if single else value))
        return self._one(value)

    def _one(self, value: Any) -> Any:
        if isinstance(value, str | int | float) and self.parse is not None:
            return self.parse(self.text(value))
        offered = self.field.names is not None or self.choices
        if offered and not self.is_choice(value):
            self._refuse(value, f"it is not known; there are {', '.join(self.choices)}")
        if self.kind is Path:
            return Path(value)
        if self.kind in (float, int) and self.parse is None:
            return self._number(value)
        if self.kind is str and self.parse is None and not isinstance(value, str | Path):
            self._refuse(value, "it must be a text")
        return value

    def _number(self, value: Any) -> float:
        try:
            number = self.kind(value)
        except (TypeError, ValueError, OverflowError):
            self._refuse(value, "it must be a number")
        if isinstance(value, str) and "_" in value:  # 1_0, which Python reads as 10
            self._refuse(value, "it must be a number")
        if isinstance(value, bool) or not math.isfinite(number):
            self._refuse(value, "it must be a finite number")
        if number != float(value):
            self._refuse(value, "it must be a whole number")
        low, high = self.limits
        if not low <= number <= high:
            self._refuse(value, f"it must lie between {low:g} and {high:g}")
        if self.name.startswith("u_") and self.unit == "µm" and 0.0 < number < _SMALLEST_U_UM:
            self._refuse(
                value,
                f"no length is known so well. It is in µm: were {1e3 * number:g} µm typed in mm?",
            )
        return number  # type: ignore[no-any-return]

    def _refuse(self, value: Any, reason: str) -> None:
        unit = f" {self.unit}" if self.unit and isinstance(value, float | int) else ""
        raise PretravelError(
            f"{self.plain_name.replace('_', ' ')} is {value}{unit}; {reason}",
            inputs=(self.plain_name,),
        )


class Result:
    """What a task made: its report, its values for files, and the exit code of the command.

    A result is usually a frozen dataclass with the task it comes from.
    """

    exit_code: int = 0
    text: str = ""
    """Printed as it is, before the report: a description to edit."""
    cautions: tuple[str, ...] = ()
    """Warnings of a result without a report; a report has its own."""
    template: str = "page.html"
    """Of its page."""

    @property
    def advice(self) -> str:
        """Printed after the report: what to do next."""
        return ""

    def document(self) -> Document | None:
        """The report; None where there is none."""
        return None

    def page(self) -> Document | None:
        """The report of a page: with `readings`, it says how the files were understood."""
        document = self.document()
        readings: FileReadings | None = getattr(self, "readings", None)
        if document is None or readings is None or not readings.touches.reading:
            return document
        return replace(document, notes=(*document.notes, f"read: {readings.touches.reading}"))

    def in_brief(self, report: Document) -> Document:
        """What a terminal shows of the report where the full one is not asked for."""
        return report

    def report(self, *, verbose: bool = False) -> str:
        """The report as the text that the command prints; empty where there is none.

        Parameters
        ----------
        verbose : bool
            The full report.
        """
        from pretravel.show import terminal_text

        document = self.document()
        if document is None:
            return self.text
        shown = document if verbose else self.in_brief(document)
        return terminal_text(shown, verbose=verbose)

    def picture(self, document: Document | None, path: Path) -> None:
        """Write the main picture of the report."""
        if document is not None:
            document.pictures[0].save(path)

    def write_report(self, path: Path, record: WorkRecord | None = None) -> None:
        """Write the report: its values (.json), or a page (.html, .pdf).

        Parameters
        ----------
        path : Path
        record : WorkRecord or None
            The command and its input files.
        """
        from pretravel.show import write_report

        page = self.page()
        if page is not None:
            write_report(path, page, record=record, template=self.template)

    def write(self, output: str, path: Path) -> None:
        """Write the values of one output that is not the report.

        Parameters
        ----------
        output : str
            Name of the field.
        path : Path
            Its ending tells the format.
        """
        raise NotImplementedError(f"{type(self).__name__} writes no {output}: {path}")


@dataclass(frozen=True)
class TextResult(Result):
    """A text that is printed, which the output contains too where one is asked for.

    Attributes
    ----------
    text : str
        What is printed.
    content : str
        What the output contains.
    """

    text: str
    content: str = ""

    def write(self, output: str, path: Path) -> None:
        """Write the content."""
        del output
        from pretravel.base import write_text

        write_text(path, self.content)


@dataclass_transform(frozen_default=True, kw_only_default=True)
@dataclass(frozen=True, kw_only=True)
class Task:
    """Settings of a task; a subclass is made a frozen dataclass, and its docstring is the help.

    Attributes
    ----------
    name : str
        Of the command: ``plan-touches``, ``program sphere``.
    example : str
        A command line.
    given : frozenset of str
        Settings that were typed, also with their default value.
    """

    name: ClassVar[str] = ""
    example: ClassVar[str] = ""
    inherited_without: ClassVar[Mapping[str, tuple[str | When, ...]]] = {}
    given: frozenset[str] = data_field(default=frozenset(), repr=False, compare=False)

    def __init_subclass__(cls, without: SettingsOfModes = None, **options: Any) -> None:
        """Make the type a frozen dataclass.

        Parameters
        ----------
        without : mapping of str to tuple of str or When, optional
            Settings of types that it extends, and the modes without them; of those without a mode,
            the task never has any.
        """
        super().__init_subclass__(**options)
        cls.inherited_without = {**cls.inherited_without, **(without or {})}
        dataclass(frozen=True, kw_only=True)(cls)

    def __post_init__(self) -> None:
        for setting in settings_of(type(self)):
            value = getattr(self, setting.name)
            object.__setattr__(self, setting.name, setting.checked(value))
        for setting in settings_of(type(self)):
            if self.stated(setting.name):
                _refuse_unused(type(self), setting, vars(self))

    def run(self, progress: Progress = SILENT) -> Any:
        """Do the task.

        Returns
        -------
        Result

        Raises
        ------
        PretravelError
            Settings or files that cannot be used.
        """
        raise NotImplementedError

    @classmethod
    def needed_outputs(cls, stated: Mapping[str, Any]) -> tuple[str, ...]:
        """Outputs without which a task with these settings does not run."""
        del stated
        found = (s for s in settings_of(cls) if s.field.writes and s.default is MISSING)
        return tuple(setting.name for setting in found)

    def further_files(self) -> Sequence[Path]:
        """Files that are read in addition to those that the settings name one by one."""
        return ()

    def endings(self, output: str) -> tuple[str, ...]:
        """Endings that a file of an output can have, where other settings decide that.

        Parameters
        ----------
        output : str
            Name of the field.
        """
        return by_name(type(self))[output].field.writes

    def stated(self, name: str) -> bool:
        """Whether a setting was typed, or differs from its default."""
        setting = by_name(type(self))[name]
        value = getattr(self, name)
        # A copy of a task for a part of its work resets typed settings to nothing.
        if setting.default is MISSING or (name in self.given and value not in (None, ())):
            return True
        return bool(value != setting.checked(setting.default))

    def python_lines(self) -> str:
        """The Python lines that do the task.

        >>> from pretravel.tasks.qualify import Qualify
        >>> print(Qualify(touches="sphere.csv", diameter=25).python_lines())
        from pretravel.tasks.qualify import Qualify
        result = Qualify(touches='sphere.csv', diameter=25.0).run()
        >>> print(Qualify(touches="sphere.csv", diameter=25, output="report.html").python_lines())
        from pathlib import Path
        from pretravel.tasks.qualify import Qualify
        result = Qualify(touches='sphere.csv', diameter=25.0).run()
        result.write_report(Path('report.html'))
        """
        kind = type(self)
        stated = [s for s in settings_of(kind) if self.stated(s.name) and _of_the_work(s)]
        stated.sort(key=lambda s: not s.field.positional)
        words = [f"{s.name}={_python_value(getattr(self, s.name), s)}" for s in stated]
        lines = [
            f"from {kind.__module__.removesuffix('.task')} import {kind.__name__}",
            f"result = {kind.__name__}({', '.join(words)}).run()",
        ]
        for setting, path in self.written_files():
            place = f"Path({str(path)!r})"
            if setting.field.in_run:
                continue
            if setting.field.writes == PICTURES:
                lines.append(f"result.picture(result.document(), {place})")
            elif setting.is_report(path):
                lines.append(f"result.write_report({place})")
            else:
                lines.append(f"result.write({setting.name!r}, {place})")
        if len(lines) > 2:
            lines.insert(0, "from pathlib import Path")
        return "\n".join(lines)

    def command_line(self) -> str:
        """The command that does the task: what differs from its default.

        >>> from pretravel.tasks.qualify import Qualify
        >>> task = Qualify(touches="a b.csv", diameter=25, ring=True, output="map.json")
        >>> task.command_line()
        "pretravel qualify 'a b.csv' --diameter 25 --ring -o map.json"
        """
        words = ["pretravel", *self.name.split()]
        stated = [s for s in settings_of(type(self)) if self.stated(s.name)]
        for setting in sorted(stated, key=lambda s: (not s.field.positional, bool(s.field.writes))):
            value = getattr(self, setting.name)
            for each in value if setting.several else (value,):
                if setting.kind is bool:
                    yes, _, no = setting.option.partition("/")
                    words += [yes if each else no]
                elif setting.field.positional:
                    words += [setting.text(each)]
                else:
                    words += [setting.field.short or setting.option, setting.text(each)]
        return shlex.join(words)

    def read_files(self) -> list[Path]:
        """The files that the settings name."""
        found = list(self.further_files())
        for setting in settings_of(type(self)):
            value, reads = getattr(self, setting.name), setting.field.reads
            if value is None or not reads:
                continue
            if callable(reads):
                found += reads(value)
            else:
                found += map(Path, value if setting.several else (value,))
        return found

    def written_files(self) -> Iterator[tuple[Setting, Path]]:
        """The outputs that are asked for, with their fields."""
        for setting in settings_of(type(self)):
            value = getattr(self, setting.name)
            if setting.field.writes and value is not None:
                yield setting, value


_DESCRIBED: dict[Any, dict[str, Setting]] = {}


def by_name(task: type[Task]) -> dict[str, Setting]:
    """The described fields of a task by their names: its own first, then those that it shares.

    Parameters
    ----------
    task : type of Task
    """
    if task not in _DESCRIBED:
        hints = get_type_hints(task, include_extras=True)
        own = [name for each in task.__mro__ for name in vars(each).get("__annotations__", ())]
        described = [each for each in fields(task) if each.name != "given"]
        ranked = sorted(described, key=lambda each: own.index(each.name))
        found = {each.name: _setting(each.name, hints[each.name], each.default) for each in ranked}
        _DESCRIBED[task] = {name: _with_modes(task, each, found) for name, each in found.items()}
    return _DESCRIBED[task]


def _modes(modes: Iterable[str | When]) -> list[When]:
    return [When(mode) if isinstance(mode, str) else mode for mode in modes]


def _with_modes(task: type[Task], setting: Setting, every: Mapping[str, Setting]) -> Setting:
    """A setting whose help also says in which modes it is used, made when it is read.

    Help that lists the kinds or the controls imports all of them.
    """
    without = (*setting.field.without, *task.inherited_without.get(setting.name, ()))
    never = task.inherited_without.get(setting.name) == ()

    def text() -> str:
        said = [setting.help, *(["Not used here."] if never else [])]
        for words, modes in (("Only with", setting.field.only), ("Not with", without)):
            names = {mode: every[mode.key] for mode in _modes(modes)}
            options = [
                mode.said(key.option_or_argument)
                + (f" ({key.option_or_argument})" if mode.what else "")
                for mode, key in names.items()
            ]
            said += [f"{words} {_either(options)}."] if options else []
        return " ".join(said)

    return setting._replace(field=replace(setting.field, help=text, without=without))


def unused(task: type[Task], name: str, values: Mapping[str, Any]) -> tuple[str, tuple[str, ...]]:
    """Why a setting is not used together with others, and the names of those; empty where it is.

    Parameters
    ----------
    task : type of Task
    name : str
    values : mapping of str to value
        Settings that are stated, or the stored values of a form.

    >>> from pretravel.drawing.tasks.measure import Measure
    >>> unused(Measure, "nominal", {"drawing": "drawing.toml"})
    ('not used with drawing: the file gives it for each feature', ('drawing',))
    >>> unused(Measure, "nominal", {})
    ('', ())
    """
    every = by_name(task)
    field = every[name].field
    if task.inherited_without.get(name) == ():
        return f"not used by {task.name}", ()
    for mode in _modes(field.without):
        if mode.holds(task, values):
            key = every[mode.key]
            why = f": {key.field.states}" if key.field.states else ""
            return f"not used with {mode.said('') or key.words}{why}", (mode.key,)
    needed = _modes(field.only)
    if not needed or any(mode.holds(task, values) for mode in needed):
        return "", ()
    said = _either([mode.said("") or every[mode.key].words for mode in needed])
    return f"only for {said}", tuple(mode.key for mode in needed)


def _refuse_unused(task: type[Task], setting: Setting, values: Mapping[str, Any]) -> None:
    reason, keys = unused(task, setting.name, values)
    if reason:
        names = [by_name(task)[key].plain_name for key in keys]
        raise PretravelError(
            f"{setting.words} is {reason}; leave it out",
            inputs=(setting.plain_name, *names),
        )


def settings_of(task: type[Task]) -> tuple[Setting, ...]:
    """The described fields of a task, in the order of `by_name`."""
    return tuple(by_name(task).values())


def _setting(name: str, hint: Any, default: Any) -> Setting:
    if get_origin(hint) is not Annotated:
        raise TypeError(f"the field {name} has no description: Annotated[type, Field(…)]")
    kind, *stated = get_args(hint)
    optional = get_origin(kind) in (Union, types.UnionType) and type(None) in get_args(kind)
    if optional:
        rest = [each for each in get_args(kind) if each is not type(None)]
        kind = rest[0] if len(rest) == 1 else Union[tuple(rest)]  # noqa: UP007
    if get_origin(kind) is Annotated:  # of another setting, which is optional here
        kind, *described = get_args(kind)
        stated = [*described, *stated]
    field, *modes = stated
    for more in modes:
        field = replace(
            field, only=(*field.only, *more.only), without=(*field.without, *more.without)
        )
    several = get_origin(kind) is tuple and get_args(kind)[-1] is Ellipsis
    return Setting(name, get_args(kind)[0] if several else kind, several, optional, default, field)


def _of_the_work(setting: Setting) -> bool:
    """Not an output that is written afterwards."""
    field = setting.field
    return field.in_run or field.writes in ((), FOLDER) or setting.default is MISSING


def _python_value(value: Any, setting: Setting) -> str:
    if setting.several:
        texts = [_python_value(each, setting._replace(several=False)) for each in value]
        return texts[0] if len(texts) == 1 else f"[{', '.join(texts)}]"
    return repr(value if isinstance(value, float | int | bool) else setting.text(value))
