"""A result as a file of values: its report with the command and input files, as JSON.

Such a file is a stranger's: its values are checked when it is read, and its texts are escaped where
they are shown.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pretravel.base import InputError, PretravelError, parsed_json, write_json
from pretravel.show.as_json import (
    document_from_values,
    document_values,
    record_from_values,
    record_values,
)
from pretravel.show.document import Document
from pretravel.show.page_content import TEMPLATES, PageContent
from pretravel.show.work_record import WorkRecord

FORMAT, VERSION = "pretravel result", 1
_MOST_BYTES = 50_000_000


def write_report(
    path: str | Path,
    document: Document,
    *,
    record: WorkRecord | None = None,
    template: str = "page.html",
) -> None:
    """Write a report as values or as a page, whole or not at all.

    Parameters
    ----------
    path : str or Path
        Ending in .json, .html or .pdf.
    document : Document
    record : WorkRecord or None
        The command and its input files.
    template : str
        The form of its page.

    Raises
    ------
    PretravelError
        No program for a PDF was found.
    """
    from pretravel.show.page import write_page

    if Path(path).suffix.lower() == ".json":
        write_json(path, result_values(PageContent(document, record, template=template)))
    else:
        write_page(path, document, record=record, template=template)


def result_values(content: PageContent) -> dict[str, Any]:
    """A result as values for JSON.

    Returns
    -------
    dict
        format, version, template, document, and record where there is one.

    >>> result_values(PageContent(Document("Probe")))["document"]
    {'title': 'Probe'}
    """
    values: dict[str, Any] = {"format": FORMAT, "version": VERSION, "template": content.template}
    values["document"] = document_values(content.document)
    if content.record is not None:
        values["record"] = record_values(content.record)
    return values


def read_result(path: str | Path) -> PageContent:
    """The result that `write_report` wrote as values.

    Parameters
    ----------
    path : str or Path
        Ending in .json.

    Raises
    ------
    InputError
        No such file; a file of another program, or of another version of pretravel; values that
        are not those of a report.
    """
    try:
        content = parsed_json(_content_of(path))
    except PretravelError as error:
        raise InputError(f"its content cannot be used: {error}", path=path) from None
    except ValueError:
        raise InputError(
            "it is not a result of pretravel in JSON: write the result with -o NAME.report.json",
            path=path,
        ) from None
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise InputError(
            "it is not a result of pretravel: write it with -o NAME.report.json",
            path=path,
        )
    if content.get("version") != VERSION:
        raise InputError("it is a result of another version of pretravel", path=path)
    try:
        if content["template"] not in TEMPLATES:
            raise PretravelError("it has another form")
        record = content.get("record")
        return PageContent(
            document_from_values(content["document"]),
            None if record is None else record_from_values(record),
            template=content["template"],
        )
    except (PretravelError, KeyError, TypeError) as error:
        reason = str(error) if isinstance(error, PretravelError) else "a part of it is missing"
        raise InputError(f"its content cannot be used: {reason}", path=path) from None


def _content_of(path: str | Path) -> bytes:
    try:
        with Path(path).open("rb") as file:
            content = file.read(_MOST_BYTES + 1)
        if len(content) > _MOST_BYTES:
            raise InputError(f"results have at most {_MOST_BYTES // 10**6} MB", path=path)
        content.decode("utf-8")
        return content
    except FileNotFoundError:
        raise InputError("there is no such result", path=path) from None
    except UnicodeDecodeError:
        raise InputError("not a text file, so no result", path=path) from None
    except OSError as error:
        raise InputError(f"the result cannot be read: {error.strerror}", path=path) from None
