"""A document on a terminal, on a page and as JSON."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.show.as_json import document_values
from pretravel.show.chart import Axis, PlaneChart, View
from pretravel.show.chart_marks import LineMark
from pretravel.show.document import (
    Column,
    Document,
    KeyFigure,
    Picture,
    Section,
    Span,
    Table,
)
from pretravel.show.formatting import decimals, signed_decimals
from pretravel.show.page import page_text, write_page
from pretravel.show.terminal import terminal_text

DOCUMENT = Document(
    title="<b>Probe</b> & more",
    verdict="It conforms.",
    figures=(
        KeyFigure("centre", (1.0, -0.000001), "mm", decimals(3), (0.1, 0.2), "µm", decimals(2)),
        KeyFigure("pretravel", Span(1.0, 2.5), "µm"),
        KeyFigure("residuals", 0.25, "µm", detail=True),
    ),
    tables=(
        Table(
            (
                Column.of("name", ["a", "b"]),
                Column.of("change", np.array([1.0, math.nan]), "µm", signed_decimals(1)),
            ),
            title="Changes",
            explanation="change: since yesterday.",
        ),
    ),
    sections=(Section("Details", ("A paragraph.",), detail=True),),
    notes=("a note",),
    warnings=("a warning <script>",),
)


class TestTerminal:
    def test_verdict_and_key_figures_come_first_and_the_details_only_when_asked_for(self) -> None:
        short, full = (terminal_text(DOCUMENT, verbose=verbose) for verbose in (False, True))
        assert short.splitlines()[:3] == [
            "It conforms.",
            "  centre             (1.000, 0.000) mm, u = (0.10, 0.20) µm",
            "  pretravel          1.00 to 2.50 µm",
        ]
        for words in ("residuals", "since yesterday", "A paragraph."):
            assert words not in short
            assert words in full
        assert "Note: a note" in short

    def test_a_table_has_empty_cells_where_nothing_is_known(self) -> None:
        lines = terminal_text(DOCUMENT).splitlines()
        start = lines.index("Changes")
        assert lines[start + 1 : start + 4] == ["name  change/µm", "a          +1.0", "b"]

    def test_warnings_are_left_to_stderr(self) -> None:
        assert "a warning" not in terminal_text(DOCUMENT, verbose=True)


class TestPage:
    def test_text_is_escaped(self) -> None:
        page = page_text(DOCUMENT)
        assert "<h1>&lt;b&gt;Probe&lt;/b&gt; &amp; more</h1>" in page
        assert "<li><strong>Warning:</strong> a warning &lt;script&gt;</li>" in page
        assert "a warning <script>" not in page

    @pytest.mark.parametrize("name", ['a"b.csv', "a b&c.csv", "javascript:alert(1)", "<x>.csv"])
    def test_the_address_of_a_link_is_escaped(self, name: str) -> None:
        page = page_text(DOCUMENT, files=[name])
        address = page.split('<a href="')[1].split('"')[0]
        assert not set('<>"&: ') & set(address)
        assert "javascript:" not in address

    def test_it_has_the_details_and_the_pictures_in_one_file(self, tmp_path: Path) -> None:
        drawn = []

        def compute() -> View:
            drawn.append(True)
            line = LineMark(np.arange(2.0), np.arange(2.0))
            return View("it", (PlaneChart("it", Axis("x"), Axis("y"), (line,)),))

        document = Document("Probe", pictures=(Picture('of "it"', compute),))
        assert not drawn
        write_page(tmp_path / "page.html", document)
        page = (tmp_path / "page.html").read_text(encoding="utf-8")
        assert 'src="data:image/' in page
        assert 'alt="of &#34;it&#34;"' in page
        assert '<td class="number">0.25</td>' in page_text(DOCUMENT)


def test_json_has_numbers_not_text() -> None:
    values = json.loads(json.dumps(document_values(DOCUMENT), allow_nan=False))
    assert values["figures"][0]["value"] == [1.0, -1e-06]
    assert values["figures"][1]["value"] == {"low": 1.0, "high": 2.5}
    assert values["tables"][0]["columns"][1]["values"] == [1.0, None]
    assert values["warnings"] == ["a warning <script>"]


def test_values_for_programs_are_in_json_alone() -> None:
    data = (Table.of({"trace": ["secret"], "r0_mm": np.array([1.25]), "count": [3]}, "Touches"),)
    document = replace(DOCUMENT, data=data)
    assert document_values(document)["data"][0]["columns"][2] == {"name": "count", "values": [3.0]}
    assert terminal_text(document, verbose=True) == terminal_text(DOCUMENT, verbose=True)
    assert page_text(document) == page_text(DOCUMENT)
