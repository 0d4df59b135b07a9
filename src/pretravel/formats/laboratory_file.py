"""The statements of a calibration laboratory for its certificates, as a TOML file."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path

from pretravel.laboratory.certificate import LaboratoryStatements
from pretravel.toml_file import TomlStructure, read_toml


def laboratory_template() -> str:
    """A TOML text to fill in.

    >>> laboratory_template().splitlines()[0]
    '[laboratory]'
    """
    blocks = []
    for table, statements in groupby(LaboratoryStatements().statements(), lambda s: s.table):
        lines = [f'{s.key} = ""'.ljust(28) + f"# {s.meaning}" for s in statements]
        blocks.append("\n".join([f"[{table}]", *lines]))
    return "\n\n".join(blocks) + "\n"


def read_laboratory(path: str | Path) -> LaboratoryStatements:
    """Read a template that was filled in.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    LaboratoryStatements

    Raises
    ------
    InputError
        No such file, not TOML, tables or keys that a certificate does not have.
    """
    structure = TomlStructure()
    structure.value(str, str)  # dates and numbers are texts on a certificate
    document = read_toml(path, "file of a laboratory", "the command laboratory prints one")
    return structure.make(document, LaboratoryStatements)
