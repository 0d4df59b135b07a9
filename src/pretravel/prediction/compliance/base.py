"""The protocol of compliance models, and the choice of a model by its name."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import ClassVar

from pretravel.base import FloatArray, PretravelError, object_at
from pretravel.prediction.compliance import ELSEWHERE, MODELS
from pretravel.prediction.description import Probe
from pretravel.prediction.loading import Loading

TIP_ON_PART = "tip_on_part"
"""The one share that moves the tip into the part and not against the spindle."""


class ComplianceModel(ABC):
    """The displacement of the tip under given forces, share by share.

    Attributes
    ----------
    name : str
    has_response : bool
        Whether a `pretravel.six_seats.response.ProbeResponse` represents the model exactly: linear
        compliance, Hertz's law at the seats and at the tip.
    response_for : str
        For which descriptions one does, where not for all; see `condenses`.
    uses_lever_only : bool
        Whether the lever is the only length of the stylus that the model uses.
    """

    name: ClassVar[str]
    has_response: ClassVar[bool] = False
    response_for: ClassVar[str] = ""
    uses_lever_only: ClassVar[bool] = False

    def condenses(self, probe: Probe) -> bool:
        """Whether a `pretravel.six_seats.response.ProbeResponse` is exact for this probe."""
        return self.has_response and not probe.opening

    def contains_friction(self, probe: Probe) -> bool:
        """Whether forces and displacements contain friction at tip and seats in closed form."""
        del probe
        return False

    @abstractmethod
    def displacements(self, loading: Loading) -> Mapping[str, FloatArray]:
        """Displacement of the tip against the spindle, by compliance.

        Parameters
        ----------
        loading : Loading
            Forces on the tip in n directions.

        Returns
        -------
        mapping of str to (n, 3) float
            ``tip_on_part`` is the approach of tip centre and part. [mm]
        """


def compliance_model(model: str | ComplianceModel) -> ComplianceModel:
    """The compliance model of a name; a model is returned as it is.

    Raises
    ------
    PretravelError
        A name that is not known.

    >>> compliance_model("shen").has_response
    True
    """
    if isinstance(model, ComplianceModel):
        return model
    if model not in MODELS:
        raise PretravelError(
            f"model '{model}' is not known; there are {', '.join(sorted(MODELS))}",
            inputs=("model",),
        )
    # Imported by name, so that finite elements load only where they are used.
    module = ELSEWHERE.get(model, f"pretravel.prediction.compliance.{model}")
    chosen: ComplianceModel = object_at(f"{module}:MODEL")
    return chosen
