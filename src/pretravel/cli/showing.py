"""The reports of results, as the commands show them."""

from __future__ import annotations

import re
from collections.abc import Sequence

import typer

from pretravel.show import Document, printable, terminal_text

_NAMED = 3
"""So many labels of one warning are listed; of more the first one and their number."""


def show(document: Document, *, verbose: bool) -> None:
    """Print a report on stdout, and its warnings on stderr, of one kind in one line."""
    typer.echo(terminal_text(document, verbose=verbose))
    for warning in document.warnings if verbose else grouped_warnings(document.warnings):
        typer.echo(f"Warning: {printable(warning)}", err=True)


def grouped_warnings(warnings: Sequence[str]) -> list[str]:
    """Warnings with those of one kind in one line: texts that differ in their label or numbers.

    >>> rig = [f"rig_{azimuth}: no edge at {azimuth} ms" for azimuth in (0, 30, 60, 90)]
    >>> grouped_warnings([*rig, "the budget is old"])
    ['rig_0: no edge at 0 ms (and 3 more of this kind, --verbose lists them)', 'the budget is old']
    >>> grouped_warnings(["bore1: lobes", "bore2: lobes"])
    ['bore1, bore2: lobes']
    """
    kinds: dict[str, list[tuple[str, str]]] = {}
    for warning in warnings:
        label, colon, text = warning.partition(": ")
        if not colon or " " in label:
            label, text = "", warning
        masked = re.sub(r"[+-]?\d[\d.,]*", "#", text) if label else text
        kinds.setdefault(masked, []).append((label, text))
    return [_one_line(found) for found in kinds.values()]


def _one_line(found: Sequence[tuple[str, str]]) -> str:
    (label, text), *others = found
    if not label:
        return text
    if len(found) <= _NAMED and all(other == text for _, other in others):
        return f"{', '.join(name for name, _ in found)}: {text}"
    more = f" (and {len(others)} more of this kind, --verbose lists them)" if others else ""
    return f"{label}: {text}{more}"
