"""Features that are measured in one run, with what the drawing allows them, as TOML."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pretravel.base import (
    DISTANCE,
    STEP,
    InputError,
    PretravelError,
    TomlStructure,
    checked,
    read_toml,
)
from pretravel.drawing.features.extreme_association import check_criterion
from pretravel.drawing.features.measured_feature import BARE_SURFACE
from pretravel.drawing.tolerances.tolerance_frame import (
    POSITION,
    GeometricTolerance,
)


def face_name(faces: Sequence[int]) -> str:
    """The name of a feature that is called by its faces.

    >>> face_name([3]), face_name([3, 4])
    ('face3', 'face3,4')
    """
    return f"face{','.join(map(str, faces))}"


_WITHOUT_SIZE = ("plane", "line", BARE_SURFACE)


@dataclass(frozen=True)
class DrawnFeature:
    """One feature of a drawing; the words are those of the options of `pretravel measure`.

    Attributes
    ----------
    kind : str
        Empty: that of its faces, from the part.
    select : str
        Its points by label, with * and ?, or by number.
    label : str
        Its name; the faces or the selection when empty.
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
    geometric : tuple of GeometricTolerance
        Tolerances to datums, which are other features of the drawing.
    form_association : str or None
        By which the form is decided: minimum-zone or gaussian. None: that of the option.
    faces : tuple of int
        Its points by the faces on which they lie, as `pretravel faces` numbers them; instead of
        `select`.
    targets : tuple of (4,) float
        Of a datum: place (x, y, z) of each target and diameter of its area, 0 of a point. Only the
        touches there are those of the datum (ISO 5459). [mm]
    target_lines : tuple of (6,) float
        The same of lines: both ends of each. [mm]
    """

    kind: str = ""
    select: str = ""
    label: str = ""
    association: str | None = None
    axis: tuple[float, float, float] | None = None
    at: tuple[float, float, float] | None = None
    tolerance: str | None = None
    nominal: float | None = None
    position_tolerance: float | None = None
    form_tolerance: float | None = None
    geometric: tuple[GeometricTolerance, ...] = ()
    form_association: str | None = None
    faces: tuple[int, ...] = ()
    targets: tuple[tuple[float, float, float, float], ...] = ()
    target_lines: tuple[tuple[float, float, float, float, float, float], ...] = ()

    @property
    def name(self) -> str:
        """Its label, or what chooses its points."""
        return self.label or self.select or face_name(self.faces)

    @property
    def has_tolerances(self) -> bool:
        """Whether the drawing allows it anything."""
        stated = (self.tolerance, self.position_tolerance, self.form_tolerance)
        return bool(self.geometric) or any(each is not None for each in stated)

    def __post_init__(self) -> None:
        if bool(self.select) == bool(self.faces):
            raise PretravelError(
                f"feature '{self.label}' gives both faces and select: give one of them"
                if self.faces
                else f"feature '{self.label}' gives neither faces nor select: give the faces of "
                "its points (faces = [3]), or their labels"
            )
        if not self.kind and not self.faces:
            raise PretravelError(f"feature '{self.name}' needs its kind: plane, cylinder, bore, …")
        self._refuse_idle_keys()
        if any(number < 1 for number in self.faces):
            raise PretravelError(f"feature '{self.name}': faces are counted from 1")
        if self.association is not None and self.kind:
            try:
                check_criterion(self.association, self.kind)
            except PretravelError as error:  # of a key, not of an option
                raise PretravelError(str(error)) from None

    def _refuse_idle_keys(self) -> None:
        """Refuse what a feature of this kind, or with these tolerances, does not use."""
        if self.tolerance is not None and not isinstance(self.tolerance, str):
            raise PretravelError(
                f"the tolerance of '{self.name}' is a text such as '11.95..12.05', not "
                f"{self.tolerance!r:.40}"
            )
        if self.nominal is not None:
            checked(self.nominal, f"the nominal size of '{self.name}'", STEP)
        if self.kind in _WITHOUT_SIZE and (self.nominal, self.tolerance) != (None, None):
            raise PretravelError(
                f"feature '{self.name}' is a {self.kind}, which has no size: leave nominal_mm and "
                "tolerance out"
            )
        if self.form_association is not None and self.form_tolerance is None:
            raise PretravelError(
                f"feature '{self.name}' has a form_association, but no form_tolerance_mm that it "
                "would decide"
            )
        for *_, diameter in self.targets:
            checked(diameter, f"the diameter of a target of '{self.name}'", DISTANCE)


@dataclass(frozen=True)
class DrawnPattern:
    """Features that have a position together (ISO 5458): holes of one flange.

    Attributes
    ----------
    label : str
    features : tuple of str
        Their names.
    position_tolerance : float
        Diameter of each zone. [mm]
    datums : tuple of str
        As of `GeometricTolerance`; without them the pattern lies as it fits best.
    material : str
    between : pair of float or None
    instead_of, remark : str
        As of `GeometricTolerance`.
    """

    label: str
    features: tuple[str, ...]
    position_tolerance: float
    datums: tuple[str, ...] = ()
    material: str = ""
    between: tuple[float, float] | None = None
    instead_of: str = ""
    remark: str = ""

    @property
    def tolerance(self) -> GeometricTolerance:
        """Of the position of each feature."""
        return GeometricTolerance(
            POSITION, self.position_tolerance, self.datums, self.material,
            between=self.between, instead_of=self.instead_of, remark=self.remark,
        )  # fmt: skip

    def __post_init__(self) -> None:
        if len(set(self.features)) < max(len(self.features), 2):
            raise PretravelError("a pattern has two features or more, each once")
        _ = self.tolerance  # refused here, with the line


@dataclass(frozen=True)
class DrawnRelation:
    """A distance or an angle between two features, with its tolerance.

    Attributes
    ----------
    features : tuple of two str
        Their names.
    tolerance : str
        ``49.9..50.1``, or with a nominal value ``±0.1``; mm, or degrees of an angle.
    quantity : str
        distance or angle.
    nominal : float or None
        [mm or degrees]
    """

    features: tuple[str, str]
    tolerance: str
    quantity: str = "distance"
    nominal: float | None = None

    def __post_init__(self) -> None:
        if self.quantity not in ("distance", "angle"):
            raise PretravelError(
                f"features have a distance or an angle between them, not a {self.quantity}"
            )
        both: object = self.features
        if not isinstance(both, tuple | list) or len(both) != 2:
            raise PretravelError(f"a {self.quantity} is between two features")
        if self.features[0] == self.features[1]:
            raise PretravelError(
                f"a {self.quantity} is between two features; '{self.features[0]}' is given twice"
            )


@dataclass(frozen=True)
class NotDecided:
    """A tolerance of the drawing that is not decided here; the answer has a line for it.

    Attributes
    ----------
    feature, characteristic : str
        In words: ``face73``; ``straightness``.
    reason : str
        Why it is not decided.
    limits : str
        ``0..0.127``, in mm, or in degrees with ``°``; empty where the drawing states none.
    """

    feature: str
    characteristic: str
    reason: str
    limits: str = ""

    def __post_init__(self) -> None:
        _ = self.ends  # refused here, with the line

    @property
    def ends(self) -> tuple[float, float]:
        """The limits; not numbers where none are stated. [mm or degrees]"""
        if not self.limits:
            return math.nan, math.nan
        low, _, high = self.limits.removesuffix("°").partition("..")
        try:
            return (float(low) if low else -math.inf), (float(high) if high else math.inf)
        except ValueError:
            raise PretravelError(
                f"the limits '{self.limits}' are not two numbers as 0..0.1"
            ) from None


@dataclass(frozen=True)
class Drawing:
    """The features, patterns and relations of a drawing.

    Attributes
    ----------
    feature : tuple of DrawnFeature
    pattern : tuple of DrawnPattern
    between : tuple of DrawnRelation
    not_decided : tuple of NotDecided
    """

    feature: tuple[DrawnFeature, ...] = ()
    pattern: tuple[DrawnPattern, ...] = ()
    between: tuple[DrawnRelation, ...] = ()
    not_decided: tuple[NotDecided, ...] = ()

    def __post_init__(self) -> None:
        if not self.feature and not self.not_decided:
            raise PretravelError("no [[feature]]", inputs=("features",))
        names = self.names
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise PretravelError(
                f"two features are called '{twice}'; give a label for each", inputs=("features",)
            )
        wanted = [
            (f"pattern {each.label}", name) for each in self.pattern for name in each.features
        ]
        wanted += [("[[between]]", name) for each in self.between for name in each.features]
        for where, name in wanted:
            if name not in names:
                raise PretravelError(
                    f"{where}: there is no feature '{name}'; there are {', '.join(names)}",
                    inputs=("features",),
                )

    @property
    def names(self) -> list[str]:
        """Of the features, in order."""
        return [each.name for each in self.feature]


_STRUCTURE = TomlStructure(hint="docs/how-to/tolerances.md shows a whole file")
_STRUCTURE.table(
    DrawnFeature,
    at="at_mm",
    nominal="nominal_mm",
    position_tolerance="position_tolerance_mm",
    form_tolerance="form_tolerance_mm",
    targets="targets_mm",
    target_lines="target_lines_mm",
)
_STRUCTURE.table(GeometricTolerance, zone="tolerance_mm", offset="offset_mm", between="between_mm")
_STRUCTURE.table(DrawnPattern, position_tolerance="position_tolerance_mm", between="between_mm")


def read_features_file(path: str | Path) -> Drawing:
    r"""Read a file of features: one table ``[[feature]]`` for each.

    Tables ``[[feature.geometric]]`` are tolerances to datums, ``[[pattern]]`` positions of several
    features, ``[[between]]`` distances and angles, ``[[not_decided]]`` tolerances that have a line
    in the answer, and no verdict.

    Raises
    ------
    InputError
        No TOML, a key that is not known or a value of another type, with its line.
    PretravelError
        No feature, two of one name, or the name of a feature that there is not.

    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "features.toml"
    >>> text = '[[feature]]\nkind = "bore"\nselect = "bore1*"\nnominal_mm = 20.0\n'
    >>> read_features_file(path.write_text(text) and path).feature[0].nominal
    20.0
    """
    document = read_toml(path, "file of features")
    try:
        return _STRUCTURE.make(document, Drawing)
    except InputError:
        raise
    except PretravelError as error:
        if str(path) in str(error):
            raise
        raise PretravelError(f"{path}: {error}", inputs=error.inputs) from None
