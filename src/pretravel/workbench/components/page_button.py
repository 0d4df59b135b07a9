"""A button that gives a result as a page, with what was done with what."""

from __future__ import annotations

import hashlib

from nicegui import ui

from pretravel.report.document import Document
from pretravel.report.page import write_page
from pretravel.report.work_record import InputFile, Setting, WorkRecord, record_now
from pretravel.workbench.components.downloads import download_button
from pretravel.workbench.project import ScreenState
from pretravel.workbench.tasks import Task


def page_button(
    state: ScreenState,
    task: Task,
    document: Document,
    *,
    command: str,
    name: str = "report.html",
    label: str = "Page",
    template: str = "page.html",
) -> ui.button:
    """A button that gives a report as a page, to keep, to print or to send.

    Parameters
    ----------
    state : ScreenState
    task : Task
        Whose files and settings the record lists.
    document : Document
    command : str
        That does the same.
    name, label : str
        Of the file, and on the button.
    template : str
        A name of `write_page`.
    """
    record = work_record(state, task, command)
    return download_button(
        label, name, lambda path: write_page(path, document, record=record, template=template)
    )


def work_record(state: ScreenState, task: Task, command: str) -> WorkRecord:
    """The files with their checksums, and the settings, that a task used."""
    inputs = [
        InputFile(purpose, file.name, len(file.content), hashlib.sha256(file.content).hexdigest())
        for purpose in dict.fromkeys((*task.needs, *task.files))
        for file in state.files[purpose]
    ]
    settings = [
        Setting(name.replace("_", " "), str(state.settings[name]), given=True)
        for name in task.settings
        if name in state.settings
    ]
    return record_now(command, inputs, settings)
