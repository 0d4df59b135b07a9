"""Bind several results into one page."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.base import InputError
from pretravel.task import PAGES, SILENT, Field, Progress, Result, Task

if TYPE_CHECKING:
    from pretravel.show import PageContent


class Report(Task):
    """Combine several results in one page, or make a page of one result.

    The page contains the values and pictures, and which command used which files; each result
    keeps its date.
    """

    name = "report"
    example = "pretravel report qualify.report.json bore.json -o report.pdf"

    results: Annotated[
        tuple[Path, ...],
        Field(
            help="Results that pretravel wrote: NAME.report.json of every task with a page, or "
            "NAME.json where that is the report.",
            positional=True,
            metavar="RESULTS",
            reads=True,
        ),
    ]
    output: Annotated[
        Path,
        Field(help="Page with all results: .html or .pdf.", short="-o", writes=PAGES, in_run=True),
    ]
    title: Annotated[
        str | None, Field(help="Title of the page; the default names the results.")
    ] = None

    def run(self, progress: Progress = SILENT) -> BoundPages:
        """Read the results and write the page that contains them."""
        from pretravel.show import write_contents

        contents = [_drawn(path, progress) for path in self.results]
        several = len(contents) > 1
        name = self.title or (", ".join(map(_name, self.results)) if several else "")
        with progress.working(f"writing {self.output.name}"):
            write_contents(self.output, contents, title=name)
        count = f"{len(contents)} results" if several else "1 result"
        return BoundPages(f"{self.output}: {count}\n")


def _drawn(path: Path, progress: Progress) -> PageContent:
    """A result with its pictures: values of a stranger can be such that nothing can be drawn."""
    from pretravel.show import picture_figures, read_result

    content = read_result(path)
    try:
        with progress.working(f"drawing {path.name}"):
            for picture in content.document.pictures:
                _ = picture.pixels, picture_figures(picture)
    except (ValueError, ArithmeticError, IndexError, TypeError) as error:
        raise InputError("a picture of it cannot be drawn", path=path) from error
    return content


def _name(path: Path) -> str:
    return path.name.removesuffix(".json").removesuffix(".report")


@dataclass(frozen=True)
class BoundPages(Result):
    """The page of several results, which has been written.

    Attributes
    ----------
    text : str
        Its name, and how many results it contains.
    """

    text: str
