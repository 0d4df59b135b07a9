"""How a program ends before its end."""

from __future__ import annotations


class StopError(Exception):
    """The control stops the program.

    `own` is true for a stop that the program itself asked for, (ABORT,…).
    """

    def __init__(self, text: str, *, own: bool = False) -> None:
        super().__init__(text)
        self.text = text
        self.own = own
