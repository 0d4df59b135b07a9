"""Run a study, or show the results of an earlier one; list the studies of the package."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pretravel.base import PretravelError
from pretravel.task import (
    PAGES,
    SILENT,
    Field,
    Progress,
    Reported,
    Result,
    ShownQuantity,
    Task,
    TextResult,
    existing,
    output,
)

if TYPE_CHECKING:
    from pretravel.design.studies.results import StudyResults
    from pretravel.show import Document
    from pretravel.task import QuantityWord

PAGE = Field(help="A page, .html or .pdf.", writes=PAGES)
"""Of a task whose main output is no page."""


def _is_results(study: str) -> bool:
    return Path(study).suffix.lower() == ".nc"


def _is_study(text: str) -> bool:
    from pretravel.design.studies.definition import STUDIES

    return text in STUDIES.names()


class RunStudy(Reported):
    """Predict many designs of a probe: how results vary, and which parameters decide it.

    A study that was interrupted goes on where it ended when the command is run again.
    """

    name = "study"
    example = "pretravel study preload-and-seats -o study.nc --plot study.png"

    study: Annotated[
        str,
        Field(
            help="Study: .toml, or a name that pretravel studies lists; or results (.nc) to show "
            "again.",
            positional=True,
            metavar="STUDY",
            reads=existing,
            word=_is_study,
        ),
    ]
    output: Annotated[Path | None, output("Results: .nc, which xarray opens.", ".nc")] = None
    workers: Annotated[
        int | None,
        Field(
            help="Processes of this computer; the default is one for each core, and 1 for short "
            "studies. More than 1 needs pretravel[scale].",
            range=(1, 1024),
            only=("output",),
        ),
    ] = None
    scheduler: Annotated[
        str | None,
        Field(
            help="Address of a running Dask scheduler, as tcp://host:8786, whose workers compute.",
            metavar="ADDRESS",
            only=("output",),
            connects=True,
        ),
    ] = None
    restart: Annotated[
        bool,
        Field(help="Start again, also where an earlier run was interrupted.", only=("output",)),
    ] = False
    quantity: ShownQuantity = "pretravel"
    page: Annotated[Path | None, PAGE] = None

    @classmethod
    def needed_outputs(cls, stated: Mapping[str, Any]) -> tuple[str, ...]:
        """The results, which are written while they come; none where they are shown again."""
        return () if _is_results(stated.get("study") or "") else ("output",)

    def run(self, progress: Progress = SILENT) -> FinishedStudy:
        """Run the study and write its results; or read results that were written before."""
        from pretravel.design.studies.definition import load_study
        from pretravel.design.studies.results_file import read_results
        from pretravel.design.studies.run import Workers, run_study

        if self.output is None:
            if not _is_results(self.study):
                raise PretravelError(
                    "a study needs a file for its results: -o study.nc", inputs=("output",)
                )
            return FinishedStudy(read_results(self.study), self.quantity)
        workers = Workers(self.workers, self.scheduler)
        with progress.working("study"):
            run_study(load_study(self.study), self.output, workers, restart=self.restart)
        return FinishedStudy(read_results(self.output), self.quantity)


@dataclass(frozen=True, eq=False)
class FinishedStudy(Result):
    """A study with its results, which are in their file already.

    Attributes
    ----------
    results : StudyResults
    quantity : str
        That the report is about.
    """

    results: StudyResults
    quantity: QuantityWord = "pretravel"

    def document(self) -> Document:
        """The report."""
        from pretravel.design.tasks.study.report import study_document

        return study_document(self.results, self.quantity)

    def write(self, output: str, path: Path) -> None:
        """Nothing: the results are written while they come."""


class Studies(Task):
    """List the studies of the package, or print one as TOML."""

    name = "studies"
    example = "pretravel studies what-matters > mine.toml"

    study: Annotated[
        str | None, Field(help="A study of the package, to print.", positional=True, metavar="NAME")
    ] = None

    def run(self, progress: Progress = SILENT) -> TextResult:
        """The list, or the text of one."""
        del progress
        from pretravel.design.studies.definition import STUDIES, load_study
        from pretravel.design.studies.plan import Plan

        if self.study is not None:
            return TextResult(STUDIES.text(self.study))
        lines = []
        for entry in STUDIES.names():
            found = load_study(entry)
            lines.append(f"{entry:20} {found.name}, {found.plan}, {len(Plan(found))} designs")
        advice = "\npretravel studies NAME > mine.toml prints a study to edit."
        return TextResult("\n".join([*lines, advice, ""]))
