"""Identify quantities of a probe's description from a measured map."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.task import (
    PAGES,
    SILENT,
    Field,
    ModelName,
    Progress,
    Reported,
    Result,
    existing,
    output,
)

if TYPE_CHECKING:
    from pretravel.design.identification.probe_from_map import Identification
    from pretravel.show import Document


class Identify(Reported):
    """Identify quantities of a probe's description from a measured map."""

    name = "identify"
    group = "Predict"
    example = (
        "pretravel identify map.json --probe omp40-2 --free rotation,stem_diameter -o mine.toml"
    )

    map_file: Annotated[
        Path,
        Field(help="Map from qualify: .json or .csv.", positional=True, metavar="MAP", reads=True),
    ]
    probe: Annotated[
        str, Field(help="Initial description: catalogue name or TOML file.", reads=existing)
    ]
    free: Annotated[
        str,
        Field(
            help="Quantities to fit, a,b,…: preload, lever, tripod_radius, support_angle, "
            "ball_radius, rod_radius, stem_diameter, rotation, rod_azimuth_1, _2, _3."
        ),
    ] = "rotation,stem_diameter"
    model: ModelName = "analytic"
    output: Annotated[
        Path | None,
        output("The identified description, .toml; or a page, .html or .pdf.", ".toml", *PAGES),
    ] = None

    def run(self, progress: Progress = SILENT) -> IdentifiedProbe:
        """Fit the quantities."""
        from pretravel.design.identification.probe_from_map import identify
        from pretravel.files import read_map
        from pretravel.prediction import load_probe

        description = load_probe(self.probe)
        pretravel_map = read_map(self.map_file)
        names = [name.strip() for name in self.free.split(",") if name.strip()]
        with progress.working("identifying"):
            found = identify(pretravel_map, description, names, model=self.model)
        return IdentifiedProbe(self, found)


@dataclass(frozen=True, eq=False)
class IdentifiedProbe(Result):
    """A description that fits a map.

    Attributes
    ----------
    task : Identify
    found : Identification
    """

    task: Identify
    found: Identification

    def document(self) -> Document:
        """The report."""
        from pretravel.design.tasks.identify.report import identification_document

        task = self.task
        return identification_document(self.found, model=task.model, map_name=task.map_file.name)

    def write(self, output: str, path: Path) -> None:
        """Write the description, which is read once before."""
        del output
        from pretravel.base import write_text
        from pretravel.design.identification.probe_from_map import identified_description
        from pretravel.prediction import parse_probe, source_text

        task = self.task
        text = identified_description(source_text(task.probe), self.found, task.map_file.name)
        parse_probe(text, str(path), path.parent)
        write_text(path, text)
