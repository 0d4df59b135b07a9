"""The one project that a server shows, shared by all tabs."""

from __future__ import annotations

from pretravel.workbench.project import Project


class Session:
    """The project that is open.

    Attributes
    ----------
    project : Project
    """

    def __init__(self) -> None:
        self.project = Project()


SESSION = Session()
"""Of this server."""
