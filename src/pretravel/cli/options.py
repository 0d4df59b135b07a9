"""Options that several commands share, worded once."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, TypeAlias

import typer

from pretravel.base.errors import PretravelError
from pretravel.cli.arguments import Angles, Vector, angles, one_of, polar_angles, unit_vector

if TYPE_CHECKING:
    from pretravel.base.frames import Placement


def _materials() -> Iterable[str]:
    from pretravel.prediction.materials import known_materials

    return sorted(known_materials())


def models() -> Iterable[str]:
    """Names of the compliance models, from the library's registry."""
    from pretravel.prediction.compliance import MODELS

    return MODELS


def _contact_models() -> Iterable[str]:
    from pretravel.prediction.compliance import MODELS
    from pretravel.prediction.compliance.base import compliance_model

    return [name for name in MODELS if compliance_model(name).has_response]


ProbeName: TypeAlias = Annotated[
    str, typer.Argument(help="Catalogue name, or path of a TOML description.")
]
Workpiece: TypeAlias = Annotated[
    str, typer.Option(parser=one_of(_materials), metavar="MATERIAL", help="Material of the part.")
]
ModelName: TypeAlias = Annotated[
    str,
    typer.Option(
        parser=one_of(models),
        metavar="MODEL",
        help="Model of the probe's compliance: analytic, fem, shen, ren or wozniak.",
    ),
]
ContactModel: TypeAlias = Annotated[
    str,
    typer.Option(
        parser=one_of(_contact_models),
        metavar="MODEL",
        help="Model of the probe's compliance: analytic, fem or shen.",
    ),
]
Gravity: TypeAlias = Annotated[
    Vector | None,
    typer.Option(
        parser=unit_vector,
        metavar="X,Y,Z",
        help="Direction of the weight in the machine's frame. Without it, weight is neglected.",
    ),
]
ProbeAxis: TypeAlias = Annotated[
    Vector,
    typer.Option(
        parser=unit_vector,
        metavar="X,Y,Z",
        help="Direction of the probe axis, from the tip to the spindle, in the machine's frame.",
    ),
]
Azimuths: TypeAlias = Annotated[
    Angles,
    typer.Option(
        parser=angles,
        metavar="ANGLES",
        help="Azimuths in the probe's frame, in degrees: start:stop:step, a list a,b,c, or one.",
    ),
]
Polars: TypeAlias = Annotated[
    Angles,
    typer.Option(
        parser=polar_angles,
        metavar="ANGLES",
        help="Polar angles in degrees: start:stop:step, a list a,b,c, or one; 90 is a vertical "
        "wall.",
    ),
]
Diameter: TypeAlias = Annotated[
    float,
    typer.Option(
        min=0.001, max=10000.0, help="Calibrated diameter of the sphere (or ring), in mm."
    ),
]
PictureFile: TypeAlias = Annotated[Path | None, typer.Option(help="Picture: .png, .svg or .pdf.")]
Verbose: TypeAlias = Annotated[
    bool, typer.Option("--verbose", help="Print the full report, not its key figures alone.")
]
Place: TypeAlias = Annotated[
    str | None,
    typer.Option(
        metavar="X,Y,Z,A,B,C",
        help="Placement of the part's frame in the machine: x,y,z in mm, then rotations about the "
        "machine's x, y and z axes in degrees, in that order. The probe is not rotated.",
    ),
]
Frame: TypeAlias = Annotated[
    Literal["part", "machine"], typer.Option(help="Frame of the touches with --place.")
]


def part_in_machine(place: str | None, frame: str) -> Placement:
    """The placement that --place and --frame state.

    Raises
    ------
    PretravelError
        Touches in the machine's frame without a placement of the part.
    """
    from pretravel.base.frames import Placement, parse_placement

    if place is not None:
        return parse_placement(place)
    if frame == "machine":
        raise PretravelError("--frame machine needs the placement of the part: --place x,y,z,a,b,c")
    return Placement()


Approach: TypeAlias = Annotated[
    Literal["normal", "file"],
    typer.Option(
        help="normal: against the surface normal; file: the columns ax,ay,az of the targets."
    ),
]
Units: TypeAlias = Literal["mm", "inch"]
