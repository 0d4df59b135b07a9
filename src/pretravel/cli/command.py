"""A command whose errors name the options that can correct them."""

from __future__ import annotations

from typing import Any

from typer.core import TyperCommand, TyperOption

from pretravel.errors import PretravelError


class Command(TyperCommand):
    """A command that adds its options to the messages of the library.

    The library speaks of quantities and names the inputs that can correct a fault
    (`PretravelError.inputs`). An input ``tip_diameter`` is the option ``--tip-diameter`` of a
    command that has it.
    """

    def invoke(self, ctx: Any) -> Any:
        """Run the command; `ctx` is the context of click that typer brings."""
        try:
            return super().invoke(ctx)
        except PretravelError as error:
            options = ", ".join(filter(None, (self.option(name) for name in error.inputs)))
            if not options:
                raise
            raise PretravelError(f"{error} ({options})") from error

    def option(self, name: str) -> str:
        """The longest spelling of the option for an input; empty where there is none."""
        for parameter in self.params:
            if isinstance(parameter, TyperOption):
                longest = max(parameter.opts, key=len)
                if name in (parameter.name, longest.lstrip("-").replace("-", "_")):
                    return longest
        return ""
