"""What to do at a control with the files that were made; docs/how-to has the whole guides."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeAlias

Steps: TypeAlias = Callable[[Mapping[str, str]], tuple[str, ...]]
"""From the texts of the files, by name, to a few steps."""


def same_steps(*steps: str) -> Steps:
    """Steps that are the same for all files of a control."""

    def fixed(texts: Mapping[str, str]) -> tuple[str, ...]:
        del texts
        return steps

    return fixed


OF_OTHERS = same_steps("Follow the guide of the package that adds this control.")
"""Where another package does not state steps."""


def _never_run(maker: str) -> str:
    return (
        f"No {maker} control has run these files yet. Prove them in single block, away from a part."
    )


def macro_b_steps(maker: str) -> Steps:
    """Steps for macro programs: with a table, one program fills it; a formula needs none.

    >>> macro_b_steps("Haas")({"O07751.nc": ""})[2]
    'There is no table to fill.'
    """

    def steps(texts: Mapping[str, str]) -> tuple[str, ...]:
        numbers = sorted(int(name[1:].partition(".")[0]) for name in texts)
        copied, fill = "the program", "There is no table to fill."
        if len(numbers) > 1:
            copied, fill = "both programs", f"In MDI: G65 P{numbers[0]}. The table is filled, once."
        look = "Look at the macro variables that the head names: they must be free."
        call = f"After each touch: G65 P{numbers[-1]} I1. J0. K0. {_NORMAL}"
        return (
            _never_run(maker),
            f"Copy {copied} to the control. {look}",
            fill,
            f"{call} #100 is the pretravel, in the unit of the files.",
        )

    return steps


_NORMAL = "with the normal of the wall (out of the part)."


def siemens_steps(texts: Mapping[str, str]) -> tuple[str, ...]:
    """Steps for cycles of a Siemens control, with a table or without one.

    >>> "PRETRAVEL_TABLE" in " ".join(siemens_steps({"PRETRAVEL.SPF": ""}))
    False
    """
    tables = [name.partition(".")[0] for name in texts if "TABLE" in name]
    cycles = ", ".join(sorted(name for name in texts if name.endswith(".SPF")))
    fill = "".join(f" In MDA: {name}, once." for name in tables)
    save = "Save the user data of the control."
    call = f"After each touch: PRETRAVEL(1,0,0) {_NORMAL}"
    return (
        _never_run("Siemens"),
        f"{save} Add the lines DEF of PRETRAVEL_GUD.DEF to UGUD.DEF and activate it.",
        f"Copy {cycles} to the user cycles.{fill}",
        f"{call} PT_VALUE is the pretravel, in the unit of the files.",
    )
