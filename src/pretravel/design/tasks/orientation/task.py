"""Predict the map of a probe in another orientation of an indexing head."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.base import ANGLE, DEGREE, MICROMETRE
from pretravel.task import (
    MAPS,
    PAGES,
    SILENT,
    Field,
    Progress,
    Reported,
    Result,
    UnitVector,
    existing,
    is_probe,
    models,
    output,
)

if TYPE_CHECKING:
    from pretravel.design.identification.orientation import TurnedMap
    from pretravel.maps import PretravelMap
    from pretravel.show import Document, View


class MapInOrientation(Reported):
    """Predict the map of another orientation of an indexing head.

    The new map follows from the old map and the weight of the probe's moving parts. Check the new
    map with a few touches: pretravel qualify touches.csv --prior turned.json --diameter 25
    """

    name = "orientation"
    example = "pretravel orientation map.json --probe probe.toml --axis 0,1,0 -o turned.json"

    map_file: Annotated[
        Path,
        Field(
            help="Map of pretravel qualify in one orientation, .json.",
            positional=True,
            metavar="MAP",
            reads=True,
        ),
    ]
    probe: Annotated[
        str,
        Field(
            help="Description of the probe with its moving mass: a catalogue name, or a file, as "
            "pretravel identify writes it, so that rods and lobes are in the same place.",
            reads=existing,
            word=is_probe,
        ),
    ]
    axis: Annotated[
        UnitVector,
        Field(
            help="The probe's axis in the new orientation, from the tip to the head, in the "
            "machine's frame.",
            metavar="X,Y,Z",
        ),
    ]
    roll_deg: Annotated[
        float,
        Field(
            help="Turn about the new axis, in degrees, after the shortest turn to it.", range=ANGLE
        ),
    ] = 0.0
    gravity: Annotated[
        UnitVector,
        Field(
            help="Direction of the weight in the machine's frame.",
            metavar="X,Y,Z",
        ),
    ] = UnitVector(0, 0, -1)
    model: Annotated[
        str, Field(help="Model of the probe's compliance.", names=models, metavar="MODEL")
    ] = "analytic"
    output: Annotated[
        Path | None, output("Map: .json, or a .csv table; or a page.", *MAPS, *PAGES)
    ] = None

    def run(self, progress: Progress = SILENT) -> TurnedProbe:
        """Read map and description, and predict the difference."""
        from pretravel.design.identification.orientation import in_orientation
        from pretravel.files import read_map
        from pretravel.prediction import load_probe

        old = read_map(self.map_file)
        with progress.working("predicting both orientations"):
            turned = in_orientation(
                old,
                load_probe(self.probe),
                self.axis,
                roll=self.roll_deg * DEGREE,
                gravity=self.gravity,
                model=self.model,
            )
        return TurnedProbe(self, turned)


@dataclass(frozen=True, eq=False)
class TurnedProbe(Result):
    """A map in another orientation."""

    task: MapInOrientation
    turned: TurnedMap

    @property
    def pretravel_map(self) -> PretravelMap:
        """The new map."""
        return self.turned.pretravel_map

    def document(self) -> Document:
        """The report."""
        import numpy as np

        from pretravel.show import Document, KeyFigure, Picture, decimals

        found = self.turned
        size = found.difference / MICROMETRE
        figures = (
            KeyFigure("the weight changes pretravel by", float(np.sqrt(np.mean(size**2))), "µm",
                      decimals(2), remark=f"root mean square; {size.min():+.2f} to "
                      f"{size.max():+.2f} µm"),
            KeyFigure("u of this change", found.share * float(np.sqrt(np.mean(size**2))), "µm",
                      decimals(2),
                      remark=f"{100 * found.share:.0f} %: mass and height of the moving parts, and "
                      "lobes of the map that the description does not explain"),
            KeyFigure("not followed by the kind of map", found.missed / MICROMETRE, "µm",
                      decimals(2), remark="in u of every point"),
        )  # fmt: skip
        axis = ", ".join(f"{part:g}" for part in self.task.axis)
        return Document(
            title=f"{self.task.map_file.name}: with its axis along {axis}",
            verdict="a map of another orientation, predicted from the weight of the probe",
            figures=figures,
            pictures=(Picture("Change of the pretravel by the weight", lambda: _view(found)),),
            notes=(
                (
                    "Predicted, not measured: touch five to nine directions on the sphere in this "
                    "orientation, and update this map with them in qualify, which refuses it where "
                    "it does not fit."
                ),
            ),
        )

    def write(self, output: str, path: Path) -> None:
        """Write the map."""
        del output
        from pretravel.files import write_map

        write_map(path, self.pretravel_map)


def _view(found: TurnedMap) -> View:
    from pretravel.base import azimuth_angle, polar_angle
    from pretravel.show import Axis, Dots, PlaneChart, Rule, View, azimuth_axis

    polar = polar_angle(found.directions) / DEGREE
    azimuth, change = azimuth_angle(found.directions) / DEGREE, found.difference / MICROMETRE
    wall = polar >= 60.0
    marks = (
        Dots(azimuth[wall], change[wall], "walls (polar 60° and more)", "series1"),
        Dots(azimuth[~wall], change[~wall], "from above", "series2"),
    )
    chart = PlaneChart("Change of pretravel by the weight", azimuth_axis(),
                       Axis("change", "µm"), (Rule(0.0), *marks))  # fmt: skip
    return View("Another orientation of the head", (chart,))
