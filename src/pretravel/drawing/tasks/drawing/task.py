"""Read the drawing that a STEP file carries: datums, sizes and tolerances."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.task import PAGES, SILENT, Field, Progress, Reported, Result, output

if TYPE_CHECKING:
    from pretravel.drawing.pmi.model import ModelDrawing
    from pretravel.show import Document


class ReadDrawing(Reported):
    """Read datums, sizes and tolerances of a STEP file (AP242), as a drawing for measure."""

    name = "drawing"
    example = "pretravel drawing part.step -o drawing.toml"

    step: Annotated[
        Path,
        Field(
            help="A STEP file; if it contains no tolerances (semantic PMI), the drawing lists its "
            "bores, bosses and spheres to fill in.",
            positional=True,
            reads=True,
        ),
    ]
    output: Annotated[
        Path | None,
        output("Drawing for measure: .toml; or a page, .html or .pdf.", ".toml", *PAGES),
    ] = None

    def run(self, progress: Progress = SILENT) -> FoundDrawing:
        """Read the file.

        Raises
        ------
        InputError
            No STEP file, or one without faces.
        """
        from pretravel.drawing.pmi.model import read_model_drawing

        with progress.working(f"reading {self.step.name}"):
            return FoundDrawing(read_model_drawing(self.step))


@dataclass(frozen=True, eq=False)
class FoundDrawing(Result):
    """The drawing that a model carries."""

    model: ModelDrawing

    def document(self) -> Document:
        """The report."""
        from pretravel.drawing.tasks.drawing.report import drawing_document

        return drawing_document(self.model)

    def write(self, output: str, path: Path) -> None:
        """Write the file of features."""
        del output
        from pretravel.base import write_text

        write_text(path, self.model.text)
