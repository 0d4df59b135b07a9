"""A button that gives a result as a page, with its command and input files."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

from nicegui import ui

from pretravel.app.components.downloads import prepared_button
from pretravel.app.jobs import Finished, Job, Made, Work
from pretravel.app.project import OF_ALL_SCREENS
from pretravel.show import Document, InputFile, StatedSetting, WorkRecord, record_now, write_report

CERTIFICATES = {"certificate.pdf": "Certificate (PDF)", "certificate.html": "Certificate (page)"}
"""Files of a certificate, with the words on their buttons."""


def page_button(
    work: Work[Made],
    document: Callable[[Made], Document | None],
    command: Callable[[Made], str],
    *,
    name: str = "report.html",
    label: str = "Page",
    template: str = "page.html",
) -> ui.button:
    """A button that gives a report as a page, a PDF, or its values (.json): to keep or to send.

    Parameters
    ----------
    work : Work
        Whose newest result is reported, with the files and settings of that result.
    document, command : callable
        Take the result; the command does the same.
    name, label : str
        Of the file, and on the button.
    template : str
        The form of the page.
    """

    async def newest() -> Callable[[Path], object]:
        finished = await work.finished()

        def write(path: Path) -> None:
            record = work_record(work.job, finished, command(finished.result))
            report = document(finished.result)
            assert report is not None  # a button stands where there is one
            write_report(path, report, record=record, template=template)

        return write

    return prepared_button(label, name, newest)


def work_record(job: Job[Made], finished: Finished[Made], command: str) -> WorkRecord:
    """The files with their checksums, and the settings, that a result was computed from."""
    inputs = [
        InputFile(purpose, file.name, len(file.content), hashlib.sha256(file.content).hexdigest())
        for purpose in dict.fromkeys((*job.needs, *job.files))
        for file in finished.files[purpose]
    ]
    settings = [
        StatedSetting(name.replace("_", " "), str(finished.settings[name]), given=True)
        for name in job.settings
        if name in finished.settings and name not in OF_ALL_SCREENS
    ]
    return record_now(command, inputs, settings)
