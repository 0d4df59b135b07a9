"""The script of pages and its licence, from the package plotly; ``make plotly`` runs it."""

from __future__ import annotations

import gzip
from importlib.metadata import distribution
from pathlib import Path

SCRIPTS = Path(__file__).parents[1] / "src" / "pretravel" / "show" / "scripts"


def main() -> None:
    """Write both files."""
    files = {file.name: file for file in distribution("plotly").files or ()}
    script = Path(str(files["plotly.min.js"].locate())).read_bytes()
    licence = Path(str(files["LICENSE.txt"].locate())).read_bytes()
    packed = gzip.compress(script, compresslevel=9, mtime=0)
    (SCRIPTS / "plotly.min.js.gz").write_bytes(packed)
    (SCRIPTS / "plotly.licence.txt").write_bytes(licence)


if __name__ == "__main__":
    main()
