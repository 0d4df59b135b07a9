"""The example data, which the package brings: for the demonstration and the workbench."""

from __future__ import annotations

from pathlib import Path

import pretravel
from pretravel.base import PretravelError


def example_folder() -> Path:
    """The folder with the example data.

    Raises
    ------
    PretravelError
        The package was installed without it.

    >>> (example_folder() / "sphere_touches.csv").exists()
    True
    """
    package = Path(pretravel.__file__).parent
    # A wheel has it in the package; a checkout in examples/data.
    for folder in (package / "example_data", package.parents[1] / "examples" / "data"):
        if (folder / "sphere_touches.csv").exists():
            return folder
    raise PretravelError(
        "the example data are not there: install pretravel from its wheel or work in its checkout"
    )
