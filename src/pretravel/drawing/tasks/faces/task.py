"""List the faces of a STEP or IGES file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.task import PAGES, SILENT, Field, Progress, Reported, Result, output

if TYPE_CHECKING:
    import numpy.typing as npt

    from pretravel.show import Document
    from pretravel.surface import Part


class Faces(Reported):
    """List the faces of a STEP or IGES file, with the numbers to type in part.step#NUMBER."""

    name = "faces"
    example = "pretravel faces part.step --plot faces.png"

    step: Annotated[Path, Field(help="A STEP or IGES file.", positional=True, reads=True)]
    output: Annotated[
        Path | None, output("The list: .csv; or a page, .html or .pdf.", ".csv", *PAGES)
    ] = None

    def run(self, progress: Progress = SILENT) -> ListedFaces:
        """Read the file."""
        from pretravel.drawing.tasks.faces.report import faces_table
        from pretravel.surface import read_part

        with progress.working(f"reading {self.step.name}"):
            part = read_part(self.step)
            return ListedFaces(part, faces_table(part))


@dataclass(frozen=True, eq=False)
class ListedFaces(Result):
    """The faces of a part.

    Attributes
    ----------
    part : Part
    table : mapping of str to column
    """

    part: Part
    table: Mapping[str, npt.ArrayLike]

    def document(self) -> Document:
        """The report."""
        from pretravel.drawing.tasks.faces.report import faces_document

        return faces_document(self.part, self.table)

    def write(self, output: str, path: Path) -> None:
        """Write the list."""
        del output
        from pretravel.files import write_csv_table

        write_csv_table(path, self.table)
