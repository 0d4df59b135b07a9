"""What can be given in the place of a map: a result that has one, or its file."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol, TypeAlias

from pretravel.base import PretravelError, from_file
from pretravel.maps.pretravel_map import PretravelMap


class HasMap(Protocol):
    """A result with one map, such as a qualification."""

    @property
    def pretravel_map(self) -> PretravelMap:
        """The map."""


MapLike: TypeAlias = PretravelMap | HasMap | str | Path
"""What functions take in the place of a map, see `as_map`."""


def as_map(given: MapLike) -> PretravelMap:
    """The map that is meant: a map, that of a qualification, or a file of one.

    Parameters
    ----------
    given : PretravelMap, Qualification, str or Path

    Returns
    -------
    PretravelMap

    Raises
    ------
    PretravelError
        Something else; as `pretravel.files.map_file.read_map`.

    >>> as_map(3.0)
    Traceback (most recent call last):
    ...
    pretravel.base.errors.PretravelError: expected a map, not a float: qualify and predicted_map \
make maps, read_map reads one
    """
    if isinstance(given, PretravelMap):
        return given
    if isinstance(given, str | Path):
        given = from_file("map", given)
    found = getattr(given, "pretravel_map", given)
    if not isinstance(found, PretravelMap):
        raise PretravelError(
            f"expected a map, not a {type(given).__name__}: qualify and predicted_map make maps, "
            "read_map reads one"
        )
    return found
