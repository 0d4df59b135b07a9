"""Readings: what a control says of touches, and how that is joined with the plan it ran."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from pretravel.arrays import FloatArray
from pretravel.errors import InputError
from pretravel.frames import Placement
from pretravel.probing.targets import Targets
from pretravel.touches import Touches
from pretravel.units import INCH

ACROSS = 0.05
"""A reading further than this from the line of a target is not one of that target. [mm]"""
ALONG = 10.0
"""And one further than this from the target along the line. [mm]"""
AT_THE_END = 0.02
"""A reading this close to the end of its move (and no contact told) was none. [mm]"""

_ODD = 0.5
"""Readings this much further along their lines than most are pointed out. [mm]"""

UNITS = {"mm": 1.0, "inch": INCH}
"""Of files that do not tell theirs."""


@dataclass(frozen=True, eq=False)
class FileReadings:
    """Touches of a file, with what else it tells.

    Attributes
    ----------
    touches : Touches
        Those that touched. Work coordinates, where the file has such.
    missed : tuple of str
        Labels of those that did not.
    rotation : float
        Of the work coordinates about the machine's z, as the file tells. [rad]
    warnings : tuple of str
        What a user should know, as sentences.
    compensated : mapping of str to (3,) float
        Surface points that the control worked out itself, by label. [mm]
    tip_radius : float or None
        Where the file tells it. [mm]
    """

    touches: Touches
    missed: tuple[str, ...] = ()
    rotation: float = 0.0
    warnings: tuple[str, ...] = ()
    compensated: dict[str, FloatArray] = field(default_factory=dict)
    tip_radius: float | None = None

    @property
    def placement(self) -> Placement:
        """Directions of the work coordinates as those of the machine."""
        from pretravel.frames import probe_rotation

        return Placement(rotation=probe_rotation(rotation=self.rotation))

    def notes(self) -> list[str]:
        """What is missing and what should be known, as sentences."""
        notes = list(self.warnings)
        if self.missed:
            shown = ", ".join(self.missed[:10]) + ("…" if len(self.missed) > 10 else "")
            plural = "es" if len(self.missed) > 1 else ""
            notes.append(f"{len(self.missed)} touch{plural} missed: {shown}")
        return notes


@dataclass(frozen=True, eq=False)
class Rows:
    """Positions of a file that does not say what they are.

    Attributes
    ----------
    path : str
    positions : (n, 3) float
        [mm]
    lines : tuple of int
    contact : tuple of bool, or None
        Whether each is a contact, where the file tells.
    """

    path: str
    positions: FloatArray
    lines: tuple[int, ...]
    contact: tuple[bool, ...] | None = None


def file_lines(path: str | Path, what: str) -> list[str]:
    """The lines of a text file, whatever its line ends, without a byte-order mark.

    Parameters
    ----------
    path : str or Path
    what : str
        For messages: a grbl log, …

    Returns
    -------
    list of str

    Raises
    ------
    InputError
        No such file, not text, nothing in it.
    """
    try:
        raw = Path(path).read_bytes()
    except FileNotFoundError:
        raise InputError("there is no such file", path=path) from None
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror}", path=path) from error
    encoding = "utf-16" if raw[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        text = raw.decode(encoding)
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    if "\0" in text:
        raise InputError(f"this is not a text file, so not {what}", path=path)
    if not text.strip():
        raise InputError(f"the file is empty; {what} is needed", path=path)
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def scale_of(units: str | None, path: str | Path, why: str) -> float:
    """Millimetres in a file's unit, which the user must tell.

    Raises
    ------
    InputError

    >>> scale_of("inch", "a.log", "")
    25.4
    """
    if units not in UNITS:
        told = "" if units is None else f"--units {units}: "
        raise InputError(f"{told}{why}; give --units mm or --units inch", path=path)
    return UNITS[units]


def join(
    rows: Rows, plan: Targets, tip_radius: float, *, overtravel: float | None = None
) -> FileReadings:
    """Positions joined with the targets on whose lines they lie. Nothing is counted.

    Parameters
    ----------
    rows : Rows
    plan : Targets
        That was run, in the same coordinates. Targets of the same place and direction are
        repeats; they take readings in turn.
    tip_radius : float
        [mm]
    overtravel : float, optional
        How far beyond the nominal surface the moves ended; a reading there is a miss, where the
        file does not tell contacts itself. [mm]

    Returns
    -------
    FileReadings

    Raises
    ------
    InputError
        A reading that belongs to no target, or to several; more readings of a target than it
        has repeats; a plan of which nothing was read: with the line.

    >>> up = Targets([[0.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]], labels=("top",))
    >>> found = join(Rows("a.log", np.array([[0.0, 0.0, 2.99]]), (1,)), up, 3.0)
    >>> found.touches.labels
    ('top',)
    """
    from scipy.spatial import cKDTree

    labels = plan.labels or tuple(str(i + 1) for i in range(len(plan)))
    if len(set(labels)) < len(labels):
        twice = next(label for label in labels if labels.count(label) > 1)
        raise InputError(f"the plan has two targets called '{twice}'", path=rows.path)
    approaches = np.asarray(plan.approaches)
    centers = plan.points + tip_radius * plan.normals
    # Repeats share the place and the direction.
    keys = np.round(np.hstack([plan.points, plan.normals, approaches]), 6)
    _, representatives, group = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    group = group.ravel()
    waiting: list[list[int]] = [[] for _ in representatives]
    for touch, own_group in enumerate(group.tolist()):
        waiting[own_group].append(touch)
    middle, way = centers[representatives], approaches[representatives]
    near_by = cKDTree(middle).query_ball_point(rows.positions, float(np.hypot(ALONG, ACROSS)))
    taken: list[tuple[int, int]] = []
    beyond: list[float] = []
    missed: list[str] = []
    for row, (position, line) in enumerate(zip(rows.positions, rows.lines, strict=True)):
        some = np.sort(np.asarray(near_by[row], dtype=np.int64))
        if not len(some):
            some = np.arange(len(middle))
        seen = position - middle[some]
        along = np.sum(seen * way[some], axis=1)
        across = np.linalg.norm(seen - along[:, None] * way[some], axis=1)
        which = np.flatnonzero((across < ACROSS) & (np.abs(along) < ALONG))
        if len(which) > 1:
            # Lines that cross: the one whose target is much nearer, or none.
            order = which[np.argsort(np.abs(along[which]))]
            near, next_ = np.abs(along[order[:2]])
            which = order[:1] if near < 1.0 and next_ > 3.0 * max(near, 0.3) else which
        place = ", ".join(f"{value:.4f}" for value in position)
        if len(which) == 0:
            nearest = int(np.argmin(across + np.maximum(np.abs(along) - ALONG, 0.0)))
            raise InputError(
                f"the reading ({place}) mm lies on the line of no target; the nearest is "
                f"{labels[representatives[some[nearest]]]}, {across[nearest]:.3f} mm beside it. Is "
                "this the plan that was run, in the same work offset and unit (--units)?",
                path=rows.path,
                line=line,
            )
        if len(which) > 1:
            names = ", ".join(labels[representatives[some[i]]] for i in which[:3])
            raise InputError(
                f"the reading ({place}) mm could be of several targets ({names}); only a log "
                "that carries labels can tell them apart",
                path=rows.path,
                line=line,
            )
        chosen = int(which[0])
        target = int(some[chosen])
        if not waiting[target]:
            raise InputError(
                f"the target {labels[representatives[target]]} has more readings than the plan "
                "has touches of it: is this the log of two runs?",
                path=rows.path,
                line=line,
            )
        own = waiting[target].pop(0)
        contact = None if rows.contact is None else rows.contact[row]
        if contact is None and overtravel is not None:
            contact = bool(along[chosen] < overtravel - AT_THE_END)
        if contact is False:
            missed.append(labels[own])
            continue
        taken.append((int(own), row))
        beyond.append(float(along[chosen]))
    absent = [labels[i] for left in waiting for i in left]
    warnings = []
    if absent:
        shown = ", ".join(absent[:10]) + ("…" if len(absent) > 10 else "")
        warnings.append(
            f"{len(absent)} touches of the plan have no reading: {shown}. (A control may leave out "
            "a reading that equals the one before; or the run ended early.)"
        )
    if rows.contact is None and overtravel is None:
        warnings.append(_perhaps_missed([labels[own] for own, _ in taken], np.array(beyond)))
    if not taken:
        raise InputError("none of its readings is a contact", path=rows.path)
    own_rows = [own for own, _ in taken]
    read_rows = [row for _, row in taken]
    return FileReadings(
        Touches(
            positions=rows.positions[read_rows],
            normals=plan.normals[own_rows],
            approaches=approaches[own_rows],
            labels=tuple(labels[i] for i in own_rows),
            nominal_points=plan.points[own_rows],
            source=Path(rows.path).name,
            lines=tuple(rows.lines[i] for i in read_rows),
        ),
        missed=tuple(missed),
        warnings=tuple(warnings),
    )


def _perhaps_missed(labels: list[str], beyond: FloatArray) -> str:
    """What to say where a miss looks like a touch; names those that lie where a miss would."""
    told = (
        "a miss leaves a reading like a touch, where its move ended; tell where that is (--machine)"
    )
    if not len(beyond):
        return told
    deep = beyond - np.median(beyond)
    odd = [
        f"{label} ({depth:+.2f} mm)"
        for label, depth in zip(labels, deep, strict=True)
        if abs(depth) > _ODD
    ]
    if not odd:
        return told
    return (
        f"{told}. These lie further along than the others, as a miss would: {', '.join(odd[:10])}"
    )


def finite(cells: Sequence[str], path: str | Path, line: int) -> list[float]:
    """Cells of a line as finite numbers.

    Raises
    ------
    InputError
        With the line.

    >>> finite(["1", "-.5"], "a.log", 1)
    [1.0, -0.5]
    """
    values = []
    for cell in cells:
        try:
            value = float(cell)
        except ValueError:
            value = np.nan
        if not np.isfinite(value):
            hint = "; use a point as decimal sign" if "," in cell else ""
            raise InputError(f"'{cell}' is not a finite number{hint}", path=path, line=line)
        values.append(value)
    return values
