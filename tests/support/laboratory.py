"""A laboratory that states everything, each field in words of its own."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path

from pretravel.files.laboratory_file import laboratory_template
from pretravel.files.laboratory_statements import LaboratoryStatements


def filled_statements() -> LaboratoryStatements:
    """Every field: its key and its table, such as "serial number <of> item"."""
    empty = LaboratoryStatements()
    tables = {}
    for table in fields(empty):
        part = getattr(empty, table.name)
        texts = {key.name: f"{key.name} <of> {table.name}" for key in fields(part)}
        tables[table.name] = replace(part, **texts)
    return replace(empty, **tables)


def filled_file(folder: Path, statements: LaboratoryStatements | None = None) -> Path:
    """The file of this laboratory, or of another one."""
    path = folder / "laboratory.toml"
    text = laboratory_template(filled_statements() if statements is None else statements)
    path.write_text(text, encoding="utf-8")
    return path
