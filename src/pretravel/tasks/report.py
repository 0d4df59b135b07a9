"""Bind the pages of several results into one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pretravel.tasks.task import PAGES, SILENT, Field, Progress, Result, Task


class Report(Task):
    """Bind the pages of several results into one, or make a PDF of a page.

    Results, pictures and what was done with what are taken over; each page keeps its date.
    """

    name = "report"
    group = "Files"
    example = "pretravel report qualify.html part.html bore.html -o report.pdf"

    pages: Annotated[
        tuple[Path, ...],
        Field(
            help="Pages that pretravel wrote (-o page.html).",
            positional=True,
            metavar="PAGES",
            reads=True,
        ),
    ]
    output: Annotated[
        Path,
        Field(
            help="All of them in one page: .html or .pdf.", short="-o", writes=PAGES, in_run=True
        ),
    ]
    title: Annotated[
        str | None, Field(help="Title of the page; the default names the results.")
    ] = None

    def run(self, progress: Progress = SILENT) -> BoundPages:
        """Read the pages and write the one that contains them."""
        from pretravel.show.page import write_contents
        from pretravel.show.page_content import read_page

        contents = [content for page in self.pages for content in read_page(page)]
        several = len(contents) > 1
        name = self.title or (", ".join(page.stem for page in self.pages) if several else "")
        with progress.working(f"writing {self.output.name}"):
            write_contents(self.output, contents, title=name)
        count = f"{len(contents)} results" if several else "1 result"
        return BoundPages(f"{self.output}: {count}\n")


@dataclass(frozen=True)
class BoundPages(Result):
    """The page of several results, which has been written.

    Attributes
    ----------
    text : str
        Its name, and how many results it contains.
    """

    text: str
