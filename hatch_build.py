"""Steps of the build: links of the README that hold everywhere, and the script of Plotly.

Plotly's package takes 60 MB, of which a page needs one file: the wheel brings this script, and an
installation does without the package. The script and its licence (MIT) are not in the sources.
"""

from __future__ import annotations

import gzip
import re
from importlib.metadata import distribution
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from hatchling.metadata.plugin.interface import MetadataHookInterface


class Links(MetadataHookInterface):
    """Addresses of the project, and its README with whole addresses."""

    def update(self, metadata: dict[str, Any]) -> None:
        """State both, for the version that is built."""
        home, version = self.config["home"], metadata["version"]
        metadata["urls"] = {
            "Documentation": f"{home}/blob/v{version}/docs/index.md",
            "Source": home,
            "Issues": f"{home}/issues",
            "Changelog": f"{home}/blob/v{version}/CHANGELOG.md",
        }
        text = (Path(self.root) / "README.md").read_text("utf-8")
        for mark, folder in (("!", "raw"), ("(?<!!)", "blob")):
            text = re.sub(
                rf"({mark}\[[^]]*\])\((?!https?:|#)([^)]+)\)",
                rf"\1({home}/{folder}/v{version}/\2)",
                text,
            )
        metadata["readme"] = {"content-type": "text/markdown", "text": text}


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
