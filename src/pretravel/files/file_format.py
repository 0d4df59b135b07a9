"""What a file format is, what its files contain, and what the user must add to them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    ANGLE,
    COORDINATE,
    DISTANCE,
    REFERENCE_DIAMETER,
    TIP_RADIUS,
    FloatArray,
    InputError,
    Placement,
    PretravelError,
    check_numbers,
    checked_unit,
    checked_values,
    probe_rotation,
)
from pretravel.files.row_statements import RowStatement
from pretravel.files.source_file import UNITS, SourceFile
from pretravel.touches import Targets, Touches, word_fields

if TYPE_CHECKING:
    from pretravel.measurement import Points

NormalsFrom: TypeAlias = Callable[[FloatArray, tuple[str, ...] | None], FloatArray]
ALL = "all"
"""Chosen as the series: the parts and passes of a file are one series."""


@dataclass(frozen=True, eq=False)
class ReadingOptions:
    """What the user states about a file, because the file does not contain it.

    Attributes
    ----------
    plan : Targets or None
        The targets that were run, for files that contain positions only.
    units : str or None
        mm or inch, for files that do not state their unit.
    tip_radius : float or None
        For joining positions with the plan. [mm]
    overtravel : float or None
        Distance from the nominal surface to the end of each move: a position there is a miss. For
        joining positions with the plan, where the file does not mark the contacts. [mm]
    offset : (3,) float or None
        Origin of the work coordinates in the machine's coordinates, for grbl logs. [mm]
    radius_taken_off : float or None
        Radius that a DMIS file has subtracted from its points; 0 for tip centres. [mm]
    rotation : float or None
        Rotation of the work coordinates about the machine's z axis, for files of positions. [rad]
    columns : mapping of str to str, or None
        Of a table: the column of x, y, z, nx, ny, nz, ax, ay, az, feed, spindle, label,
        nominal_x …, by its name or its number from 1; with - before it, the numbers change their
        sign; none: the table has no such column. Columns that are not stated are found by their
        names.
    decimal : str or None
        Of a table: comma or point, where its numbers do not show it.
    exclude : tuple of str
        Touches to leave out, each by its label, its line, or file and line (``a.csv:17``).
    reference_diameter : float or None
        Diameter of the sphere or ring that was touched. A table that states no unit is then taken
        in mm, because the qualification compares the diameters; positions without normals have the
        normals of the sphere. [mm]
    ring : bool
        The reference is a ring.
    normal : (3,) float or None
        Outward normal of the surface at all touches, for files of positions alone: heights have
        0, 0, 1.
    join : str
        How positions are joined with the plan: ``line``, each lies on the line of its target;
        ``label``, each has the label of its target; ``feature``, each has the name of its feature,
        before the number of its label or alone.
    double_touches : str or None
        Where each place was touched twice, fast to find it and then slowly: ``last`` keeps the
        slow touch, ``all`` keeps both with their feeds.
    bores : tuple of str or None
        Features of a CMM's listing that were touched from inside, by their names with * and ?;
        empty: none. None: not stated.
    look_only : bool
        The file is only looked at: a table may lack its unit and its normals.
    normals_from : callable or None
        For positions without normals and without a plan: outward normals (n, 3) of a surface near
        given tip centres, (n, 3) in mm, with their labels or None.
    tip : str or None
        The tip whose touches are read, of a file with several.
    series : tuple of str
        Parts, passes or orientations whose touches are read; ``all``: those of all parts and
        series, which are one.
    pin : bool
        The ring is a pin, which is touched from outside.
    anywhere : bool
        Where the touches lie does not matter, as in a series of repeats: machine coordinates do.
    of_surface : bool
        Points of the surface are meant, which other software compensated, not tip centres.

    Raises
    ------
    PretravelError
        A word that is not known, a number outside its range.

    >>> ReadingOptions(units="inch").units
    'inch'
    """

    plan: Targets | None = None
    units: str | None = None
    tip_radius: float | None = None
    overtravel: float | None = None
    offset: tuple[float, float, float] | None = None
    radius_taken_off: float | None = None
    rotation: float | None = None
    columns: Mapping[str, str] | None = None
    decimal: str | None = None
    exclude: tuple[str, ...] = ()
    reference_diameter: float | None = None
    ring: bool = False
    normal: tuple[float, float, float] | None = None
    join: str = "line"
    double_touches: str | None = None
    bores: tuple[str, ...] | None = None
    look_only: bool = False
    normals_from: NormalsFrom | None = None
    tip: str | None = None
    series: tuple[str, ...] = ()
    pin: bool = False
    anywhere: bool = False
    of_surface: bool = False

    @property
    def moves_as_a_whole(self) -> bool:
        """Whether an offset of all positions changes nothing: repeats, a reference without plan."""
        on_reference = self.reference_diameter is not None or self.ring
        return self.anywhere or (on_reference and self.plan is None)

    def __post_init__(self) -> None:
        for name, value, known in (
            ("units", self.units, (None, *UNITS)),
            ("decimal", self.decimal, (None, "comma", "point")),
            ("join", self.join, ("line", "label", "feature")),
            ("double_touches", self.double_touches, (None, "last", "all")),
        ):
            if value not in known:
                words = " and ".join(str(word) for word in known if word)
                raise PretravelError(f"'{value}' is not known; there are {words}", inputs=(name,))
        if self.normal is not None:
            checked_unit([self.normal], "the normal")
        check_numbers(
            self,
            tip_radius=TIP_RADIUS,
            overtravel=DISTANCE,
            radius_taken_off=DISTANCE,
            rotation=ANGLE,
            reference_diameter=REFERENCE_DIAMETER,
        )
        if self.offset is not None:
            checked_values(self.offset, "the offset", COORDINATE)

    @property
    def completes_files(self) -> bool:
        """Whether a log can be read with this: always; its reader names what is missing."""
        return True


@dataclass(frozen=True, eq=False)
class FileReadings:
    """The touches of a file, and what else the file states.

    Attributes
    ----------
    touches : Touches
        The touches that made contact, in work coordinates where the file has work coordinates.
    missed : tuple of str
        Labels of the touches that made no contact.
    rotation : float
        Rotation of the work coordinates about the machine's z axis. [rad]
    warnings : tuple of str
        Sentences for the user.
    compensated : mapping of str to (3,) float
        Surface points that the control computed, by label. [mm]
    tip_radius : float or None
        Where the file states it. [mm]
    unfinished : str
        What is missing of the run that the file is the log of; empty where it is whole, or where
        the file does not say.
    normals_taken : bool
        The file has no normals: they are those of `ReadingOptions.normals_from`.
    frame : str
        Coordinate system and angles of rotary axes, where columns of a table give them.
    digests : tuple of str
        Of the touches of each file, where there are several.
    """

    touches: Touches
    missed: tuple[str, ...] = ()
    rotation: float = 0.0
    warnings: tuple[str, ...] = ()
    compensated: dict[str, FloatArray] = field(default_factory=dict)
    tip_radius: float | None = None
    unfinished: str = ""
    normals_taken: bool = False
    frame: str = ""
    digests: tuple[str, ...] = ()

    @property
    def placement(self) -> Placement:
        """Placement of the work coordinates in the machine: the rotation alone."""
        return Placement(rotation=probe_rotation(rotation=self.rotation))

    def in_machine_axes(self) -> FileReadings:
        """Return the same readings with directions along the machine's axes.

        A qualification needs them so: the probe is fixed to the machine, not to the work
        coordinates.
        """
        if not self.rotation:
            return self
        return replace(self, touches=self.touches.moved(self.placement), rotation=0.0)

    def notes(self) -> list[str]:
        """Return the warnings and the labels of the missed touches, as sentences."""
        return [*self.warnings, *missed_sentence(self.missed)]


def missed_sentence(missed: Sequence[str]) -> list[str]:
    """Return the labels of missed touches as a sentence; none where there are none.

    >>> missed_sentence(["3"])
    ['1 touch missed: 3']
    """
    if not missed:
        return []
    shown = ", ".join(missed[:10]) + ("…" if len(missed) > 10 else "")
    return [f"{len(missed)} touch{'es' if len(missed) > 1 else ''} missed: {shown}"]


def labels_or_numbers(labels: tuple[str, ...] | None, count: int) -> tuple[str, ...]:
    """Return the labels, or numbers from 1 where there are no labels.

    >>> labels_or_numbers(None, 2)
    ('1', '2')
    """
    return labels or tuple(str(row + 1) for row in range(count))


@dataclass(frozen=True, eq=False)
class FilePositions:
    """Positions of a file that does not state which targets they belong to.

    Attributes
    ----------
    path : str
    positions : (n, 3) float
        Tip centres at the trigger. [mm]
    lines : tuple of int
        Line of the file that each position comes from.
    contact : tuple of bool or None
        Whether each position is a contact, where the file states it.
    labels : tuple of str or None
    feeds : (n,) float or None
        [mm/min]
    spindle : (n,) float or None
        Orientations of the spindle. [rad]
    understood : str
        How a table was understood, in one line.
    nominal_points : (n, 3) float or None
        [mm]
    approaches : (n, 3) float or None
    axes : tuple of str or None
        Letters of the axes that moved to each position; empty where the file does not state it.
    words : mapping of str to tuple of str
        Of each position, by column: tip, part, pass, orientation.
    warnings : tuple of str
    lacks : tuple of str
        What a file that is looked at does not state.
    frame : str
        As of `FileReadings`.
    """

    path: str
    positions: FloatArray
    lines: tuple[int, ...]
    contact: tuple[bool, ...] | None = None
    labels: tuple[str, ...] | None = None
    feeds: FloatArray | None = None
    spindle: FloatArray | None = None
    understood: str = ""
    nominal_points: FloatArray | None = None
    approaches: FloatArray | None = None
    axes: tuple[str, ...] | None = None
    words: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()
    lacks: tuple[str, ...] = ()
    frame: str = ""

    def take(self, rows: npt.ArrayLike) -> FilePositions:
        """The positions of the given rows (indices or a mask), in that order.

        >>> FilePositions("a.log", np.eye(3), (1, 2, 3), labels=("a", "b", "c")).take([2]).labels
        ('c',)
        """
        index = np.arange(len(self.positions))[np.asarray(rows)]

        def of(values: FloatArray | None) -> FloatArray | None:
            return None if values is None else values[index]

        return replace(
            self,
            positions=self.positions[index],
            lines=tuple(self.lines[i] for i in index),
            contact=None if self.contact is None else tuple(self.contact[i] for i in index),
            labels=None if self.labels is None else tuple(self.labels[i] for i in index),
            feeds=of(self.feeds),
            spindle=of(self.spindle),
            nominal_points=of(self.nominal_points),
            approaches=of(self.approaches),
            axes=None if self.axes is None else tuple(self.axes[i] for i in index),
            words={name: tuple(each[i] for i in index) for name, each in self.words.items()},
        )

    def touches(self, normals: FloatArray) -> Touches:
        """The positions as touches with normals (n, 3), and all that the file states of them.

        Raises
        ------
        PretravelError
            As `Touches`.
        """
        return Touches(
            self.positions,
            normals,
            approaches=self.approaches,
            feeds=self.feeds,
            spindle=self.spindle,
            labels=self.labels,
            nominal_points=self.nominal_points,
            source=self.path.replace("\\", "/").rpartition("/")[2],
            lines=self.lines,
            reading=self.understood,
            **word_fields(self.words),
        )

    def misses(self) -> tuple[str, ...]:
        """Names of the positions that are not contacts, where the file states it."""
        named = labels_or_numbers(self.labels, len(self.positions))
        contact = self.contact or (True,) * len(self.positions)
        return tuple(name for name, on in zip(named, contact, strict=True) if not on)

    def error(self, message: str, row: int, *, inputs: tuple[str, ...] = ()) -> InputError:
        """An error that names the file and the line of a position."""
        return InputError(message, path=self.path, line=self.lines[row], inputs=inputs)


@dataclass(frozen=True)
class FeatureResult:
    """One result of a measuring cycle: one quantity of one feature.

    Lengths are in mm, angles in degrees. The feature is a number or a name; a component of 0 is
    not stated.
    """

    component: int
    feature: int | str
    quantity: str
    nominal: float
    actual: float
    deviation: float
    tolerance: float | None
    line: int


ReadingsParser: TypeAlias = Callable[[SourceFile, ReadingOptions], FileReadings | FilePositions]
FeaturesParser: TypeAlias = Callable[[SourceFile, ReadingOptions], list[FeatureResult]]
TouchesWriter: TypeAlias = Callable[[Path, Touches, float | None], None]


@dataclass(frozen=True, eq=False)
class PointsOrigin:
    """What a file of points can state beyond the points.

    Attributes
    ----------
    note : str
        How the points were made.
    nominal_points : (n, 3) float or None
        The targets of the touches on the nominal surface. [mm]
    tip_radius : float or None
        Of the map. [mm]
    """

    note: str = ""
    nominal_points: FloatArray | None = None
    tip_radius: float | None = None


PointsWriter: TypeAlias = Callable[[Path, "Points", PointsOrigin], None]


@dataclass(frozen=True)
class FileFormat:
    """One file format: how its files are recognised, read and written.

    A new format is one such object in a file of its own, and one line in `FORMATS`; a format of
    another package is one line in the group of entry points ``pretravel.formats``.

    Attributes
    ----------
    name : str
        The word for it on the command line.
    what : str
        What the format is, in a few words.
    reads, writes : str
        What is read from and written to its files; empty where nothing is.
    needs : str
        What the files do not state and the user must.
    takes : tuple of str
        Which of the options offset, radius_taken_off and bores the reader uses.
    own_unit : str
        mm, where every file is in millimetres; empty, where the user can give the unit, or the
        reader compares it with that of the file.
    verified : str
        What reading and writing were verified against.
    endings : tuple of str
        Endings of the files that are written, with the dot. A binary format is recognised by them.
    binary : bool
        The files are not text.
    begins : tuple of bytes
        First bytes of a binary format whose ending other files have too; any where it is empty.
    recognises : function of the lines (stripped, none blank), or None
        Whether a text file has this format.
    by_shape : bool
        Its files have no words of their own: other formats, and tables with a header, are tried
        before it.
    parse : function of SourceFile and ReadingOptions, or None
        Reads touches or positions.
    parse_features : function of SourceFile and ReadingOptions, or None
        Reads results of features, from which no touches can be made.
    self_contained : bool
        The files state everything that touches need.
    write_touches : function of path, Touches and the tip's radius or None, or None
    write_points : function of path, Points and PointsOrigin, or None
    keeps_approaches_and_feeds : bool
        Written touches keep their approaches and feeds.
    refusal : str
        Why no readings can be made of such files, and what to do instead; empty where they are
        read.
    statements : tuple of RowStatement
        Lines among its rows that contain no reading, and what each does.
    columns : tuple of RowStatement
        Columns of a table, and what each does.
    other_lines : str
        What is done with all other lines: ``refused``, ``named`` or, where it has no lines, empty.
    """

    name: str
    what: str
    reads: str = ""
    writes: str = ""
    needs: str = ""
    takes: tuple[str, ...] = ()
    own_unit: str = ""
    verified: str = ""
    endings: tuple[str, ...] = ()
    binary: bool = False
    begins: tuple[bytes, ...] = ()
    recognises: Callable[[list[str]], bool] | None = None
    by_shape: bool = False
    parse: ReadingsParser | None = None
    parse_features: FeaturesParser | None = None
    self_contained: bool = False
    write_touches: TouchesWriter | None = None
    write_points: PointsWriter | None = None
    keeps_approaches_and_feeds: bool = False
    refusal: str = ""
    statements: tuple[RowStatement, ...] = ()
    columns: tuple[RowStatement, ...] = ()
    other_lines: str = ""

    @property
    def marks_no_misses(self) -> bool:
        """Whether it is of software that subtracts the radius: CMMs, which fill misses with 0."""
        return "radius_taken_off" in self.takes

    def refuse_unused(self, file: SourceFile, options: ReadingOptions) -> None:
        """Refuse what is stated of a file and its reader does not use.

        Raises
        ------
        InputError
        """
        for name in ("offset", "radius_taken_off", "bores", "decimal"):
            if getattr(options, name) is not None and name not in self.takes:
                raise file.error(
                    f"{name.replace('_', ' ')} is not used for a file of format {self.name}; "
                    "leave it out",
                    inputs=(name,),
                )
        if self.own_unit:
            refuse_contradicted_unit(file, self.own_unit, options.units)


def refuse_contradicted_unit(
    file: SourceFile, own: str, given: str | None, line: int | None = None
) -> None:
    """Refuse a unit that is given for a file of the other system: mm for inches, or the reverse.

    Parameters
    ----------
    file : SourceFile
    own : str
        That the file has, one of `LENGTH_UNITS`.
    given : str, optional
        mm or inch.
    line : int, optional
        Where the file states it.
    """
    inches = own in ("inch", "thou")
    if given is not None and inches != (given == "inch"):
        raise file.error(
            f"the lengths of the file are in {own}, not in {given}; leave the unit out",
            line,
            inputs=("units",),
        )
