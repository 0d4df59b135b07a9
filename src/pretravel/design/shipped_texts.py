"""TOML texts that come with the package, to run by name or to print and edit."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path

from pretravel.base import PretravelError, TomlDocument, parse_toml, read_toml


@dataclass(frozen=True)
class ShippedTexts:
    """The texts of one kind: the .toml files in a folder of a package.

    Parameters
    ----------
    package, folder : str
    kind : str
        For messages: ``study``.
    command : str
        Of ``pretravel``, which prints a text: ``studies``.
    """

    package: str
    folder: str
    kind: str
    command: str

    def names(self) -> list[str]:
        """Their names, sorted."""
        entries = files(self.package).joinpath(self.folder).iterdir()
        return sorted(e.name[: -len(".toml")] for e in entries if e.name.endswith(".toml"))

    def text(self, name: str) -> str:
        """A text by its name.

        Raises
        ------
        PretravelError
            There is no text of this name.
        """
        if name not in self.names():
            raise PretravelError(
                f"there is no {self.kind} '{name}' in the package; there are "
                f"{', '.join(self.names())}"
            )
        entry = files(self.package).joinpath(f"{self.folder}/{name}.toml")
        return entry.read_text(encoding="utf-8")

    def document(self, source: str | Path) -> tuple[TomlDocument, Path]:
        """The document of a name or of a file, and the folder to which its paths are relative.

        Raises
        ------
        PretravelError
            Neither a name nor a file; a file that is not TOML.
        """
        if str(source) in self.names():
            return parse_toml(self.text(str(source)), f"{self.kind} {source}"), Path()
        path = Path(source)
        if not path.exists():
            raise PretravelError(
                f"'{source}' is neither a {self.kind} of the package ({', '.join(self.names())}) "
                f"nor a file; pretravel {self.command} NAME > mine.toml writes one to edit"
            )
        return read_toml(path, self.kind), path.parent
