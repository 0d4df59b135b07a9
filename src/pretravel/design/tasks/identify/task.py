"""Identify quantities of a probe's description from a measured map, measured forces, or both."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.design.tasks.described_probe import ModelName
from pretravel.task import (
    PAGES,
    SILENT,
    Field,
    Progress,
    Reported,
    Result,
    existing,
    is_probe,
    output,
)

if TYPE_CHECKING:
    from pretravel.design.identification.probe_from_map import Identification
    from pretravel.show import Document


class Identify(Reported):
    """Identify quantities of a probe's description from a measured map, from forces, or both."""

    name = "identify"
    example = (
        "pretravel identify map.json --probe omp40-2-100mm --free rotation,stem_diameter "
        "-o mine.toml"
    )

    probe: Annotated[
        str,
        Field(
            help="Initial description: catalogue name or TOML file.", reads=existing, word=is_probe
        ),
    ]
    map_file: Annotated[
        Path | None,
        Field(help="Map from qualify: .json or .csv.", positional=True, metavar="MAP", reads=True),
    ] = None
    forces: Annotated[
        Path | None,
        Field(
            help="Measured trigger forces, .csv with columns azimuth_deg, force_N, u_N and, for "
            "directions not across the axis, polar_deg; alone or with a map.",
            label="Measured trigger forces",
            reads=True,
        ),
    ] = None
    free: Annotated[
        str,
        Field(
            help="Quantities to identify, separated by commas, of preload, lever, tripod_radius, "
            "support_angle, ball_radius, rod_radius, stem_diameter, rotation, rod_azimuth_1 to _3, "
            "and friction (from forces alone). preload: force of the spring; lever: distance from "
            "the tip to the plane of the rods; support_angle, ball_radius: of the seats; rotation: "
            "of the tripod about the probe axis.",
            metavar="NAMES",
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
        from pretravel.design.identification.trigger_forces import read_trigger_forces
        from pretravel.files import read_map
        from pretravel.prediction import load_probe

        description = load_probe(self.probe)
        pretravel_map = None if self.map_file is None else read_map(self.map_file)
        forces = None if self.forces is None else read_trigger_forces(self.forces)
        names = [name.strip() for name in self.free.split(",") if name.strip()]
        with progress.working("identifying"):
            found = identify(pretravel_map, description, names, model=self.model, forces=forces)
        return IdentifiedProbe(self, found)


@dataclass(frozen=True, eq=False)
class IdentifiedProbe(Result):
    """A description that fits a map."""

    task: Identify
    found: Identification

    @property
    def source(self) -> str:
        """Names of the files that were fitted."""
        files = (self.task.map_file, self.task.forces)
        return " and ".join(path.name for path in files if path is not None)

    def document(self) -> Document:
        """The report."""
        from pretravel.design.tasks.identify.report import identification_document

        return identification_document(self.found, model=self.task.model, map_name=self.source)

    def write(self, output: str, path: Path) -> None:
        """Write the description, which is read once before."""
        del output
        from pretravel.base import write_text
        from pretravel.design.identification.probe_from_map import identified_description
        from pretravel.prediction import parse_probe, source_text

        task = self.task
        text = identified_description(source_text(task.probe), self.found, self.source)
        parse_probe(text, str(path), path.parent)
        write_text(path, text)
