"""What a page contains, and pages that are read back: their reports, records and pictures.

A page is a stranger's file: its values are checked, its texts are escaped again where they are
shown, and nothing of its HTML or its scripts is taken over.
"""

from __future__ import annotations

import base64
import gzip
import io
import json
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

from pretravel.base.errors import InputError, PretravelError
from pretravel.show.as_json import (
    document_from_values,
    document_values,
    record_from_values,
    record_values,
)
from pretravel.show.chart_plotly import plotly_figure
from pretravel.show.document import Document, Picture, Table
from pretravel.show.plotly_parts import SMALL, PlotlyFigure
from pretravel.show.work_record import WorkRecord, inputs_table, settings_table

FORMAT, VERSION = "pretravel page", 1
TEMPLATES = ("page.html", "certificate.html")
"""The forms of a report on a page."""
_MOST_BYTES = 50_000_000
_IMAGES = {
    "data:image/png;base64,": b"\x89PNG\r\n\x1a\n",
    "data:image/webp;base64,": b"WEBP",
}
"""Beginnings of addresses that contain an image, and the marks of its kind."""
_TRACES = frozenset(
    {"bar", "barpolar", "cone", "contour", "heatmap", "mesh3d", "scatter", "scatter3d",
     "scatterpolar", "surface"}
)  # fmt: skip
"""Kinds of traces that a figure of a page may have."""
_DEEPEST = 12
_MARKUP = ("<br>", "<extra></extra>", *SMALL)
"""The HTML in texts of Plotly that charts use."""


@dataclass(frozen=True)
class PageContent:
    """A report on a page.

    Attributes
    ----------
    document : Document
    record : WorkRecord or None
        What was done with what.
    files : tuple of str
        Names of files beside the page.
    template : str
        One of `TEMPLATES`.
    """

    document: Document
    record: WorkRecord | None = None
    files: tuple[str, ...] = ()
    template: str = "page.html"


@dataclass(frozen=True)
class StoredPicture(Picture):
    """A picture of a page that was read.

    Attributes
    ----------
    address : str
        Of the image, which it contains.
    figures : tuple of dict
        For Plotly; empty where the picture cannot be turned.
    """

    address: str = ""
    figures: tuple[PlotlyFigure, ...] = ()


def picture_figures(picture: Picture) -> list[PlotlyFigure]:
    """A picture for Plotly, chart by chart; empty where it has no charts."""
    if isinstance(picture, StoredPicture):
        return list(picture.figures)
    return [plotly_figure(chart) for chart in picture.charts]


def charts_of(picture: Picture) -> int:
    """How many charts a picture shows; 0 where a picture that was read does not say it."""
    if isinstance(picture, StoredPicture):
        return len(picture.figures)
    return len(picture.charts)


def image_address(picture: Picture, *, small: bool = False) -> str:
    """The image of a picture as an address that contains it.

    WebP without losses has half the size of PNG; Pillow, which matplotlib needs, can lack it.

    Parameters
    ----------
    picture : Picture
    small : bool
        With small losses, a third of that size.

    Returns
    -------
    str
    """
    from PIL import Image, features

    if isinstance(picture, StoredPicture):
        return picture.address
    kind, content = "png", picture.png
    if features.check("webp"):
        smaller = io.BytesIO()
        with Image.open(io.BytesIO(content)) as image:
            settings = {"quality": 88} if small else {"lossless": True, "method": 2, "quality": 0}
            image.convert("RGB").save(smaller, "webp", **settings)
        kind, content = "webp", smaller.getvalue()
    return f"data:image/{kind};base64,{base64.b64encode(content).decode()}"


def packed_values(values: Any) -> str:
    """Values as compressed JSON in letters.

    >>> unpacked_values(packed_values({"a": [1.5]}))
    {'a': [1.5]}
    """
    text = json.dumps(values, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    return base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode()


def unpacked_values(packed: str) -> Any:
    """The values of `packed_values`.

    Raises
    ------
    ValueError
        Text that is not of this form, or of more than 50 MB.
    """
    unpacking = zlib.decompressobj(wbits=zlib.MAX_WBITS | 16)
    try:
        text = unpacking.decompress(base64.b64decode(packed, validate=True), _MOST_BYTES)
    except zlib.error as error:
        raise ValueError(str(error)) from error
    if not unpacking.eof:
        raise ValueError("not complete, or too large")
    return json.loads(text)


def picture_name(report: int, picture: int) -> str:
    """The name of a picture within a page.

    >>> picture_name(0, 2)
    'picture-0-2'
    """
    return f"picture-{report}-{picture}"


def content_values(contents: Sequence[PageContent]) -> dict[str, Any]:
    """The content of a page as values for JSON; its tables are also there for its scripts.

    >>> content_values([PageContent(Document("Probe"))])["reports"][0]["document"]
    {'title': 'Probe'}
    """
    return {
        "format": FORMAT,
        "version": VERSION,
        "reports": [_report_values(content) for content in contents],
    }


def _report_values(content: PageContent) -> dict[str, Any]:
    values: dict[str, Any] = {"document": document_values(content.document)}
    values["template"] = content.template
    if content.record is not None:
        values["record"] = record_values(content.record)
        tables = {
            "inputs": inputs_table(content.record.inputs),
            "settings": settings_table(content.record.settings),
        }
        values |= {
            name: _table_values(table) for name, table in tables.items() if table.columns[0].values
        }
    return values


def _table_values(table: Table) -> dict[str, Any]:
    values: dict[str, Any] = document_values(Document("", tables=(table,)))["tables"][0]
    return values


def read_page(path: str | Path) -> tuple[PageContent, ...]:
    """The reports of a page that pretravel wrote.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    tuple of PageContent
        Without links to files beside the page.

    Raises
    ------
    InputError
        No such file; a page of another program, or of another version of pretravel; values that
        are not those of a report.
    """
    parts = _PageParts()
    parts.feed(_text_of(path))
    parts.close()
    try:
        content = json.loads(parts.texts.get("content", "null"))
        packed = parts.texts.get("charts")
        figures = {} if packed is None else unpacked_values(packed.strip())["figures"]
    except (ValueError, RecursionError, KeyError, TypeError):
        raise InputError("its content is not complete: write the page again", path=path) from None
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise InputError(
            "it is no page of pretravel, or one of a version before 0.2: write the page again with "
            "the command that made it",
            path=path,
        )
    if content.get("version") != VERSION:
        raise InputError("it is a page of another version of pretravel", path=path)
    try:
        return tuple(
            _report(values, report, parts.images, figures)
            for report, values in enumerate(content["reports"])
        )
    except (PretravelError, KeyError, TypeError, AttributeError) as error:
        reason = str(error) if isinstance(error, PretravelError) else "a part of it is missing"
        raise InputError(f"its content cannot be used: {reason}", path=path) from None


def _text_of(path: str | Path) -> str:
    try:
        with Path(path).open("rb") as file:
            content = file.read(_MOST_BYTES + 1)
        if len(content) > _MOST_BYTES:
            raise InputError(f"pages have at most {_MOST_BYTES // 10**6} MB", path=path)
        return content.decode("utf-8")
    except FileNotFoundError:
        raise InputError("there is no such page", path=path) from None
    except UnicodeDecodeError:
        raise InputError("not a text file, so not a page", path=path) from None
    except OSError as error:
        raise InputError(f"the page cannot be read: {error.strerror}", path=path) from None


class _PageParts(HTMLParser):
    """The values and images of a page by their names."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.texts: dict[str, str] = {}
        self.images: dict[str, str] = {}
        self._script = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = {name: value or "" for name, value in attrs}
        self._script = ""
        if tag == "img":
            self.images[values.get("id", "")] = values.get("src", "")
        elif tag == "script" and values.get("id") in ("content", "charts"):
            self._script = values["id"]

    def handle_data(self, data: str) -> None:
        if self._script:
            self.texts[self._script] = self.texts.get(self._script, "") + data

    def handle_endtag(self, tag: str) -> None:  # noqa: ARG002
        self._script = ""


def _report(
    values: Mapping[str, Any], report: int, images: Mapping[str, str], figures: Mapping[str, Any]
) -> PageContent:
    document = document_from_values(values["document"])
    names = [picture_name(report, index) for index in range(len(document.pictures))]
    pictures = tuple(
        StoredPicture(
            picture.caption,
            picture.compute,
            _checked_address(images.get(name, "")),
            _checked_figures(figures.get(name, [])),
        )
        for name, picture in zip(names, document.pictures, strict=True)
    )
    record = values.get("record")
    if values["template"] not in TEMPLATES:
        raise PretravelError("it has another form")
    return PageContent(
        replace(document, pictures=pictures),
        None if record is None else record_from_values(record),
        template=values["template"],
    )


def _checked_address(address: str) -> str:
    """An address that contains an image; for a browser alone, nothing here decodes the image."""
    for beginning, mark in _IMAGES.items():
        try:
            content = base64.b64decode(address.removeprefix(beginning), validate=True)
        except ValueError:
            continue
        if address.startswith(beginning) and mark in content[:12]:
            return address
    raise PretravelError("a picture of it is missing, or is neither PNG nor WebP")


def _checked_figures(figures: Any) -> tuple[PlotlyFigure, ...]:
    """Figures for Plotly that contain numbers, plain texts and known kinds of traces alone."""
    if not isinstance(figures, list):
        raise PretravelError("a chart of it has another form")
    for figure in figures:
        if not isinstance(figure, dict) or set(figure) != {"data", "layout"}:
            raise PretravelError("a chart of it has another form")
        kinds = [trace.get("type") for trace in figure["data"] if isinstance(trace, dict)]
        if len(kinds) != len(figure["data"]) or not _TRACES.issuperset(kinds):
            raise PretravelError(f"a chart of it has marks of unknown kinds: {kinds}")
        _check_part(figure, _DEEPEST)
    return tuple(figures)


def _check_part(part: Any, depth: int) -> None:
    if depth == 0:
        raise PretravelError("a chart of it is nested too deeply")
    if isinstance(part, dict):
        if {"images", "source", "src", "updatemenus", "sliders"} & set(part):
            raise PretravelError("a chart of it has images or controls")
        for value in part.values():
            _check_part(value, depth - 1)
    elif isinstance(part, list):
        for value in part:
            _check_part(value, depth - 1)
    elif isinstance(part, str):
        for markup in _MARKUP:
            part = part.replace(markup, "")
        if "<" in part:
            raise PretravelError("a chart of it has a text with HTML")
