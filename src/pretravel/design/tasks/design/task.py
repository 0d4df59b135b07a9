"""Search the best design for a specification; list the specifications of the package."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.design.tasks.study.task import PAGE
from pretravel.task import (
    SILENT,
    Field,
    Progress,
    Reported,
    Result,
    Task,
    TextResult,
    existing,
    output,
)

if TYPE_CHECKING:
    from pretravel.design.studies.design_search import FoundDesign
    from pretravel.show import Document


def _is_wish(text: str) -> bool:
    from pretravel.design.studies.wish import WISHES

    return text in WISHES.names()


class Design(Reported):
    """Find the probe that fits a specification best, within ranges and limits."""

    name = "design"
    example = "pretravel design stylus-50mm -o best.toml --plot best.png"

    wish: Annotated[
        str,
        Field(
            help="Specification: .toml, or a name that pretravel wishes lists.",
            positional=True,
            metavar="WISH",
            reads=existing,
            word=_is_wish,
        ),
    ]
    output: Annotated[Path, output("Description of the best probe: .toml.", ".toml")]
    page: Annotated[Path | None, PAGE] = None

    def run(self, progress: Progress = SILENT) -> DesignedProbe:
        """Search the design."""
        from pretravel.design.studies.design_search import find_design
        from pretravel.design.studies.wish import load_wish

        with progress.working("searching designs"):
            return DesignedProbe(find_design(load_wish(self.wish)))


@dataclass(frozen=True, eq=False)
class DesignedProbe(Result):
    """The best design for a specification."""

    found: FoundDesign

    def document(self) -> Document:
        """The report."""
        from pretravel.design.tasks.design.report import design_document

        return design_document(self.found)

    def write(self, output: str, path: Path) -> None:
        """Write the description of the best design, which ``pretravel predict`` takes."""
        del output
        from pretravel.base import whole_file
        from pretravel.design.studies.described import found_description

        text = found_description(self.found)
        with whole_file(path) as temporary:
            temporary.write_text(text, encoding="utf-8")


class Wishes(Task):
    """List the example specifications for a design, or print one as TOML."""

    name = "wishes"
    example = "pretravel wishes stylus-100mm > wish.toml"

    wish: Annotated[
        str | None,
        Field(help="A specification of the package, to print.", positional=True, metavar="NAME"),
    ] = None

    def run(self, progress: Progress = SILENT) -> TextResult:
        """The list, or the text of one."""
        del progress
        from pretravel.design.studies.wish import WISHES, load_wish

        if self.wish is not None:
            return TextResult(WISHES.text(self.wish))
        lines = [f"{entry:14} {load_wish(entry).study.name}" for entry in WISHES.names()]
        advice = "\npretravel wishes NAME > wish.toml prints a specification to edit."
        return TextResult("\n".join([*lines, advice, ""]))
