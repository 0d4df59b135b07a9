"""Step of the build: the script of Plotly, which pages contain, from its Python package.

The package takes 60 MB, of which a page needs this file alone: the wheel brings the script, and an
installation does without the package. The script and its licence (MIT) are not in the sources.
"""

from __future__ import annotations

import gzip
from importlib.metadata import distribution
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class PlotlyScript(BuildHookInterface):  # type: ignore[type-arg]
    """Writes the compressed script and its licence into the package."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Make the files before the wheel is filled."""
        del version
        folder = Path(self.root) / "src/pretravel/show/scripts"
        folder.mkdir(exist_ok=True)
        package = distribution("plotly")
        for file in package.files or ():
            if str(file).endswith("plotly/package_data/plotly.min.js"):
                content = Path(str(file.locate())).read_bytes()
                compressed = gzip.compress(content, compresslevel=9, mtime=0)
                (folder / "plotly.min.js.gz").write_bytes(compressed)
            if file.name.upper().startswith("LICENSE") and "plotly-" in str(file.parts[0]):
                (folder / "plotly.licence.txt").write_bytes(Path(str(file.locate())).read_bytes())
        build_data["artifacts"].append("src/pretravel/show/scripts/*")
