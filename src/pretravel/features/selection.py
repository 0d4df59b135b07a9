"""The points of each feature, chosen by their labels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from fnmatch import fnmatchcase
from re import fullmatch

import numpy as np
import numpy.typing as npt

from pretravel.arrays import frozen
from pretravel.compensation.points import Points
from pretravel.errors import PretravelError

_SHOWN = 8


def points_at(points: Points, rows: npt.ArrayLike) -> Points:
    """Some of the points.

    Parameters
    ----------
    points : Points
    rows : (k,) int

    Returns
    -------
    Points
    """
    index = np.asarray(rows, dtype=np.int64)
    shared, plain = points.shared, points.uncompensated
    return replace(
        points,
        positions=frozen(points.positions[index]),
        normals=frozen(points.normals[index]),
        pretravel=frozen(points.pretravel[index]),
        covariance=frozen(points.covariance[index]),
        deviation=None if points.deviation is None else frozen(points.deviation[index]),
        labels=tuple(points.labels[row] for row in index.tolist()),
        shared=None if shared is None else {k: frozen(v[index]) for k, v in shared.items()},
        uncompensated=None if plain is None else frozen(plain[index]),
    )


def label_prefix(label: str) -> str:
    """A label without the number at its end; the label itself where nothing else is left.

    >>> label_prefix("bore1-03"), label_prefix("A7"), label_prefix("12")
    ('bore1', 'A', '12')
    """
    name = label.rstrip("0123456789")
    return (name.rstrip(" \t._:#/-") if name != label else label) or label


def _matches(label: str, pattern: str) -> bool:
    """Whether a label is meant by a pattern with * and ?, or by a range of numbers.

    >>> [_matches(label, "9..11") for label in ("9", "10", "012", "A10", "12")]
    [True, True, False, False, False]
    """
    numbers = fullmatch(r"([0-9]+)\.\.([0-9]+)", pattern)
    if numbers is not None and fullmatch("[0-9]+", label):
        return int(numbers[1]) <= int(label) <= int(numbers[2])
    return fnmatchcase(label, pattern)


def points_of_features(
    points: Points, patterns: Sequence[str] = (), *, by_prefix: bool = False
) -> dict[str, Points]:
    """The points of each feature.

    Parameters
    ----------
    points : Points
    patterns : sequence of str
        Of labels, with * and ? as in names of files, or 10..21 for labels that are these numbers;
        each is one feature. All points when empty.
    by_prefix : bool
        Points whose labels differ only in the number at the end are one feature each.

    Returns
    -------
    dict of str to Points
        By the name of the feature: its pattern or prefix; "" for all points.

    Raises
    ------
    PretravelError
        A pattern without points; numbers as labels, which do not say what belongs together.
    """
    found: dict[str, dict[int, None]] = {}  # rows in their order, each once
    for pattern in patterns or ("*",):
        rows = [i for i, label in enumerate(points.labels) if _matches(label, pattern)]
        if not rows:
            shown = ", ".join(points.labels[:_SHOWN]) + ("…" if len(points) > _SHOWN else "")
            raise PretravelError(
                f"no label of the {len(points)} points matches '{pattern}'; there are {shown}",
                inputs=("select",),
            )
        if not by_prefix:
            found[pattern if patterns else ""] = dict.fromkeys(rows)
            continue
        for row in rows:
            found.setdefault(label_prefix(points.labels[row]), {})[row] = None
    if by_prefix and all(label_prefix(label) == label for label in points.labels):
        raise PretravelError(
            "the labels of the points do not end with numbers behind a common name (bore1-1, "
            f"bore1-2, …), so they form no groups; the first is {points.labels[0]}",
            inputs=("group", "select"),
        )
    return {name: points_at(points, list(rows)) for name, rows in found.items()}
