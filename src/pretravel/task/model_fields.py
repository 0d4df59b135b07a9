"""Settings of tasks that touch surfaces with a model of a probe, or with its map."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal, TypeAlias

from pretravel.base import REFERENCE_DIAMETER
from pretravel.task.task import Field, When
from pretravel.task.values import Vector


def models() -> Iterable[str]:
    """Names of the compliance models."""
    from pretravel.prediction import MODELS

    return MODELS


def is_map(value: object) -> bool:
    """Whether an argument names the file of a map, not a probe.

    >>> is_map("map.json"), is_map("omp40-2")
    (True, False)
    """
    from pretravel.files import FORMER_MAP_ENDINGS, MAP_ENDINGS

    return Path(str(value)).suffix.lower() in (*MAP_ENDINGS, *FORMER_MAP_ENDINGS)


def surface_files(specification: str) -> list[Path]:
    """The file of a surface such as ``part.step#3``; none for ``plane:…``."""
    from pretravel.surface import source_file

    return [Path(name) for name in source_file(specification)]


def is_probe(text: str) -> bool:
    """Whether a text is the name of a probe of the catalogue."""
    from pretravel.prediction import catalogue_names

    return text in catalogue_names()


def is_shape(text: str) -> bool:
    """Whether a text is a shape, ``plane:polar=40``."""
    from pretravel.surface import is_shape as shape

    return shape(text)


SphereDiameter: TypeAlias = Annotated[
    float, Field(help="Diameter of the sphere, in mm.", range=REFERENCE_DIAMETER)
]
SphereCenter: TypeAlias = Annotated[
    Vector,
    Field(help="Centre of the sphere in the machine's frame, in mm.", metavar="X,Y,Z"),
]
StartClearance: TypeAlias = Annotated[
    float,
    Field(
        help="Distance of tip and sphere where a touch starts, in mm.",
        range=(0.0, 10000.0),
        unit="mm",
    ),
]
QuantityWord: TypeAlias = Literal["pretravel", "sensing_distance", "trigger_force"]
ShownQuantity: TypeAlias = Annotated[
    QuantityWord,
    Field(
        help="Quantity that the summary and the pictures show (the pictures always show the force "
        "as well). The sensing distance is the deflection across the axis (Rodrigues 2021).",
        label="Quantity of the pictures",
        words={
            "pretravel": "pretravel",
            "sensing_distance": "sensing distance",
            "trigger_force": "trigger force",
        },
    ),
]
MODEL = Field(
    help="Model of the probe's compliance: analytic, fem, shen, ren or wozniak.",
    label="Model of the probe, without a map",
    names=models,
    metavar="MODEL",
)
ModelOfMap: TypeAlias = Annotated[
    str,
    replace(
        MODEL,
        help="Model of the compliance, where a probe is given and not a map: analytic, fem, "
        "shen, ren or wozniak.",
        without=(When("map_file", is_so=is_map, what="a map"),),
    ),
]
"""Where a probe takes the place of a map."""
Approach: TypeAlias = Annotated[
    Literal["normal", "file"] | None,
    Field(
        help="Direction of approach: against the surface normal (the default), or as the columns "
        "ax,ay,az in the file of targets give it. Where these are oblique, one must be chosen.",
        words={
            "": "Usual: against the normal",
            "normal": "Against the normal",
            "file": "As in the file",
        },
    ),
]
