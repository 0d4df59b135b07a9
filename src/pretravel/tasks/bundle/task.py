"""Put touches, map and machine into one file that can be sent: without names, numbers, dates."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from pretravel.base import REFERENCE_DIAMETER, TIP_BALL, U_OF_DIAMETER
from pretravel.task import SILENT, Field, OfOneTip, Progress, Result, TouchFilesWithFeed, output

if TYPE_CHECKING:
    from pretravel.show import Document

_READ_ME = """\
Touches of a probe, made with pretravel {version}.

touches.csv       positions of the tip's centre (mm), normals of the surface, approaches, feeds
description.json  reference, tip, instrument, as they were stated
versions.json     of the programs
{others}
Left out: {left_out}.
"""


class Bundle(TouchFilesWithFeed, OfOneTip):
    """Make one file to send: touches, map, machine and versions, without names and dates.

    Each part is read and written again as plain text. The command prints what the file contains:
    check it before you send the file. See "Call for data" in the documentation.
    """

    name = "bundle"
    example = (
        'pretravel bundle sphere.csv --diameter 25 --instrument "OMP40-2, 50 mm" -o bundle.zip'
    )

    diameter: Annotated[
        float | None,
        Field(
            help="Calibrated diameter of the sphere or ring, in mm.",
            range=REFERENCE_DIAMETER,
            label="Diameter of the reference",
        ),
    ] = None
    u_diameter_um: Annotated[
        float | None,
        Field(
            help="Standard uncertainty of the diameter, in µm.",
            range=U_OF_DIAMETER,
            label="Standard uncertainty of the diameter",
        ),
    ] = None
    ring: Annotated[
        bool, Field(help="The reference is a ring.", label="The reference is a ring gauge")
    ] = False
    tip_diameter: Annotated[
        float | None,
        Field(help="Diameter of the tip, in mm.", range=TIP_BALL, label="Diameter of the tip"),
    ] = None
    instrument: Annotated[
        str,
        Field(
            help="Probe, stylus, machine and control, in your words, without serial numbers.",
            metavar="TEXT",
        ),
    ] = ""
    map_file: Annotated[
        Path | None,
        Field(help="Map that was made of the touches, .json.", option="--map", reads=True),
    ] = None
    machine: Annotated[Path | None, Field(help="Machine file, .toml.", reads=True)] = None
    raw: Annotated[
        bool,
        Field(
            help="Add the files of touches as they are too, with all names and dates in them: for "
            "a file that is not read as it should be.",
            label="Add the files as they are",
        ),
    ] = False
    keep_labels: Annotated[
        bool, Field(help="Keep the labels of the touches; else they become numbers.")
    ] = False
    output: Annotated[Path, output("The bundle, .zip.", ".zip")]

    def run(self, progress: Progress = SILENT) -> BundledFiles:
        """Read the files and make the parts."""
        from pretravel.base import installed_version
        from pretravel.files import (
            anonymous_description,
            anonymous_map,
            anonymous_touches,
            versions,
        )

        readings = self.read_touches(progress, tip_diameter=self.tip_diameter)
        table, left_out = anonymous_touches(readings.touches, labels=self.keep_labels)
        texts: dict[str, str | bytes] = {"touches.csv": table}
        others = []
        if self.map_file is not None:
            texts["map.json"] = anonymous_map(self.map_file)
            others.append("map.json          the map that was made of them")
        if self.machine is not None:
            texts["machine.toml"] = anonymous_description(self.machine)
            others.append("machine.toml      the machine, without texts that name somebody")
        stated = {
            "reference": "ring" if self.ring else "sphere",
            "diameter_mm": self.diameter,
            "u_diameter_um": self.u_diameter_um,
            "tip_diameter_mm": self.tip_diameter,
            "feed_mm_min": self.feed,
            "instrument": self.instrument,
            "read_as": readings.touches.reading,
        }
        texts["description.json"] = json.dumps(stated, indent=1, ensure_ascii=False) + "\n"
        texts["versions.json"] = versions()
        if self.raw:
            left_out = "nothing of the files under raw/; of touches.csv: " + left_out
            for number, path in enumerate(self.files, start=1):
                name = f"raw/{number}{path.suffix.lower()}"
                texts[name] = path.read_bytes()
                others.append(f"{name:<18}a file of touches as it is, with everything in it")
        readme = _READ_ME.format(
            version=installed_version(), others="\n".join(others), left_out=left_out
        )
        notes = tuple(readings.notes())
        return BundledFiles(self, {"README.txt": readme, **texts}, left_out, notes)


@dataclass(frozen=True, eq=False)
class BundledFiles(Result):
    """The parts of a bundle.

    Attributes
    ----------
    task : Bundle
    texts : mapping of str to str or bytes
        By the names of the entries.
    left_out : str
    notes : tuple of str
        Of the files, as they were read.
    """

    task: Bundle
    texts: Mapping[str, str | bytes]
    left_out: str
    notes: tuple[str, ...] = ()

    def document(self) -> Document:
        """What is in the file, and what is not."""
        from pretravel.show import Column, Digits, Document, Table

        sizes = [
            len(each if isinstance(each, bytes) else each.encode()) for each in self.texts.values()
        ]
        return Document(
            title=f"{self.task.touches_name}: a bundle to send",
            verdict=f"{len(self.texts)} parts. Look at them before you send the file.",
            tables=(
                Table(
                    (
                        Column.of("part", list(self.texts)),
                        Column.of("size", sizes, "bytes", Digits(0)),
                    ),
                    "In the file:",
                ),
            ),
            notes=(f"Left out: {self.left_out}.",),
            warnings=self.notes,
        )

    def write(self, output: str, path: Path) -> None:
        """Write the bundle."""
        del output
        from pretravel.files import write_bundle

        write_bundle(path, self.texts)
