"""Wishes that come with the package."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from pretravel.design.wish import Wish, wish_in
from pretravel.errors import PretravelError
from pretravel.toml_file import parse_toml, read_toml


def wish_names() -> list[str]:
    """Names of the wishes that come with the package.

    >>> "stylus-50mm" in wish_names()
    True
    """
    folder = files("pretravel.design").joinpath("data")
    return sorted(e.name[: -len(".toml")] for e in folder.iterdir() if e.name.endswith(".toml"))


def wish_text(name: str) -> str:
    """The TOML text of such a wish, to print and edit.

    Raises
    ------
    PretravelError
        There is no such wish.
    """
    if name not in wish_names():
        raise PretravelError(
            f"there is no wish '{name}' in the package; there are {', '.join(wish_names())}"
        )
    entry = files("pretravel.design").joinpath(f"data/{name}.toml")
    return entry.read_text(encoding="utf-8")


def shipped_wish(name: str) -> Wish:
    """A wish that comes with the package; see `wish_text`."""
    return wish_in(parse_toml(wish_text(name), f"wish {name}"))


def load_wish(wish: str | Path) -> Wish:
    """A wish by the name of a shipped one, or from a TOML file.

    Raises
    ------
    PretravelError
        Neither such a name nor a file; a file that is not a wish.
    """
    if str(wish) in wish_names():
        return shipped_wish(str(wish))
    path = Path(wish)
    if not path.exists():
        raise PretravelError(
            f"'{wish}' is neither a wish of the package ({', '.join(wish_names())}) nor a file; "
            "pretravel wishes NAME > wish.toml writes one to edit"
        )
    return wish_in(read_toml(path, "wish"), path.parent)
