"""The points of each feature, chosen by their labels."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from re import fullmatch

import numpy as np

from pretravel.base import PretravelError
from pretravel.measurement.association import ASSOCIATIONS
from pretravel.measurement.points import Points
from pretravel.touches import label_prefix

_SHOWN = 8


def points_on_faces(points: Points, faces: Sequence[int]) -> Points:
    """The points on some faces of the part.

    Parameters
    ----------
    points : Points
        With their faces.
    faces : sequence of int
        Numbers, as `pretravel faces` lists them.

    Returns
    -------
    Points
        None where no point is on these faces.

    Raises
    ------
    PretravelError
        The points do not state their faces.
    """
    if points.face is None:
        raise PretravelError(
            "the points do not give the faces on which they lie (column face): take the points "
            "that pretravel align writes, or choose them by label with select"
        )
    return points[np.flatnonzero(np.isin(points.face, np.asarray(faces)))]


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
        Points whose labels differ only in the number at the end belong to one feature.

    Returns
    -------
    dict of str to Points
        By the name of the feature: its pattern or prefix; "" for all points.

    Raises
    ------
    PretravelError
        A pattern without points; numbers as labels, which do not say what belongs together.
    """
    rows: dict[str, list[int]] = {}
    place_of: dict[str, int] = {}
    matched: set[int] = set()
    for row, label in enumerate(points.labels):
        own: dict[str, int] = {}
        for place, pattern in enumerate(patterns or ("*",)):
            if _matches(label, pattern):
                matched.add(place)
                name = label_prefix(label) if by_prefix else pattern if patterns else ""
                own.setdefault(name, place)
        for name, place in own.items():
            rows.setdefault(name, []).append(row)
            place_of[name] = min(place, place_of.get(name, place))
    _refuse_labels(points.labels, patterns, matched, by_prefix=by_prefix)
    return {name: points[rows[name]] for name in sorted(rows, key=place_of.__getitem__)}


def nearly_chosen(labels: Sequence[str], patterns: Sequence[str]) -> list[str]:
    """Warning about labels that differ from a pattern in case or blanks alone.

    >>> nearly_chosen(["bore1-1", "Bore1-2", "bore1 -3", "bore2-1"], ["bore1-*"])[0][:47]
    '2 labels differ from bore1-* in case or blanks '
    """
    said = []
    for pattern in patterns:
        alike = _plain(pattern)
        near = [
            label
            for label in labels
            if _matches(_plain(label), alike)
            and not any(_matches(label, chosen) for chosen in patterns)
        ]
        if near:
            shown = ", ".join(near[:_SHOWN]) + (" …" if len(near) > _SHOWN else "")
            said.append(
                f"{len(near)} labels differ from {pattern} in case or blanks alone, and are not "
                f"used: {shown}"
            )
    return said


def _plain(label: str) -> str:
    return "".join(label.casefold().split())


def named_feature(name: str) -> str | None:
    """The feature whose word a name of points begins with; None where there is none.

    >>> named_feature("bore1"), named_feature("Plane_top"), named_feature("top")
    ('bore', 'plane', None)
    """
    found = [kind for kind in ASSOCIATIONS if name.lower().startswith(kind)]
    return max(found, key=len, default=None)


def _refuse_labels(
    labels: Sequence[str], patterns: Sequence[str], matched: set[int], *, by_prefix: bool
) -> None:
    for place, pattern in enumerate(patterns):
        if place not in matched:
            shown = ", ".join(labels[:_SHOWN]) + ("…" if len(labels) > _SHOWN else "")
            if ".." in pattern:
                shown += ". Numbers choose labels that are numbers"
            raise PretravelError(
                f"no label of the {len(labels)} points matches '{pattern}'; there are {shown}",
                inputs=("select",),
            )
    if by_prefix and all(label_prefix(label) == label for label in labels):
        raise PretravelError(
            "the labels of the points do not end with numbers behind a common name (bore1-1, "
            f"bore1-2, …), so they form no groups; the first is {labels[0]}",
            inputs=("group", "select"),
        )
