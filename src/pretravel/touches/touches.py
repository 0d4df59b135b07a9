"""Touches as a machine reports them, measured or simulated."""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeAlias, Union

import numpy as np
import numpy.typing as npt

from pretravel.base import (
    ANGLE,
    COORDINATE,
    FEED,
    FloatArray,
    IntArray,
    Placement,
    PretravelError,
    RowError,
    ShownInNotebooks,
    WithDataFrame,
    WithPlot,
    as_numbers,
    checked,
    checked_unit,
    checked_values,
    delay_travel,
    describe,
    extent,
    from_file,
    frozen,
)

FEWEST_REPEATS = 5
"""Touches of one point: the first can be apart; level, drift and noise of the others need four."""

TouchesLike: TypeAlias = Union["Touches", npt.ArrayLike, str, Path]
"""What functions take in the place of touches, see `as_touches`."""

WORD_COLUMNS = {
    "reference": "references",
    "tip": "tips",
    "part": "parts",
    "pass": "passes",
    "orientation": "orientations",
}
"""Columns of words, and the attribute of `Touches` that each is."""
_ONE_EACH = {
    "tip": ("tips", "a map is that of one tip: choose one of them", ("tip",)),
    "part": (
        "parts or series",
        "they would be used as one: choose one of them, or all, if they are the same",
        ("series",),
    ),
    "pass": (
        "passes, which differ by feed × delay",
        "no feed is given: choose one of them, such as the slow touches",
        ("double_touches", "series"),
    ),
    "orientation": (
        "orientations of the probe",
        "a map holds for one orientation: choose one of them",
        ("series",),
    ),
    "reference": (
        "references (column reference)",
        "one sphere or ring is meant: describe each reference, or split the file",
        ("reference",),
    ),
}
"""Columns in which one is meant: how several are called, why that is not a series, what chooses."""
_SHOWN = 4
"""Most names that a message shows."""
_SAME_POINT = 0.02
"""A point of one part that is touched again lies closer to where it was. [mm]"""

GLANCING = 0.05
"""Smallest cosine between an approach and the inward normal, which are then 87° apart."""


def glancing_rows(approaches: FloatArray, normals: FloatArray) -> IntArray:
    """Rows in which the approach moves away from the surface or along it.

    Parameters
    ----------
    approaches, normals : (n, 3) float
        Unit vectors; the normals point out of the part.

    Returns
    -------
    (k,) int

    >>> glancing_rows(np.array([[0.0, 0.0, -1.0], [1.0, 0.0, 0.0]]), np.eye(3)[[2, 2]]).tolist()
    [1]
    """
    return np.flatnonzero(-np.sum(approaches * normals, axis=1) < GLANCING)


def as_touches(
    given: TouchesLike, *, reference_diameter: float | None = None, ring: bool = False
) -> Touches:
    """The touches that are meant: touches, a file of them, or an array with normals.

    Parameters
    ----------
    given : Touches, str, Path or (n, 6) float
        An array has x, y, z of the tip centre in mm and the outward normal. The columns of a data
        frame (pandas, polars, Arrow) go by their names and units, as those of a file do.
    reference_diameter : float, optional
        Of a reference that was touched, for a file. [mm]
    ring : bool
        The reference is a ring.

    Raises
    ------
    PretravelError
        Something else; as the reader of the file.

    >>> as_touches([[0.0, 0.0, 3.0, 0.0, 0.0, 1.0]]).normals.tolist()
    [[0.0, 0.0, 1.0]]
    >>> as_touches([[0.0, 0.0, 3.0]])
    Traceback (most recent call last):
    ...
    pretravel.base.errors.PretravelError: touches need a normal for each position: \
Touches(positions, normals), or an array (n, 6) of x, y, z, nx, ny, nz; this one is (1, 3)
    """
    if isinstance(given, Touches):
        return given
    if hasattr(given, "collect"):
        raise PretravelError("a lazy frame has no rows yet: collect it")
    if isinstance(given, str | Path) or hasattr(given, "columns"):
        stated = {"reference_diameter": reference_diameter, "ring": ring}
        found = from_file("touches", given, **stated)
        assert isinstance(found, Touches)
        return found
    try:
        values = as_numbers(given, "touches")
    except PretravelError:
        values = np.empty(0)
    if values.ndim == 2 and values.shape[1] == 6:
        return Touches(values[:, :3], values[:, 3:])
    if values.ndim and values.size:
        raise PretravelError(
            "touches need a normal for each position: Touches(positions, normals), or an array "
            f"(n, 6) of x, y, z, nx, ny, nz; this one is {values.shape}"
        )
    raise PretravelError(
        f"expected touches, not a {type(given).__name__}: read_touches makes them of a file, "
        "Touches(positions, normals) of arrays"
    )


def refuse_glancing(
    approaches: FloatArray, normals: FloatArray, where: Callable[[int], str]
) -> None:
    """Refuse approaches that move away from the surface or along it.

    Parameters
    ----------
    approaches, normals : (n, 3) float
        Unit vectors; the normals point out of the part.
    where : callable
        Returns the name of a row, for the message.
    """
    rows = glancing_rows(approaches, normals)
    if len(rows):
        row = int(rows[0])
        along = float(np.sum(approaches[row] * normals[row]))
        problem = (
            "the approach moves away from the surface or along it "
            f"(approach · normal = {along:+.3f}, it must be below -{GLANCING}); "
            f"the normal ({describe(normals[row])}) must point out of the part, "
            "the approach into it"
        )
        raise RowError(f"{where(row)}: {problem}", row, in_file=problem)


@dataclass(frozen=True, eq=False)
class Touches(ShownInNotebooks, WithPlot, WithDataFrame):
    """Touches in the machine's frame; a row is a touch.

    Parameters
    ----------
    positions : (n, 3) float
        Spindle points P at the latched trigger: the tip centre of an undeflected
        stylus. [mm]
    normals : (n, 3) float
        Outward unit normals of the part at the targets.
    approaches : (n, 3) float, optional
        Unit directions in which the spindle moved; -normals when not given.
    feeds : (n,) float, optional
        Feed rates. [mm/min]
    labels : n strings, optional
    nominal_points : (n, 3) float, optional
        Target points on the nominal surface. [mm]
    source : str, optional
        Name of the file or simulation, for messages.
    lines : n ints, optional
        Line numbers in that file.
    spindle : (n,) float, optional
        Orientations of the spindle, counter-clockwise about the probe's +z. [rad]
    reading : str, optional
        How a file of another form than this package's own was understood, in one line.
    numbered_from : int, optional
        Number of the first touch, where these are a part of a longer series.
    references : n strings, optional
        What each touch was made on, where there are several references: ``block@90``.
    tips : n strings, optional
        The tip that touched, of a star stylus or among several tools.
    parts : n strings, optional
        The part, set or series of each touch, where the file has several.
    passes : n strings, optional
        The pass: ``fast`` and ``slow``, where each place was touched twice.
    orientations : n strings, optional
        The orientation of the probe's head, as the file calls it.

    Raises
    ------
    PretravelError
        The shapes do not agree, values are not finite, normals or approaches are not
        unit vectors, or approaches move away from the part.

    >>> touch = Touches([[0.0, 0.0, 3.0]], [[0.0, 0.0, 1.0]])
    >>> touch.approaches.tolist()
    [[-0.0, -0.0, -1.0]]
    """

    positions: FloatArray
    normals: FloatArray
    approaches: FloatArray | None = None
    feeds: FloatArray | None = None
    labels: tuple[str, ...] | None = None
    nominal_points: FloatArray | None = None
    source: str | None = None
    lines: tuple[int, ...] | None = None
    reading: str = ""
    spindle: FloatArray | None = None
    numbered_from: int = 1
    references: tuple[str, ...] | None = None
    tips: tuple[str, ...] | None = None
    parts: tuple[str, ...] | None = None
    passes: tuple[str, ...] | None = None
    orientations: tuple[str, ...] | None = None

    def __repr__(self) -> str:
        where = "; ".join(f"{axis} {extent(self.positions[:, i])}" for i, axis in enumerate("xyz"))
        feeds = "" if self.feeds is None else f"; feed {extent(self.feeds, 0)} mm/min"
        source = f"; from {self.source}" if self.source else ""
        return f"Touches({len(self):,} touches; {where} mm{feeds}{source})"

    def __post_init__(self) -> None:
        positions = as_numbers(self.positions, "touch positions")
        if positions.ndim != 2 or positions.shape[1] != 3:
            raise PretravelError(
                f"touch positions: expected an array of shape (n, 3), got {positions.shape}"
            )
        count = len(positions)
        if count == 0:
            raise PretravelError("there are no touches")
        normals = checked_unit(self.normals, "touch normals")
        approaches = (
            -normals
            if self.approaches is None
            else checked_unit(self.approaches, "touch approaches")
        )
        for name, rows in (
            ("normals", len(normals)),
            ("approaches", len(approaches)),
            ("feeds", count if self.feeds is None else len(self.feeds)),
            ("labels", count if self.labels is None else len(self.labels)),
            ("lines", count if self.lines is None else len(self.lines)),
            ("spindle orientations", count if self.spindle is None else len(self.spindle)),
            ("nominal points", count if self.nominal_points is None else len(self.nominal_points)),
            *((attribute, len(words)) for attribute, words in self._words()),
        ):
            if rows != count:
                raise PretravelError(f"{count} touches, but {rows} {name}")
        _refuse_far(positions, self.where, "position")
        refuse_glancing(approaches, normals, self.where)
        object.__setattr__(self, "positions", frozen(positions))
        object.__setattr__(self, "normals", frozen(normals))
        object.__setattr__(self, "approaches", frozen(approaches))
        if self.feeds is not None:
            feeds = as_numbers(self.feeds, "touch feeds")
            bad = np.flatnonzero(~((feeds >= FEED.lowest) & (feeds <= FEED.highest)))
            if len(bad):
                row = int(bad[0])
                problem = (
                    f"the feed is {feeds[row]:g} mm/min; it must lie between {FEED.lowest:g} and "
                    f"{FEED.highest:g} mm/min. Is it in m/min?"
                )
                raise RowError(f"{self.where(row)}: {problem}", row, in_file=problem)
            object.__setattr__(self, "feeds", frozen(self.feeds))
        if self.spindle is not None:
            object.__setattr__(
                self, "spindle", frozen(checked_values(self.spindle, "the spindle's angle", ANGLE))
            )
        if self.nominal_points is not None:
            nominal = as_numbers(self.nominal_points, "nominal points")
            _refuse_far(nominal, self.where, "nominal point")
            object.__setattr__(self, "nominal_points", frozen(nominal))

    def __len__(self) -> int:
        return len(self.positions)

    def _words(self) -> list[tuple[str, tuple[str, ...]]]:
        """Attributes of words that the touches have."""
        every = [(attribute, getattr(self, attribute)) for attribute in WORD_COLUMNS.values()]
        return [(attribute, words) for attribute, words in every if words is not None]

    @property
    def words(self) -> dict[str, tuple[str, ...]]:
        """The words of each touch by the name of their column, those that the touches have.

        >>> Touches([[0, 0, 1]], [[0, 0, 1]], tips=("front",)).words
        {'tip': ('front',)}
        """
        found = dict(self._words())
        return {name: found[each] for name, each in WORD_COLUMNS.items() if each in found}

    @property
    def digest(self) -> str:
        """Twelve digits that identify the touches by their positions: no two runs have the same.

        >>> Touches([[1.0, 0.0, 0.0]], [[1.0, 0.0, 0.0]]).digest
        '725c4777db32'
        """
        # Nanometres: what the last digits of a file leave out does not count.
        return hashlib.sha256((np.round(self.positions, 6) + 0.0).tobytes()).hexdigest()[:12]

    @property
    def approach_directions(self) -> FloatArray:
        """The approaches, (n, 3)."""
        assert self.approaches is not None  # set in __post_init__
        return self.approaches

    def closing(self, normals: FloatArray | None = None) -> FloatArray:
        """Cosine between the approaches and the inward normals, (n,); their own if not given."""
        outward = self.normals if normals is None else normals
        return np.asarray(-np.sum(self.approach_directions * outward, axis=1))

    def where(self, row: int) -> str:
        """The name of a touch in messages: number, label, and line of the file.

        A label that is a number stands in the place of the number: two numbers would be confused.

        >>> Touches([[0, 0, 1]], [[0, 0, 1]], labels=("pole",), lines=(2,)).where(0)
        'touch 1 (pole, line 2)'
        >>> Touches([[0, 0, 1]], [[0, 0, 1]], labels=("23",), lines=(2,)).where(0)
        'touch 23 (line 2)'
        """
        label = self.labels[row] if self.labels is not None else ""
        number = label if label.isdecimal() else str(row + self.numbered_from)
        notes = [label] if label and label != number else []
        if self.lines is not None:
            notes.append(f"line {self.lines[row]}")
        return f"touch {number}" + (f" ({', '.join(notes)})" if notes else "")

    def take(self, rows: npt.ArrayLike) -> Touches:
        """The touches of the given rows (indices or a mask), in that order.

        >>> both = Touches([[0, 0, 1], [0, 0, 2]], [[0, 0, 1], [0, 0, 1]])
        >>> both.take([1]).positions.tolist()
        [[0.0, 0.0, 2.0]]
        """
        index = np.arange(len(self))[np.asarray(rows)]
        return Touches(
            positions=self.positions[index],
            normals=self.normals[index],
            approaches=self.approach_directions[index],
            feeds=None if self.feeds is None else self.feeds[index],
            labels=None if self.labels is None else tuple(self.labels[i] for i in index),
            nominal_points=None if self.nominal_points is None else self.nominal_points[index],
            source=self.source,
            lines=None if self.lines is None else tuple(self.lines[i] for i in index),
            reading=self.reading,
            spindle=None if self.spindle is None else self.spindle[index],
            **word_fields({n: tuple(each[i] for i in index) for n, each in self.words.items()}),
        )

    def without(self, names: Sequence[str]) -> Touches:
        """Touches without those of the given labels or lines.

        Parameters
        ----------
        names : sequence of str
            Each the label of a touch, or the number of a line of the file. A label comes first.

        Returns
        -------
        Touches

        Raises
        ------
        PretravelError
            A name that no touch has.

        >>> up = [[0, 0, 1]] * 3
        >>> three = Touches(up, up, labels=("a", "b", "c"), lines=(2, 3, 4))
        >>> three.without(["b", "4"]).labels
        ('a',)
        """
        kept = np.ones(len(self), dtype=bool)
        labels = self.labels or ("",) * len(self)
        lines = tuple(range(1, len(self) + 1)) if self.lines is None else self.lines
        for name in names:
            rows = [row for row, label in enumerate(labels) if label == name]
            if not rows:
                rows = [row for row, line in enumerate(lines) if str(line) == name]
            if not rows:
                raise PretravelError(
                    f"there is no touch with the label or on the line '{name}'", inputs=("exclude",)
                )
            kept[rows] = False
        if not kept.any():
            raise PretravelError("all touches are excluded", inputs=("exclude",))
        return self.take(kept)

    def at_rest(self, delay: float) -> Touches:
        """The same touches without the travel of the machine during the signal delay.

        Parameters
        ----------
        delay : float
            Signal delay. [s]

        Returns
        -------
        Touches
            Positions moved back along their approaches by feed times delay. A negative delay adds
            that travel.

        Raises
        ------
        PretravelError
            The touches contain no feeds.

        >>> touch = Touches([[0.0, 0.0, 2.98]], [[0.0, 0.0, 1.0]], feeds=[60.0])
        >>> touch.at_rest(0.010).positions.round(9).tolist()
        [[0.0, 0.0, 2.99]]
        """
        travel = travel_of_delay(self.feeds, delay)
        return replace(self, positions=self.positions - travel[:, None] * self.approach_directions)

    def with_feed(self, feed: float | None) -> Touches:
        """The same touches with a feed, where they contain none.

        Parameters
        ----------
        feed : float or None
            None returns the touches as they are. [mm/min]

        Raises
        ------
        PretravelError
            The touches contain feeds already; the feed is not positive.

        >>> Touches([[0.0, 0.0, 3.0]], [[0.0, 0.0, 1.0]]).with_feed(50.0).feeds.tolist()
        [50.0]
        """
        if feed is None:
            return self
        if self.feeds is not None:
            raise PretravelError(
                "the file already contains the feed of each touch: leave out the feed that you "
                "gave",
                inputs=("feed",),
            )
        checked(feed, "the feed", FEED, inputs=("feed",))
        return replace(self, feeds=np.full(len(self), feed))

    def with_spindle(self, angle: float) -> Touches:
        """The same touches with the orientation of the spindle at which they were made.

        Parameters
        ----------
        angle : float
            Counter-clockwise about the probe's +z. [rad]

        Raises
        ------
        PretravelError
            The touches state orientations already.

        >>> Touches([[0.0, 0.0, 3.0]], [[0.0, 0.0, 1.0]]).with_spindle(0.5).spindle.tolist()
        [0.5]
        """
        if self.spindle is not None:
            raise PretravelError(
                "the file already contains the orientation of the spindle of each touch (column "
                "spindle_deg): leave out the orientation that you gave",
                inputs=("spindle",),
            )
        return replace(self, spindle=np.full(len(self), angle))

    def moved(self, placement: Placement) -> Touches:
        """The same touches in another frame.

        Parameters
        ----------
        placement : Placement
            Of the part in the machine, from the frame of the part; its inverse transforms back.

        Returns
        -------
        Touches

        >>> up = Touches([[0.0, 0.0, 3.0]], [[0.0, 0.0, 1.0]])
        >>> up.moved(Placement(shift=np.array([1.0, 0.0, 0.0]))).positions.tolist()
        [[1.0, 0.0, 3.0]]
        """
        nominal = self.nominal_points
        return replace(
            self,
            positions=placement.points(self.positions),
            normals=placement.vectors(self.normals),
            approaches=placement.vectors(self.approach_directions),
            nominal_points=None if nominal is None else placement.points(nominal),
        )

    def refuse_several(self, *, but: Collection[str] = (), one_reference: bool = False) -> None:
        """Refuse touches of several tips, parts, passes or orientations, where one is meant.

        Parameters
        ----------
        but : collection of str
            Columns whose values may differ, such as ``tip``.
        one_reference : bool
            Whether the touches must also be on one reference.

        Raises
        ------
        PretravelError
            It names them, and the inputs that choose one.

        >>> both = Touches([[0, 0, 1]] * 2, [[0, 0, 1]] * 2, tips=("down", "front"))
        >>> both.refuse_several()
        Traceback (most recent call last):
        ...
        pretravel.base.errors.PretravelError: the touches are of 2 tips, down (1 touch) and front \
    (1 touch, from touch 2), and a map is that of one tip: choose one of them
        """
        for name, words in self.words.items():
            if name in but or name not in _ONE_EACH or len(set(words)) < 2:
                continue
            if name == "reference" and not one_reference:
                continue
            if name == "pass" and self.feeds is not None:
                continue  # the feeds distinguish them, and the signal delay takes them into account
            what, reason, inputs = _ONE_EACH[name]
            counts = Counter(words)
            named = [
                f"{word or 'unnamed'} ({count} touch{'es' if count > 1 else ''}"
                + (f", from {_where(self, words.index(word))})" if row else ")")
                for row, (word, count) in enumerate(list(counts.items())[:_SHOWN])
            ]
            more = " …" if len(counts) > _SHOWN else ""
            raise PretravelError(
                f"the touches are of {len(counts)} {what}, {' and '.join(named)}{more}, and "
                f"{reason}",
                inputs=inputs,
            )


def word_fields(words: Mapping[str, tuple[str, ...]]) -> dict[str, Any]:
    """Words by their columns as fields of `Touches`.

    >>> word_fields({"tip": ("front",)})
    {'tips': ('front',)}
    """
    return {WORD_COLUMNS[name]: each for name, each in words.items()}


def length_of_run(labels: Sequence[str] | None, positions: FloatArray) -> int:
    """Rows of the first of several runs, whose labels come again in the same order; 0: one run.

    A point that is touched again lies where it was: runs whose points differ are of several parts.

    >>> lid = np.array([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0]])
    >>> length_of_run(("a", "b", "a", "b"), np.vstack([lid, lid + 0.1]))
    2
    >>> length_of_run(("a", "b", "a", "b"), np.vstack([lid, lid + 1e-4]))
    0
    """
    count = len(positions)
    if labels is None or labels[0] not in labels[1:]:
        return 0
    length = labels.index(labels[0], 1)
    if length < 2 or count % length or tuple(labels[:length]) * (count // length) != tuple(labels):
        return 0
    runs = positions.reshape(-1, length, 3)
    away = np.linalg.norm(runs[1:] - runs[0], axis=2)
    return length if float(np.median(away)) > _SAME_POINT else 0


def refuse_several_runs(labels: Sequence[str] | None, positions: FloatArray) -> None:
    """Refuse rows whose labels come several times, at other places: those of several parts."""
    length = length_of_run(labels, positions)
    if length and labels is not None:
        raise PretravelError(
            f"each label occurs {len(positions) // length} times, each time with another "
            f"point: {labels[0]} is point 1 and point {length + 1}. Are these several parts? "
            "Choose one of them by its number, or all, if they are one part",
            inputs=("series",),
        )


def _where(touches: Touches, row: int) -> str:
    return touches.where(row) if touches.lines is None else f"line {touches.lines[row]}"


def travel_of_delay(feeds: FloatArray | None, delay: float) -> FloatArray:
    """Travel of the machine during the signal delay of each touch, (n,). [mm]

    Parameters
    ----------
    feeds : (n,) float or None
        [mm/min]
    delay : float
        [s]

    Raises
    ------
    PretravelError
        The feeds are not known.

    >>> travel_of_delay(np.array([60.0]), 0.010).tolist()
    [0.01]
    """
    if feeds is None:
        raise PretravelError(
            "the signal delay adds travel in proportion to the feed, but these touches do not "
            "give their feed: add a column feed_mm_min, or give the feed",
            inputs=("feed",),
        )
    return delay_travel(np.asarray(feeds, dtype=np.float64), delay)


def _refuse_far(points: FloatArray, where: Callable[[int], str], what: str) -> None:
    """Refuse points that are not finite, or farther away than any machine reaches."""
    bad = np.flatnonzero(~(np.abs(points) <= COORDINATE.highest).all(axis=1))
    if len(bad):
        row = int(bad[0])
        finite = np.isfinite(points[row]).all()
        problem = f"the {what} is {'farther than a kilometre' if finite else 'not finite'}"
        raise RowError(f"{where(row)}: {problem}", row, in_file=problem)
