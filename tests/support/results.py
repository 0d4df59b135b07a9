"""Results that commands wrote as values (`-o result.json`)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


def data_of(path: Path) -> dict[str, list[dict[str, Any]]]:
    """The rows of the tables for programs, by their titles."""
    tables = json.loads(path.read_text(encoding="utf-8"))["document"]["data"]
    return {
        table["title"]: [
            dict(zip([column["name"] for column in table["columns"]], row, strict=True))
            for row in zip(*(column["values"] for column in table["columns"]), strict=True)
        ]
        for table in tables
    }
