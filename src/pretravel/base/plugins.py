"""Objects that the package lists by name, and those that other packages add by entry points.

Kinds of map, formats, controls and standards. What this package has is listed once, where the
objects are used; another package adds its own in a group of entry points, without a change here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from functools import cached_property
from importlib import import_module
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from pretravel.base.errors import PretravelError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

_T = TypeVar("_T")


def object_at(place: str) -> Any:
    """The object of a place; its module is imported now.

    Parameters
    ----------
    place : str
        Module and name: ``pretravel.base.units:DEGREE``.

    >>> object_at("pretravel.base.units:MICROMETRE")
    0.001
    """
    module, _, name = place.partition(":")
    return getattr(import_module(module), name)


def _itself(found: Any) -> Any:
    return found


def _origin(point: EntryPoint) -> str:
    package = "" if point.dist is None else f" of {point.dist.name}"
    return f"{point.value}{package}"


class Plugins(Mapping[str, _T], Generic[_T]):
    """Objects by their names, each imported when it is first asked for.

    Parameters
    ----------
    group : str
        Group of entry points of other packages: ``pretravel.kinds``.
    own : mapping of str to str
        Places of this package's objects by their names, which stand first, in this order.
    make : callable
        Makes the object from what its place contains; by default it is that.

    Raises
    ------
    PretravelError
        Two packages use one name, or a plug-in cannot be imported or has another name of its own.

    >>> units = Plugins("pretravel.units", {"um": "pretravel.base.units:MICROMETRE"})
    >>> list(units), units["um"]
    (['um'], 0.001)
    """

    def __init__(
        self, group: str, own: Mapping[str, str], make: Callable[[Any], _T] = _itself
    ) -> None:
        self._group, self._own, self._make = group, own, make
        self._loaded: dict[str, _T] = {}

    @cached_property
    def _points(self) -> dict[str, EntryPoint]:
        """Of other packages, by their names."""
        from importlib.metadata import entry_points

        found: dict[str, EntryPoint] = {}
        for point in sorted(entry_points(group=self._group), key=lambda point: point.name):
            if point.value.startswith("pretravel."):
                continue  # an earlier version of this package listed its own here
            other = found.setdefault(point.name, point)
            if other.value != point.value or point.name in self._own:
                first = self._own.get(point.name) or _origin(other)
                raise PretravelError(
                    f"two packages have a plug-in '{point.name}' in {self._group}: "
                    f"{first} and {_origin(point)}. Remove one of them"
                )
        return found

    def __getitem__(self, name: str) -> _T:
        if name not in self._loaded:
            if name in self._own:
                self._loaded[name] = self._make(object_at(self._own[name]))
            else:
                self._loaded[name] = self._of_others(name)
        return self._loaded[name]

    def _of_others(self, name: str) -> _T:
        point = self._points[name]
        try:
            made = self._make(point.load())
        except (ImportError, AttributeError) as error:
            raise PretravelError(
                f"the plug-in '{name}' in {self._group}, {_origin(point)}, cannot be used: {error}"
            ) from error
        stated = getattr(made, "name", name)
        if stated != name:
            raise PretravelError(
                f"the plug-in '{name}' in {self._group}, {_origin(point)}, calls itself "
                f"'{stated}': its package must list it under that name"
            )
        return made

    def usable(self) -> dict[str, _T]:
        """The objects by name, without plug-ins that cannot be used.

        A request for such a plug-in by its name raises with the reason; others need not know of it.
        """
        found = {}
        for name in self:
            with suppress(PretravelError):
                found[name] = self[name]
        return found

    def __iter__(self) -> Iterator[str]:
        yield from self._own
        yield from self._points  # asked for where the own ones do not suffice

    def __len__(self) -> int:
        return len(self._own) + len(self._points)

    def __contains__(self, name: object) -> bool:
        return name in self._own or name in self._points
