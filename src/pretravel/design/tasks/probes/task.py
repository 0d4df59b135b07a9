"""List the catalogue of probes, or print one description."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.task import (
    PAGES,
    PICTURES,
    SILENT,
    Field,
    Progress,
    Result,
    Task,
    existing,
    is_probe,
    output,
)

if TYPE_CHECKING:
    from pretravel.prediction import Probe
    from pretravel.show import Document


class Probes(Task):
    """List the catalogue of probes, or print one description as TOML."""

    name = "probes"
    example = "pretravel probes omp40-2 > mine.toml"

    probe: Annotated[
        str | None,
        Field(
            help="A probe of the catalogue, to print; or a TOML file, to check.",
            positional=True,
            metavar="NAME",
            reads=existing,
            word=is_probe,
        ),
    ] = None
    plot: Annotated[
        Path | None,
        Field(help="Picture of the probe: .png, .svg or .pdf.", writes=PICTURES, only=("probe",)),
    ] = None
    output: Annotated[Path | None, output("A page, .html or .pdf.", *PAGES)] = None

    def run(self, progress: Progress = SILENT) -> Result:
        """The list, the text of one, or what a file holds."""
        del progress
        from pretravel.prediction import (
            catalogue_names,
            description_text,
            load_probe,
            seat_doubts,
        )

        if self.probe is None:
            return Catalogue()
        probe = load_probe(self.probe)
        if self.probe in catalogue_names():
            return ShownProbe(probe, description_text(self.probe))
        doubts = "".join(f"Warning: {doubt}\n" for doubt in seat_doubts(probe))
        return ShownProbe(probe, f"{self.probe}: {probe.name}, a valid description\n{doubts}")


@dataclass(frozen=True, eq=False)
class ShownProbe(Result):
    """One description: its text is printed, its report is on a page alone."""

    probe: Probe
    text: str = ""

    def picture(self, document: Document | None, path: Path) -> None:
        """Write the picture of the probe."""
        del document
        from pretravel.design.tasks.probes.report import probe_picture

        probe_picture(self.probe).save(path)

    def page(self) -> Document:
        """The report."""
        from pretravel.design.tasks.probes.report import probe_document

        return probe_document(self.probe)


class Catalogue(Result):
    """All descriptions of the package."""

    @property
    def advice(self) -> str:
        """What to do next."""
        return "\npretravel probes NAME > mine.toml prints a description to edit."

    def document(self) -> Document:
        """The list."""
        from pretravel.design.tasks.probes.report import catalogue_document
        from pretravel.prediction import catalogue_names, load_probe

        return catalogue_document({name: load_probe(name) for name in catalogue_names()})
