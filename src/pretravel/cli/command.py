"""A command whose errors name the options that can correct them."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from difflib import get_close_matches
from itertools import pairwise
from typing import Any

import typer
from typer.core import TyperCommand, TyperOption

from pretravel.base import PretravelError
from pretravel.cli.typed_values import HelpUnread
from pretravel.task import ANSWER as ANSWER
from pretravel.task import PLACES, Setting, settings_of, task_named

FAULT = 2
"""Exit code of a fault of any kind: of the options, a file, the disk, pretravel itself."""
INTERRUPTED = 130
"""Exit code after an interruption from the keyboard."""
TYPED = "pretravel.typed"
"""Where the context keeps the arguments as they were typed."""

USAGE_ERROR: Any = typer.BadParameter.__base__
"""What typer raises for words that it cannot read; it has no public name."""
_ALIKE = 0.73
"""Least similarity of an option that may be meant; with one letter less of eight it is 0.93."""
_RENAMED = {("measure", "--features"): "--drawing"}
"""Options by their command and their former name, and their names of today."""


WHOLE_HELP = "--help-all"
OPTIONS, SPECIAL, OUTPUT = "Options", "In special cases", "Output"
_LONG = 80
"""Characters of a first sentence, of which more is cut at its colon."""
_FOLDED = ("Reading a file", SPECIAL)
"""Parts of the help of which the short one gives the names alone."""
_OUTSIDE = r"(?![^(]*\))"
"""Not within parentheses."""
_SENTENCE = re.compile(rf"(?:(?<=[\w)])\. (?=[A-Z]|[\w-]+: )|; ){_OUTSIDE}")
"""Where the first sentence of a text ends: at the next one, or at the list of choices."""
_TYPES = (
    (r"<(?:float|int)(?: range)?>", "NUMBER"),
    (r"<(?:list\[)?[pP]ath\]?>", "FILE"),
    (r"<(?:list\[)?str\]?>", "TEXT"),
)
"""Types of Python in the help, and what they are called there."""


class Command(HelpUnread, TyperCommand):
    """A command that adds its options to the messages of the library.

    The library speaks of quantities and names the inputs that can correct a fault
    (`PretravelError.inputs`). An input ``tip_diameter`` is the option ``--tip-diameter`` of a
    command that has it. Values that typer refuses become messages of the same form.

    Attributes
    ----------
    settings : mapping of str to Setting
        Of its task, by the names of the parameters.
    """

    settings: Mapping[str, Setting] = {}

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the arguments; a value that cannot be used is named with its option."""
        args = [self._renamed(word) for word in args]
        ctx.meta[TYPED] = tuple(args)
        if WHOLE_HELP in args:
            ctx.meta[WHOLE_HELP] = True
            typer.echo(self.get_help(ctx))
            ctx.exit()
        self._refuse_twice(args)
        self._refuse_underscores(args)
        try:
            rest: list[str] = super().parse_args(ctx, args)
        except typer.BadParameter as error:
            if not error.message or error.param is None:  # an option is missing: typer's message
                raise
            raise PretravelError(f"{typed_name(error.param)} {error.message}") from error
        except USAGE_ERROR as error:
            if hasattr(error, "option_name"):
                self._advise(error)
            raise
        for parameter in self.params:
            value = ctx.params.get(parameter.name)
            numbers = value if isinstance(value, tuple) else (value,)
            if any(isinstance(n, float) and not math.isfinite(n) for n in numbers):
                raise PretravelError(f"{typed_name(parameter)} {value}: it must be finite")
        return rest

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help as plain text: options in parts, the first sentence of each.

        With ``--help-all`` all of every text, and every part.
        """
        whole = ctx.meta.get(WHOLE_HELP, False)
        self._take_help()
        self.format_usage(ctx, formatter)
        text = "\n\n".join((self.help or "").split("\n\n")[: None if whole else 2])
        with formatter.indentation():
            formatter.write_paragraph()
            formatter.write_text(text)
        for title, parameters in self._parts(ctx).items():
            with formatter.section(title):
                if title in _FOLDED and not whole:
                    formatter.write_text(", ".join(map(typed_name, parameters)))
                else:
                    formatter.write_dl([_help_row(each, ctx, whole) for each in parameters])
        formatter.write_paragraph()
        formatter.write_text(self.epilog or "")
        if not whole:
            formatter.write_text(f"All options in full: {WHOLE_HELP}")

    def shell_complete(self, ctx: Any, incomplete: str) -> list[Any]:
        """What can follow, with its help."""
        self._take_help()
        return list(super().shell_complete(ctx, incomplete))

    def _take_help(self) -> None:
        """Take the help of the parameters from the settings: some lists all kinds or controls."""
        each: Any
        for each in self.params:
            if each.name in self.settings:
                each.help = self.settings[each.name].help

    def collect_usage_pieces(self, ctx: Any) -> list[str]:
        """The words of the usage; an argument that is needed without typer's braces."""
        pieces: list[str] = super().collect_usage_pieces(ctx)
        return [re.sub(r"^\{(\w+)\}", lambda name: name[1].upper(), piece) for piece in pieces]

    def _parts(self, ctx: Any) -> dict[str, list[Any]]:
        """Arguments and options below their titles, those for all work first."""
        parts: dict[str, list[Any]] = {"Arguments": [], OPTIONS: [], OUTPUT: []}
        for each in self.get_params(ctx):
            is_option = isinstance(each, TyperOption)
            title = getattr(each, "rich_help_panel", None) or OPTIONS if is_option else "Arguments"
            parts.setdefault(title, []).append(each)
        return {title: found for title, found in parts.items() if found}

    def _advise(self, error: Any) -> None:
        """Say of an option that does not exist which options are spelled alike, or who has it."""
        known = [option.lstrip("-") for each in self.params for option in each.opts]
        alike = get_close_matches(error.option_name.lstrip("-"), known, cutoff=_ALIKE)
        error.possibilities = [f"--{name}" for name in alike] or None
        others = [] if alike else _commands_with(error.option_name)
        if others:
            error.message += f". It is an option of {', '.join(others)}"

    def _renamed(self, word: str) -> str:
        """The option that replaces a deprecated one, which is said on stderr."""
        option, sign, value = word.partition("=")
        now = _RENAMED.get((self.name or "", option), option)
        if now != option:
            typer.echo(f"Warning: {option} is deprecated: it is called {now} now", err=True)
        return f"{now}{sign}{value}"

    def _refuse_underscores(self, args: list[str]) -> None:
        """Refuse 1_0, which Python reads as 10, where a number is typed."""
        numbers = {
            option: parameter
            for parameter in self.params
            if isinstance(parameter, TyperOption)
            and parameter.type_descriptor.annotation in (float, int)
            for option in parameter.opts
        }
        joined = [tuple(word.split("=", 1)) for word in args if "=" in word]
        for option, value in (*pairwise(args), *joined):
            if option in numbers and "_" in value:
                raise PretravelError(f"{typed_name(numbers[option])} {value}: it must be a number")

    def _refuse_twice(self, args: list[str]) -> None:
        """Refuse an option that takes one value and is given twice: the last would win."""
        words = [_option_of(word) for word in args if word.startswith("-")]
        for parameter in self.params:
            if not isinstance(parameter, TyperOption) or parameter.multiple or parameter.is_flag:
                continue
            given = [word for word in words if word in parameter.opts]
            if len(given) > 1:
                raise PretravelError(
                    f"{given[-1]} is given {len(given)} times, and takes one value: give one, and "
                    "run the command again for another"
                )

    def invoke(self, ctx: Any) -> Any:
        """Run the command; `ctx` is the context of click that typer brings."""
        from pretravel.show import draw_for_a_command

        draw_for_a_command()
        try:
            return super().invoke(ctx)
        except PretravelError as error:
            options = ", ".join(filter(None, (self.option(name) for name in error.inputs)))
            if not options:
                raise
            told = PretravelError(f"{error} ({options})")
            told.exit_code = error.exit_code
            raise told from error

    def option(self, name: str) -> str:
        """The longest spelling of the option for an input; empty where there is none."""
        for parameter in self.params:
            if isinstance(parameter, TyperOption):
                longest = typed_name(parameter)
                if name in (parameter.name, longest.lstrip("-").replace("-", "_")):
                    return longest
        return ""


def _help_row(parameter: Any, ctx: Any, whole: bool) -> tuple[str, str]:
    """Spelling and text of an argument or option; of a short one the first sentence."""
    name, text = parameter.get_help_record(ctx) or (typed_name(parameter), parameter.help or "")
    name = re.sub(r"(?: RANGE)? *\[[^\]]*<=[^\]]*\]", "", name)
    name = name if name.startswith("-") else name.upper()
    for kinds, word in _TYPES if name.startswith("-") else ((r" <.*", ""),):
        name = re.sub(kinds, word, name)
    if whole:
        return name, text
    default = re.search(r"default: ([^;\]]+?)(?:\.0)?\.?(?:\. [A-Z]| +\[|;|\]|$)", text)
    first = parameter.help or text
    if parameter.rich_help_panel != OUTPUT:  # of an output all formats are named
        first = _SENTENCE.split(first, maxsplit=1)[0]
        if len(first) > _LONG:
            first = re.split(r": " + _OUTSIDE, first, maxsplit=1)[0]
    first = first.rstrip(".")
    if parameter.required and name.startswith("-"):
        return name, f"{first}. [required]"
    return name, f"{first}. [{default[1]}]" if default else f"{first}."


def _commands_with(option: str) -> list[str]:
    """The commands that have an option."""
    tasks = [task_named(name) for name in PLACES]
    return [t.name for t in tasks if option in {each.option for each in settings_of(t)}]


def typed_name(parameter: Any) -> str:
    """An option as it is typed; an argument as the help shows it."""
    longest: str = max(parameter.opts, key=len)
    if longest.startswith("-"):
        return longest
    return str(parameter.metavar or longest).upper()


def _option_of(word: str) -> str:
    """The option of a word, without a value that stands in the same word: -oa.csv, --tip=A."""
    return word.partition("=")[0] if word.startswith("--") else word[:2]
