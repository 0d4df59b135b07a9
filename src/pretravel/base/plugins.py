"""What packages add to pretravel by entry points: kinds of map, formats, controls, standards.

The package lists its own in the same way, in ``pyproject.toml``, so that one file and one line
there add one; another package adds its own without a change here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from pretravel.base.errors import PretravelError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

_T = TypeVar("_T")


def _itself(found: Any) -> Any:
    return found


def _origin(point: EntryPoint) -> str:
    package = "" if point.dist is None else f" of {point.dist.name}"
    return f"{point.value}{package}"


class Plugins(Mapping[str, _T], Generic[_T]):
    """Objects by their names: found when they are first needed, each imported when asked for.

    Parameters
    ----------
    group : str
        Group of entry points: ``pretravel.kinds``.
    first : tuple of str
        Names that stand first, in this order; the others follow by their names.
    make : callable
        Makes the object from what the entry point names; by default it is that.

    Raises
    ------
    PretravelError
        The installation lists none, two packages use one name, or a plug-in cannot be imported or
        has another name of its own.

    >>> checks = Plugins("pretravel.standards", ("iso10360-5",))
    >>> list(checks)[0], "iso230-10" in checks
    ('iso10360-5', True)
    """

    def __init__(
        self, group: str, first: tuple[str, ...] = (), make: Callable[[Any], _T] = _itself
    ) -> None:
        self._group, self._first, self._make = group, first, make
        self._loaded: dict[str, _T] = {}

    @cached_property
    def _points(self) -> dict[str, EntryPoint]:
        from importlib.metadata import entry_points

        found: dict[str, EntryPoint] = {}
        for point in entry_points(group=self._group):
            other = found.setdefault(point.name, point)
            if other.value != point.value:
                raise PretravelError(
                    f"two packages have a plug-in '{point.name}' in {self._group}: "
                    f"{_origin(other)} and {_origin(point)}. Remove one of them"
                )
        if not found:
            raise PretravelError(
                f"no installed package lists {self._group}, not even pretravel: its sources must "
                "be installed. In their folder, run: pip install -e ."
            )
        names = [name for name in self._first if name in found]
        return {name: found[name] for name in [*names, *sorted(set(found) - set(names))]}

    def __getitem__(self, name: str) -> _T:
        if name not in self._loaded:
            point = self._points[name]
            try:
                made = self._make(point.load())
            except (ImportError, AttributeError) as error:
                raise PretravelError(
                    f"the plug-in '{name}' in {self._group}, {_origin(point)}, cannot be used: "
                    f"{error}"
                ) from error
            own = getattr(made, "name", name)
            if own != name:
                raise PretravelError(
                    f"the plug-in '{name}' in {self._group}, {_origin(point)}, calls itself "
                    f"'{own}': its package must list it under that name"
                )
            self._loaded[name] = made
        return self._loaded[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._points)

    def __len__(self) -> int:
        return len(self._points)

    def __contains__(self, name: object) -> bool:
        return name in self._points
