"""Search the best design for a wish: a file to a description and its report."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pretravel.base.whole_file import whole_file
from pretravel.show.document import Document
from pretravel.studies.described import found_description
from pretravel.studies.design_search import FoundDesign, find_design
from pretravel.studies.wish import load_wish
from pretravel.tasks.reports.design_report import design_document


@dataclass(frozen=True, eq=False)
class DesignedProbe:
    """The best design for a wish.

    Attributes
    ----------
    found : FoundDesign
    """

    found: FoundDesign

    def document(self) -> Document:
        """The report."""
        return design_document(self.found)

    def write(self, path: Path) -> None:
        """Write the description of the best design, which ``pretravel predict`` takes."""
        text = found_description(self.found)
        with whole_file(path) as temporary:
            temporary.write_text(text, encoding="utf-8")


def design_probe(wish: str) -> DesignedProbe:
    """Search the best design.

    Parameters
    ----------
    wish : str
        Name of a wish of the package, or path of one (.toml).

    Raises
    ------
    PretravelError
        See `pretravel.studies.design_search.find_design`.
    """
    return DesignedProbe(find_design(load_wish(wish)))
