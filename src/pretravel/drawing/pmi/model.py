"""A model with its faces and its PMI: what `pretravel drawing` reads."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pretravel.base import InputError
from pretravel.drawing.pmi.drawn import DrawnPmi, drawn_pmi, skeleton
from pretravel.drawing.pmi.items import Pmi
from pretravel.drawing.pmi.model_faces import ModelFace, model_faces, numbers_of_faces
from pretravel.drawing.pmi.nominal import targets_on_planes
from pretravel.drawing.pmi.part21 import read_part21
from pretravel.drawing.pmi.reading import read_pmi
from pretravel.drawing.pmi.text import ItemLine, features_text, item_lines
from pretravel.drawing.tolerances.features_file import Drawing, read_features_file
from pretravel.surface import Part, read_part


@dataclass(frozen=True, eq=False)
class ModelDrawing:
    """The drawing that a model carries.

    Attributes
    ----------
    part : Part
    pmi : Pmi
    faces : mapping of int to ModelFace
    numbers : mapping of int to int
        Of the faces, as `pretravel faces` lists them.
    drawn : DrawnPmi
    """

    part: Part
    pmi: Pmi
    faces: dict[int, ModelFace]
    numbers: dict[int, int]
    drawn: DrawnPmi

    @property
    def has_pmi(self) -> bool:
        """Whether the text states any PMI, understood or not."""
        pmi = self.pmi
        return bool(pmi.datums or pmi.sizes or pmi.tolerances or pmi.unread)

    @property
    def lines(self) -> list[ItemLine]:
        """One for each datum, target, size and tolerance."""
        return item_lines(self.pmi, self.numbers, self.drawn.left_out)

    @property
    def text(self) -> str:
        """The file of features."""
        more = ""
        if not self.has_pmi:
            more = (
                "# The model has no semantic PMI. These are its bores, bosses and spheres: "
                "give the\n# tolerances, and delete what is not measured.\n"
            )
        return features_text(self.part.name, self.pmi, self.drawn, self.numbers, more)


def read_model_drawing(path: str | Path) -> ModelDrawing:
    """Read the drawing that a STEP file carries; of one without PMI, what can carry a size.

    Raises
    ------
    InputError
        No STEP file, or one without faces.
    """
    part21 = read_part21(path)
    part = read_part(path)
    faces = model_faces(part21)
    numbers = numbers_of_faces(faces, part)
    pmi = targets_on_planes(read_pmi(part21), faces)
    found = ModelDrawing(part, pmi, faces, numbers, drawn_pmi(pmi, faces, numbers))
    if found.has_pmi:
        return found
    by_number = {face.number: face for face in part.faces}
    turns = {}
    for own, number in numbers.items():
        low, high = by_number[number].box
        turns[own] = float(high[0] - low[0])
    return ModelDrawing(part, pmi, faces, numbers, skeleton(faces, numbers, turns))


_STEP = (".step", ".stp", ".p21")


def read_drawing(path: str | Path) -> Drawing:
    r"""Read the features of a drawing, of a file of features or of a model that carries them.

    Parameters
    ----------
    path : str or Path
        TOML, or a STEP file (AP242), read as `pretravel drawing` writes it.

    Returns
    -------
    Drawing

    Raises
    ------
    InputError
        What `read_features_file` refuses; a STEP file without semantic PMI.

    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "features.toml"
    >>> text = '[[feature]]\nkind = "bore"\nselect = "bore1*"\nnominal_mm = 20.0\n'
    >>> read_drawing(path.write_text(text) and path).feature[0].nominal
    20.0
    """
    if Path(path).suffix.lower() not in _STEP:
        return read_features_file(path)
    model = read_model_drawing(path)
    if not model.has_pmi:
        raise InputError(
            "states no tolerances: it has no semantic PMI (AP242). `pretravel drawing` writes its "
            "features to fill in: give that file",
            path=path,
        )
    return model.drawn.drawing
