"""Pictures of every screen, light and dark, on phone, tablet and desktop: screenshots.py FOLDER."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from tests.browser.workbench_server import running_browser, running_workbench, screenshots

PAGES = ("", "help", "engineer", "metrologist", "laboratory", "designer", "part")


def main(folder: Path) -> None:
    """Take the pictures."""
    folder.mkdir(parents=True, exist_ok=True)
    with (
        tempfile.TemporaryDirectory() as data,
        running_workbench(Path(data)) as workbench,
        running_browser() as browser,
    ):
        for name in PAGES:
            screenshots(browser, workbench.address + name, folder, name or "home")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
