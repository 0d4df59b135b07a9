"""The statements of a laboratory for its reports and certificates, as a TOML file."""

from __future__ import annotations

import json
from itertools import groupby
from pathlib import Path

from pretravel.base import TomlStructure, read_toml
from pretravel.files.laboratory_statements import (
    CERTIFICATE_TABLES,
    LaboratoryStatements,
)
from pretravel.files.report_tables import REPORT_TABLES


def laboratory_template(statements: LaboratoryStatements = LaboratoryStatements()) -> str:
    r"""A TOML text to fill in; with statements it is filled in.

    >>> print("\n".join(laboratory_template().splitlines()[5:8]))
    [laboratory]                # every report and the certificate
    name = ""                   # Name and address of the laboratory
    place = ""                  # Place of calibration, if another
    """
    blocks = [_HEAD]
    for table, listed in groupby(statements.statements(), lambda s: s.table):
        lines = [f"{s.key} = {_toml(s.text)}".ljust(28) + f"# {s.meaning}" for s in listed]
        blocks.append("\n".join([f"[{table}]".ljust(28) + f"# {_where(table)}", *lines]))
    return "\n\n".join(blocks) + "\n"


def _toml(text: str) -> str:
    """A text as a basic string of TOML, whose escapes are those of JSON."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


_HEAD = """\
# What a laboratory states with a result of qualify, check, measure, separate and rig.
# Fill in between the quotation marks, and leave empty what you do not know: an empty field is
# shown as "not stated". Tables that are marked with "certificate" are for the
# calibration certificate of a probe (rig); other reports show them where they are filled in."""


def _where(table: str) -> str:
    """Where the statements of a table are shown, also where they are open."""
    if table in REPORT_TABLES:
        return "every report" + (" and the certificate" if table in CERTIFICATE_TABLES else "")
    if table == "standards":
        return "texts that you own and compared with the definitions of a report"
    return "certificate"


def read_laboratory(path: str | Path) -> LaboratoryStatements:
    """Read a template that was filled in.

    Raises
    ------
    InputError
        No such file, not TOML, tables or keys that are not known.
    """
    structure = TomlStructure()
    structure.value(str, str)  # dates and numbers are texts on a certificate
    document = read_toml(path, "file of a laboratory", "the command laboratory prints one")
    return structure.make(document, LaboratoryStatements)
