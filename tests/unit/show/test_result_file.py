"""A result as a file of values: it is read back, bound into a page, and checked."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pretravel.show.as_json import document_values
from pretravel.show.chart import Axis, PlaneChart, PolarChart, Scale, SpaceChart, TopView, View
from pretravel.show.chart_marks import (
    Area,
    Bars,
    Dots,
    LineMark,
    Note,
    Rule,
    SpaceArrow,
    SpaceLines,
    SpaceMesh,
    SpaceNotes,
    SpacePoints,
)
from pretravel.show.document import Document, Picture
from pretravel.show.page import LARGEST, contents_text
from pretravel.show.page_content import PageContent
from pretravel.show.result_file import read_result, result_values, write_report
from tests.support.commands import run
from tests.support.pages import ATTACK, attacked_content, plain_content


def _written(path: Path, content: PageContent) -> Path:
    write_report(path, content.document, record=content.record, template=content.template)
    return path


def _every_chart() -> View:
    """All charts with all marks."""
    x, points = np.arange(3.0), np.arange(9.0).reshape(3, 3)
    line, dots = LineMark(x, np.array([0.0, np.nan, 2.0]), "line"), Dots(x, x, u=x, values=x)
    area = Area(x, x, x + 1.0)
    scale = Scale("u", "µm", 0.0, 2.0)
    return View(
        "all",
        (
            PlaneChart(
                "plane",
                Axis("x", low=0.0, ticks=(0.0, 1.0), tick_names=("a", "b")),
                Axis("y"),
                (line, dots, area, Bars(x, x, texts=("1", "2", "3")), Rule(1.0),
                 Note(0.0, 1.0, "n", "limit")),
                scale,
            ),
            PolarChart("polar", Axis("r", "µm"), (line, dots, area, Rule(1.0)), scale=scale),
            TopView("above", np.array([0.0, 90.0]), np.array([0.0, 120.0, 240.0]),
                    np.array([[1.0, 2.0, np.nan], [3.0, 4.0, 5.0]]), scale),
            SpaceChart(
                "space",
                (
                    SpacePoints(points, values=x),
                    SpaceLines(points, points + 1.0),
                    SpaceMesh(points, np.array([[0, 1, 2]])),
                    SpaceArrow(points[0], points[1], "F"),
                    SpaceNotes(points, ("a", "b", "c")),
                ),
                scale=scale,
            ),
        ),
        2,
    )  # fmt: skip


@pytest.mark.long
def test_what_is_read_makes_the_same_page(tmp_path: Path) -> None:
    for name, content in (("plain.json", plain_content()), ("attack.json", attacked_content())):
        found = read_result(_written(tmp_path / name, content))
        assert document_values(found.document) == document_values(content.document)
        assert found.record == content.record
        page = contents_text([PageContent(content.document, content.record)])
        assert contents_text([found]) == page


@pytest.mark.long
def test_every_chart_and_mark_is_read_back(tmp_path: Path) -> None:
    document = Document("Charts", pictures=(Picture("all", _every_chart),))
    found = read_result(_written(tmp_path / "a.json", PageContent(document)))
    assert contents_text([found]) == contents_text([PageContent(document)])
    triangles = found.document.pictures[0].charts[3].marks[2].triangles  # type: ignore[union-attr]
    assert triangles.dtype.kind == "i"


def test_an_attack_is_text_again(tmp_path: Path) -> None:
    content = read_result(_written(tmp_path / "a.json", attacked_content()))
    assert content.document.title == ATTACK
    assert ATTACK not in contents_text([content, content], title=ATTACK)


def test_several_are_bound_with_one_plotly(tmp_path: Path) -> None:
    paths = [_written(tmp_path / name, plain_content(3)) for name in ("a.json", "b.json")]
    run("report", *paths, "-o", tmp_path / "all.html")
    page = (tmp_path / "all.html").read_text(encoding="utf-8")
    assert page.count('id="plotly"') == 1
    assert len(page.encode()) < LARGEST
    assert page.count("a warning</li>") == 2
    assert page.count("data:image/") == 2


def _places(values: Any, key: str) -> list[dict[str, Any]]:
    """The mappings within values that have a key."""
    if isinstance(values, list):
        return [found for part in values for found in _places(part, key)]
    if not isinstance(values, dict):
        return []
    own = [values] if key in values else []
    return own + [found for part in values.values() for found in _places(part, key)]


@pytest.mark.parametrize(
    ("key", "changed", "words"),
    [
        ("verdict", 3, "not those of a report"),
        ("values", ["P3"], "not those of a report"),  # a shorter column
        ("size", 10**400, "not those of a report"),
        ("digits", {"count": 10**9}, "not those of a report"),
        ("format", "other", "not a result of pretravel"),
        ("version", 7, "another version"),
        ("template", "../secret.html", "another form"),
        ("document", 7, "not those of a report"),
        ("view", {"title": "", "charts": []}, "not those of a report"),
        ("charts", [{"kind": "Image"}], "not those of a report"),
        ("columns", 0, "not those of a report"),
        ("colour", "url(https://example.com)", "not those of a report"),
        ("x", [1.0], "not those of a report"),  # a shorter line
        ("y", [[1.0], [2.0], [3.0]], "not those of a report"),
        ("positions", [[1.0, 2.0]], "not those of a report"),
        ("triangles", [[0, 1, 3]], "not those of a report"),
        ("triangles", [[0, 1, 1e999]], "not those of a report"),
        ("polar_deg", [0.0], "not those of a report"),
        ("caption", "\ud800", "not those of a report"),
        ("low", None, "not those of a report"),  # of a scale of colours
        ("azimuth_deg", [0.0, None, 240.0], "a picture of it cannot be drawn"),
    ],
)
def test_a_changed_file_is_refused(tmp_path: Path, key: str, changed: object, words: str) -> None:
    content = plain_content(3)
    pictures = (*content.document.pictures, Picture("all", _every_chart))
    document = Document(
        "Probe", "good", content.document.figures, content.document.tables, pictures=pictures
    )
    values = result_values(PageContent(document, content.record))
    places = _places(values, key)
    if key == "digits":
        places = values["document"]["figures"][:1]
    elif key == "values":
        places = values["document"]["tables"][0]["columns"][:1]
    elif key == "columns":
        places = [values["document"]["pictures"][-1]["view"]]
    places[-1][key] = changed
    path = tmp_path / "a.json"
    path.write_text(json.dumps(values), encoding="utf-8")
    message = run("report", path, "-o", tmp_path / "b.html", code=2)
    assert words in message
    assert "a.json" in message


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[" * 100_000, "too deep"),
        ("<h1>hello</h1>", "not a result of pretravel in JSON"),
        ("[]", "not a result of pretravel"),
        ('{"format": "pretravel result", "version": 1}', "a part of it is missing"),
    ],
)
def test_a_file_of_another_program_is_refused(tmp_path: Path, text: str, words: str) -> None:
    (tmp_path / "a.json").write_text(text, encoding="utf-8")
    assert words in run("report", tmp_path / "a.json", "-o", tmp_path / "b.html", code=2)
