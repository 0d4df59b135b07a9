"""Compare two designs of a probe: two descriptions, from files or the catalogue, to a report."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pretravel.base import grid
from pretravel.design.tasks.compare.designs_report import design_comparison_document
from pretravel.prediction import Probe, Trigger, load_probe, predict
from pretravel.show import Document
from pretravel.task import QuantityWord

_POLAR = np.radians(np.arange(0.0, 91.0, 5.0))
_AZIMUTH = np.radians(np.arange(0.0, 360.0, 5.0))


@dataclass(frozen=True, eq=False)
class DesignComparison:
    """Two designs and what is predicted of them.

    Attributes
    ----------
    probes : two Probes
    triggers : two Triggers
        In the same directions, every 5°.
    """

    probes: tuple[Probe, Probe]
    triggers: tuple[Trigger, Trigger]

    def document(self, names: tuple[str, str], quantity: QuantityWord = "pretravel") -> Document:
        """The report.

        Parameters
        ----------
        names : two str
            Of the files or in the catalogue.
        quantity : str
            Of the verdict and the pictures: pretravel, sensing_distance or trigger_force.
        """
        return design_comparison_document(self.probes, self.triggers, names, quantity)


def compare_designs(
    first: str | Probe, second: str | Probe, model: str = "analytic"
) -> DesignComparison:
    """Predict two designs in the same directions of the upper half.

    Parameters
    ----------
    first, second : str or Probe
        Catalogue name, path of a description, or the description itself.
    model : str
        See `pretravel.prediction.compliance.MODELS`.

    Raises
    ------
    PretravelError
        A description that is wrong, or a probe that does not trigger in a direction.

    >>> result = compare_designs("omp40-2", "omp40-2-100mm")
    >>> bool(result.triggers[1].pretravel.mean() > result.triggers[0].pretravel.mean())
    True
    """
    directions = grid(_POLAR, _AZIMUTH)
    a, b = (probe if isinstance(probe, Probe) else load_probe(probe) for probe in (first, second))
    return DesignComparison((a, b), (predict(a, directions, model), predict(b, directions, model)))
