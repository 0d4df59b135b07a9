"""Run a study, or show the results of an earlier one: a file to results and a report."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pretravel.show.document import Document
from pretravel.studies.definition import load_study
from pretravel.studies.results import StudyResults
from pretravel.studies.results_file import read_results
from pretravel.studies.run import Workers, run_study
from pretravel.tasks.reports.study_report import study_document


@dataclass(frozen=True, eq=False)
class FinishedStudy:
    """A study with its results.

    Attributes
    ----------
    results : StudyResults
    """

    results: StudyResults

    def document(self) -> Document:
        """The report."""
        return study_document(self.results)


def run_or_read(
    study: str,
    output: Path | None,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    restart: bool = False,
) -> FinishedStudy:
    """Run a study and write its results, or read results that were written before.

    Parameters
    ----------
    study : str
        Name of a study of the package, path of a study (.toml) or of results (.nc).
    output : Path or None
        Of the results; None where they are read.
    workers : int, optional
        Processes of this computer.
    scheduler : str, optional
        Address of a running scheduler.
    restart : bool
        Whether what an interrupted run left is removed.

    Returns
    -------
    FinishedStudy

    Raises
    ------
    PretravelError
        See `pretravel.studies.run.run_study`.
    """
    if output is None:
        return FinishedStudy(read_results(study))
    return FinishedStudy(
        run_study(load_study(study), output, Workers(workers, scheduler), restart=restart)
    )
