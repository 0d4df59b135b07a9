"""Features that are measured in one run, with what the drawing allows them, as TOML."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pretravel.base.errors import PretravelError
from pretravel.base.toml_file import TomlStructure, read_toml
from pretravel.measurement.extreme_association import check_criterion


@dataclass(frozen=True)
class DrawnFeature:
    """One feature of a drawing; the words are those of the options of `pretravel measure`.

    Attributes
    ----------
    kind : str
    select : str
        Its points by label, with * and ?, or by number.
    label : str
        Its name; the selection when empty.
    association : str or None
        gaussian, minimum-zone, inscribed, circumscribed or tangent. None: that of the option.
    axis, at : tuple of float or None
        Axis, and nominal position in mm.
    tolerance : str or None
        Of the diameter: ``20..20.021``, or with a nominal diameter ``+0.021/0``.
    nominal : float or None
        Diameter. [mm]
    position_tolerance, form_tolerance : float or None
        [mm]
    """

    kind: str
    select: str
    label: str = ""
    association: str | None = None
    axis: tuple[float, float, float] | None = None
    at: tuple[float, float, float] | None = None
    tolerance: str | None = None
    nominal: float | None = None
    position_tolerance: float | None = None
    form_tolerance: float | None = None

    def __post_init__(self) -> None:
        if self.association is not None:
            try:
                check_criterion(self.association, self.kind)
            except PretravelError as error:  # of a key, not of an option
                raise PretravelError(str(error)) from None


@dataclass(frozen=True)
class _Drawing:
    feature: list[DrawnFeature]


_STRUCTURE = TomlStructure(hint="docs/how-to/align-a-part.md shows a whole file")
_STRUCTURE.table(
    DrawnFeature,
    at="at_mm",
    nominal="nominal_mm",
    position_tolerance="position_tolerance_mm",
    form_tolerance="form_tolerance_mm",
)


def read_features(path: str | Path) -> list[DrawnFeature]:
    r"""Read the features of a drawing: one table ``[[feature]]`` for each.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    list of DrawnFeature

    Raises
    ------
    InputError
        No TOML, a key that is not known or a value of another type, with its line.
    PretravelError
        No feature, or two of one name.

    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "features.toml"
    >>> text = '[[feature]]\nkind = "bore"\nselect = "bore1*"\nnominal_mm = 20.0\n'
    >>> read_features(path.write_text(text) and path)[0].nominal
    20.0
    """
    found = _STRUCTURE.make(read_toml(path, "file of features"), _Drawing).feature
    if not found:
        raise PretravelError(f"{path}: no [[feature]]", inputs=("features",))
    names = [each.label or each.select for each in found]
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise PretravelError(
            f"{path}: two features are called '{twice}'; state a label for each",
            inputs=("features",),
        )
    return found
