"""Compare the corrections of controls with a map: errors that they leave, and their report."""

from __future__ import annotations

from dataclasses import dataclass

import numpy.typing as npt

from pretravel.maps.pretravel_map import PretravelMap
from pretravel.measurement.comparison import Comparison, compare_corrections
from pretravel.show.document import Document
from pretravel.tasks.reports.comparison_report import comparison_document
from pretravel.tasks.reports.lobes_report import lobes_sentence


@dataclass(frozen=True, eq=False)
class ComparedMap:
    """Corrections compared with a map.

    Attributes
    ----------
    pretravel_map : PretravelMap
    comparison : Comparison
    """

    pretravel_map: PretravelMap
    comparison: Comparison

    def document(self, map_name: str = "") -> Document:
        """The report; `map_name` is that of the file."""
        return comparison_document(self.comparison, map_name=map_name)

    def sentence(self) -> str:
        """The result for a machinist: size of the lobes, and what corrections leave of them."""
        return lobes_sentence(self.pretravel_map, self.comparison)


def compare_map(
    pretravel_map: PretravelMap, part_normals: npt.ArrayLike | None = None
) -> ComparedMap:
    """Compare corrections with a map; parameters and errors as `compare_corrections`."""
    return ComparedMap(pretravel_map, compare_corrections(pretravel_map, part_normals))
