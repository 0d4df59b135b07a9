"""Settings that tasks on described probes share."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, TypeAlias

from pretravel.task import (
    MODEL,
    Angles,
    Field,
    PolarAngles,
    UnitVector,
    When,
    existing,
    is_probe,
)


def _contact_models() -> Iterable[str]:
    from pretravel.prediction import MODELS, compliance_model

    models = {name: compliance_model(name) for name in MODELS}
    return [name for name, model in models.items() if model.has_response or model.response_for]


ProbeName: TypeAlias = Annotated[
    str,
    Field(
        help="Catalogue name, or a description (.toml).",
        positional=True,
        reads=existing,
        word=is_probe,
    ),
]
Workpiece: TypeAlias = Annotated[
    str,
    Field(
        help="Material of the part, from the package or from the probe's description.",
        metavar="MATERIAL",
        without=(When("model", ("shen",)),),
    ),
]
"""The model shen has no contact of tip and part."""
ModelName: TypeAlias = Annotated[str, MODEL]
ContactModel: TypeAlias = Annotated[
    str,
    Field(
        help="Model of the probe's compliance: analytic, fem or shen; wozniak for descriptions "
        "with a contact opening or a piezo stage.",
        names=_contact_models,
        metavar="MODEL",
    ),
]
Gravity: TypeAlias = Annotated[
    UnitVector | None,
    Field(
        help="Direction of gravity in the machine's frame (without it, weight is neglected).",
        metavar="X,Y,Z",
    ),
]
Azimuths: TypeAlias = Annotated[
    Angles,
    Field(
        help="Azimuths of the surface normal in the probe's frame, in degrees: start:stop:step, a "
        "list a,b,c, or one.",
        metavar="ANGLES",
    ),
]
Polars: TypeAlias = Annotated[
    PolarAngles,
    Field(
        help="Polar angles of the surface normal, in degrees: start:stop:step, a list a,b,c, or "
        "one; 90 is a vertical wall.",
        metavar="ANGLES",
    ),
]
