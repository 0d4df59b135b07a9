"""A description of a probe in a project: it names no file of the computer that opens it."""

from __future__ import annotations

from pathlib import Path

from pretravel.base.errors import PretravelError
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.description import Probe


def own_description(path: Path) -> Probe:
    """Read the description of a probe that is a file of a project.

    Parameters
    ----------
    path : Path

    Raises
    ------
    PretravelError
        It is no description, or it takes its solids from another file. A project can come from a
        stranger, and a path in it would be one on this computer.
    """
    probe = load_probe(path)
    if probe.step is not None:
        raise PretravelError(
            f"{path.name}: the description takes its solids from {probe.step.path.name}, and a "
            "project has no file beside a description: leave out the table [geometry], or use "
            "pretravel on the command line"
        )
    return probe
