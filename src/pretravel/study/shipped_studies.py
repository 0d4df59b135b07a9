"""Studies that come with the package."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

from pretravel.errors import PretravelError
from pretravel.study.definition import Study, study_in
from pretravel.toml_file import parse_toml, read_toml


def study_names() -> list[str]:
    """Names of the studies that come with the package.

    >>> "stylus-length" in study_names()
    True
    """
    folder = files("pretravel.study").joinpath("data")
    return sorted(
        entry.name[: -len(".toml")] for entry in folder.iterdir() if entry.name.endswith(".toml")
    )


def study_text(name: str) -> str:
    """The TOML text of such a study, to print and edit.

    Raises
    ------
    PretravelError
        There is no such study.
    """
    if name not in study_names():
        raise PretravelError(
            f"there is no study '{name}' in the package; there are {', '.join(study_names())}"
        )
    entry = files("pretravel.study").joinpath(f"data/{name}.toml")
    return entry.read_text(encoding="utf-8")


def shipped_study(name: str) -> Study:
    """A study that comes with the package; see `study_text`."""
    return study_in(parse_toml(study_text(name), f"study {name}"))


def load_study(study: str | Path) -> Study:
    """A study by the name of a shipped one, or from a TOML file.

    Raises
    ------
    PretravelError
        Neither such a name nor a file; a file that is not a study.
    """
    if str(study) in study_names():
        return shipped_study(str(study))
    path = Path(study)
    if not path.exists():
        raise PretravelError(
            f"'{study}' is neither a study of the package ({', '.join(study_names())}) nor a file; "
            "pretravel studies NAME > mine.toml writes one to edit"
        )
    return study_in(read_toml(path, "study"), path.parent)
