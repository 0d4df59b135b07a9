"""The files that paths, folders and names with wildcards mean."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from pretravel.base import InputError

_SHOWN = 6
"""Most names of files that a message shows."""


def files_meant(
    places: Sequence[Path | str], in_folder: Callable[[Path], bool], what: str
) -> list[Path]:
    """Return the files that are meant: a folder is its files, a name with * those that match.

    Shells expand wildcards where they are not quoted, but not on Windows.

    Parameters
    ----------
    places : sequence of Path or str
    in_folder : callable
        Whether a file of a folder is meant.
    what : str
        What these files contain, for messages.

    Returns
    -------
    list of Path
        In the order that is given; within a folder or a wildcard by name, where 2 comes before 10.

    Raises
    ------
    InputError
        Nothing matches; a file is named twice.

    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> for name in ("a10.csv", "a2.csv", "note.md"):
    ...     (folder / name).touch()
    >>> [p.name for p in files_meant([folder], lambda path: path.suffix == ".csv", "tables")]
    ['a2.csv', 'a10.csv']
    """
    found: list[Path] = []
    for place in map(Path, places):
        if place.is_dir():
            inside = [p for p in _in_order(place.iterdir()) if p.is_file() and in_folder(p)]
            if not inside:
                raise InputError(f"the folder has no file of {what}; {_it_has(place)}", path=place)
            found += inside
        elif re.search(r"[*?\[]", str(place)) and not place.exists():
            matching = [p for p in _in_order(_matching(place)) if p.is_file()]
            if not matching:
                raise InputError(
                    f"no file has a name like this; {_it_has(place.parent)}", path=place
                )
            found += matching
        else:
            found.append(place)
    resolved = [path.resolve() for path in found]
    if len(set(resolved)) < len(resolved):
        twice = Counter(resolved).most_common(1)[0][0]
        raise InputError("this file is given twice", path=found[resolved.index(twice)])
    return found


def _it_has(folder: Path) -> str:
    """What is in a folder, as the end of a message."""
    if not folder.is_dir():
        return f"the folder {folder} does not exist"
    names = [path.name for path in _in_order(folder.iterdir()) if path.is_file()]
    listed = ", ".join(names[:_SHOWN]) + (" …" if len(names) > _SHOWN else "")
    return f"{folder.resolve()} has {listed or 'no files'}"


def _matching(pattern: Path) -> list[Path]:
    inside = str(pattern.relative_to(pattern.anchor)) if pattern.anchor else str(pattern)
    hidden = pattern.name.startswith(".")  # as shells do
    try:
        found = list(Path(pattern.anchor or ".").glob(inside))
    except ValueError as error:
        raise InputError(f"not a name with wildcards: {error}", path=pattern) from None
    return [path for path in found if hidden or not path.name.startswith(".")]


def _in_order(paths: Iterable[Path]) -> list[Path]:
    """Sorted by name, with numbers by their value."""

    def key(path: Path) -> list[tuple[int, int, str]]:
        parts = re.split(r"(\d+)", str(path))
        return [(0, int(part), "") if part.isdecimal() else (1, 0, part.lower()) for part in parts]

    return sorted(paths, key=key)
