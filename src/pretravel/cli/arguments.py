"""What people type, as values: ranges, vectors; and progress for long work."""

from __future__ import annotations

import logging
import math
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from pretravel.errors import PretravelError

_MOST_VALUES = 100_000

PICTURES = (".png", ".svg", ".pdf")
MAPS = (".nc", ".csv", ".json", ".html")
POINTS = (".csv", ".parquet", ".nc", ".json", ".qif", ".msr", ".html")


def check_files(
    outputs: Sequence[tuple[Path | None, Sequence[str]]], inputs: Sequence[Path | str] = ()
) -> None:
    """Refuse outputs that could not be written, before any work is done for them.

    Parameters
    ----------
    outputs : pairs of path and endings
        Paths that will be written (None: not asked for), and what they may end in.
    inputs : paths
        Of files that are read; none may be overwritten.

    Raises
    ------
    PretravelError
        Another ending, no such folder, a folder of that name, a file that is read.

    >>> check_files([(Path("map.xyz"), (".nc",))])
    Traceback (most recent call last):
    ...
    pretravel.errors.PretravelError: cannot write map.xyz: the ending must be .nc
    """
    seen: set[Path] = set()
    for path, endings in outputs:
        if path is None:
            continue
        if path.suffix.lower() not in endings:
            raise PretravelError(f"cannot write {path}: the ending must be {', '.join(endings)}")
        if not path.parent.is_dir():
            raise PretravelError(f"cannot write {path}: the folder {path.parent} does not exist")
        if path.is_dir():
            raise PretravelError(f"cannot write {path}: it is a folder")
        resolved = path.resolve()
        if resolved in seen:
            raise PretravelError(f"cannot write {path} twice")
        if any(resolved == Path(source).resolve() for source in inputs):
            raise PretravelError(
                f"cannot write {path}: it is read too and would be overwritten; choose another name"
            )
        seen.add(resolved)


def angle_range(text: str, name: str) -> list[float]:
    """Angles from ``start:stop:step`` (the stop included), ``a,b,c`` or one number.

    Parameters
    ----------
    text : str
        [deg]
    name : str
        The argument's name, for messages.

    Returns
    -------
    list of float
        [deg]

    Raises
    ------
    PretravelError

    >>> angle_range("0:30:10", "--azimuth"), angle_range("90", "--polar")
    ([0.0, 10.0, 20.0, 30.0], [90.0])
    """
    try:
        numbers = [float(part) for part in text.replace(":", ",").split(",")]
        if not all(math.isfinite(value) for value in numbers):
            raise ValueError
        if ":" not in text:
            return numbers
        start, stop, step = numbers
    except ValueError:
        raise PretravelError(
            f"{name} {text}: expected one angle, a list 0,30,60 or start:stop:step in degrees"
        ) from None
    if not step > 0.0 or stop < start:
        raise PretravelError(f"{name} {text}: start:stop:step must go upwards, with a step above 0")
    count = int((stop - start) / step + 1e-9) + 1
    if count > _MOST_VALUES:
        raise PretravelError(f"{name} {text}: {count} angles are more than {_MOST_VALUES}")
    return [start + step * i for i in range(count)]


def number(text: str, name: str) -> float:
    """One finite number.

    Raises
    ------
    PretravelError

    >>> number("1.5", "--axial-pretravel")
    1.5
    """
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise PretravelError(f"{name} {text}: expected a number")
    return value


def pair(text: str, name: str) -> tuple[float, float]:
    """Two finite numbers from ``a,b`` or ``a:b``.

    Raises
    ------
    PretravelError

    >>> pair("0.5,-0.5", "--at")
    (0.5, -0.5)
    """
    try:
        first, second = (float(part) for part in text.replace(":", ",").split(","))
    except ValueError:
        first, second = math.nan, math.nan
    if not (math.isfinite(first) and math.isfinite(second)):
        raise PretravelError(f"{name} {text}: expected two numbers, for example 0.5,0.5")
    return (first, second)


def vector(text: str, name: str) -> tuple[float, float, float]:
    """Three numbers from ``x,y,z``.

    Raises
    ------
    PretravelError

    >>> vector("0,0,1", "--axis")
    (0.0, 0.0, 1.0)
    """
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise PretravelError(f"{name} {text}: expected three numbers x,y,z") from None
    return (x, y, z)


def unit_vector(text: str, name: str) -> tuple[float, float, float]:
    """A direction from ``x,y,z`` of any length but zero, scaled to one.

    >>> unit_vector("0,0,-2", "--gravity")
    (0.0, 0.0, -1.0)
    """
    x, y, z = vector(text, name)
    length = math.hypot(x, y, z)
    if not (math.isfinite(length) and length > 0.0):
        raise PretravelError(f"{name} {text}: a direction has three finite numbers, not all zero")
    return (x / length, y / length, z / length)


@contextmanager
def working(what: str) -> Iterator[None]:
    """A spinner on stderr while something takes long; silent where it is not a terminal."""
    if not sys.stderr.isatty():
        yield
        return
    from rich.console import Console

    class Stage(logging.Handler):
        """Long work says what it is at; the spinner repeats it."""

        def emit(self, record: logging.LogRecord) -> None:
            status.update(f"{what}: {record.getMessage()}")

    logger, handler = logging.getLogger("pretravel"), Stage(logging.INFO)
    level = logger.level
    with Console(stderr=True).status(what) as status:
        logger.addHandler(handler)
        logger.setLevel(logging.INFO)
        try:
            yield
        finally:
            logger.removeHandler(handler)
            logger.setLevel(level)
