"""What to do with the files at a control, in a few steps; docs/how-to has the whole guides."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from functools import cache
from importlib import resources

_OF_ANOTHER_PACKAGE = "Follow the guide of the package that adds this control."


@cache
def _steps() -> dict[str, list[str]]:
    text = resources.files(__package__).joinpath("control_steps.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


def control_steps(control: str, names: Iterable[str]) -> tuple[str, ...]:
    """The steps at a control.

    Parameters
    ----------
    control : str
        As `Export.to`.
    names : iterable of str
        Of the files that were made; they contain the numbers of the programs.

    Returns
    -------
    tuple of str

    >>> control_steps("fanuc", ["O7750.nc", "O7751.nc"])[2]
    'In MDI: G65 P7750. The table is filled, once.'
    """
    steps = _steps().get(control, [_OF_ANOTHER_PACKAGE])
    numbers = sorted(int(name.split(".")[0][1:]) for name in names if name[1:5].isdigit())
    table, lookup = (numbers[0], numbers[-1]) if numbers else ("", "")
    return tuple(step.format(table=table, lookup=lookup) for step in steps)
