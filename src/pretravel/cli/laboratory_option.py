"""The option --lab of commands whose reports a laboratory keeps."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import typer

from pretravel.cli.files import is_page

if TYPE_CHECKING:
    from pretravel.laboratory.certificate import LaboratoryStatements

LaboratoryFile: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--lab",
        help="Laboratory, instrument with serial numbers, reference, environment and operator, "
        "for the report: .toml, as pretravel laboratory prints it.",
    ),
]


def laboratory_statements(lab: Path | None) -> LaboratoryStatements | None:
    """What the file of a laboratory states; None without a file."""
    from pretravel.files.laboratory_file import read_laboratory

    return None if lab is None else read_laboratory(lab)


def statements_left_out(
    lab: Path | None, output: Path | None, *, verbose: bool, kept_in: tuple[str, ...] = ()
) -> list[str]:
    """A warning where nothing that is shown or written contains the laboratory's statements.

    Parameters
    ----------
    lab, output : Path or None
    verbose : bool
        The full report, which contains them, is printed.
    kept_in : tuple of str
        Endings of outputs that contain them, beside pages.
    """
    if lab is None or verbose or is_page(output):
        return []
    if output is not None and output.suffix.lower() in kept_in:
        return []
    contained = "a page (-o page.html) and the full report (--verbose) contain what it states"
    if output is None:
        return [f"{lab.name} was given, but is not shown: {contained}"]
    return [f"{output.name} does not contain what {lab.name} states: {contained}"]
