"""The certificate on paper: nothing that is stated is lost, and nothing of a computer is on it."""

from __future__ import annotations

import html
import re
from dataclasses import replace
from pathlib import Path

import pytest

from pretravel.files.laboratory_statements import (
    ComparedStandards,
    LaboratoryIdentity,
    LaboratoryStatements,
)
from pretravel.show.page import contents_text, page_environment
from pretravel.show.page_content import PageContent
from pretravel.show.result_file import read_result
from tests.support.commands import both_outputs, run
from tests.support.examples import EXAMPLES, SPHERE
from tests.support.laboratory import filled_file, filled_statements
from tests.support.pages import ATTACK, plain_content

RIG = EXAMPLES / "rig"
CHECK = ("check", "iso10360-5", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6)
RIGHT = LaboratoryStatements(
    LaboratoryIdentity("North Ltd, Aberdeen"),
    standards=ComparedStandards(iso_10360_5="edition 2020, A. Lee, 2026-03-02"),
)


def _content(folder: Path, lab: Path | None, *command: object) -> PageContent:
    path = folder / "result.json"
    stated = () if lab is None else ("--lab", lab)
    run(*command, *stated, "-o", path)
    return read_result(path)


def _printed(content: PageContent) -> str:
    """What is on the paper; without its style."""
    page = contents_text([content], scripts=False)
    return page[page.index("<body>") :]


@pytest.mark.long
@pytest.mark.parametrize("command", [CHECK, ("rig", RIG)], ids=lambda command: command[0])
def test_everything_that_is_stated_is_printed(command: tuple[object, ...], tmp_path: Path) -> None:
    """A new field of the laboratory needs a place in the form of the certificate."""
    page = html.unescape(_printed(_content(tmp_path, filled_file(tmp_path), *command)))
    for statement in filled_statements().statements():
        assert statement.text in page
    assert 'class="open"' not in page
    found = "expanded" if "rig" in command else "from run to run"
    order = ["name <of> laboratory", "number <of> certificate", "serial_number <of> item",
             "serial_number <of> reference", "Results", found, "Input files", "Signature",
             "End of certificate"]  # fmt: skip
    places = [page.index(words) for words in order]
    assert places == sorted(places)


@pytest.mark.parametrize(
    ("table", "key", "wrong", "right"),
    [
        ("reference", "description", "Sphere Ø 30 mm", "Sphere Ø 25 mm on a post of 10 mm"),
        ("instrument", "stylus", "M2, 50 mm, tip 4 mm", "M2, 50 mm, ball Ø 6 mm"),
        ("instrument", "stylus", "50 mm, 4 mm ball", "M4, 50 mm"),
    ],
)
def test_statements_that_contradict_what_is_used_are_refused(
    table: str, key: str, wrong: str, right: str, tmp_path: Path
) -> None:
    lab = tmp_path / "lab.toml"
    for text, code in ((wrong, 2), (right, 0)):
        lab.write_text(f'[{table}]\n{key} = "{text}"\n')
        told = run(*CHECK, "--lab", lab, "-o", tmp_path / "result.json", code=code)
        assert (f"it gives '{text}', and" in told) == (code == 2)
    lab.write_text('[reference]\ncertificate = "No. 5, U = 0.8 µm (k = 2)"\n')
    for options, other in (((), "no u of the diameter"), (("--u-diameter", 0.8), "u = 0.8 µm")):
        told = run(*CHECK, "--lab", lab, *options, "-o", tmp_path / "result.json", code=2)
        assert f"(u = 0.4 µm), and {other} is" in told
    run(*CHECK, "--lab", lab, "--u-diameter", 0.4, "-o", tmp_path / "result.json")
    run(*CHECK[:1], "iso230-10", *CHECK[2:], "--lab", lab, "-o", tmp_path / "result.json")
    lab.write_text(
        '[item]\nserial_number = "no. 17"\n[instrument]\nprobe_serial_number = "no. 71"\n'
    )
    assert "the probe 'no. 71'" in run(*CHECK, "--lab", lab, "-o", tmp_path / "r.json", code=2)
    lab.write_text('[conditions]\ntemperature = "23.0 °C, u = 0.5 °C"\n')
    run("rig", RIG, "--temperature", 23, "--lab", lab, "-o", tmp_path / "rig.json")
    told = run("rig", RIG, "--lab", lab, "-o", tmp_path / "rig.json", code=2)
    assert "--temperature" in told


def test_a_reference_in_a_warm_room_is_named(tmp_path: Path) -> None:
    """Steel of 25 mm grows by 2.0 µm from 20 to 27 °C."""
    lab = tmp_path / "lab.toml"
    lab.write_text('[conditions]\ntemperature = "27 °C"\n')
    command = ("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, "--kind", "mean")
    assert "larger by 2.0 µm" in both_outputs(*command, "--lab", lab)[1]
    assert "larger by" not in both_outputs(*command, "--lab", lab, "--u-temperature", 4)[1]
    head, *rows = SPHERE.read_text().splitlines()
    fed = tmp_path / "fed.csv"
    fed.write_text("\n".join([f"{head},feed_mm_min", *(f"{row},500" for row in rows)]))
    for feed, code in ((300, 2), (500, 0)):
        lab.write_text(f'[method]\nfeed = "{feed} mm/min"\n')
        told = run(command[0], fed, *command[2:], "--lab", lab, code=code)
        assert ("it gives '300 mm/min', and 500 is used" in told) == (code == 2)


@pytest.mark.long
def test_no_command_and_no_long_digest_is_printed(tmp_path: Path) -> None:
    content = _content(tmp_path, filled_file(tmp_path), "rig", RIG)
    page = _printed(content)
    assert content.record is not None
    assert "pretravel rig" in content.record.command
    assert "pretravel rig" not in page
    assert not re.search(r"[0-9a-f]{13}", re.sub(r'src="data:.*?"', "", page))
    for file in content.record.inputs:
        name = file.name.rpartition("/")[2]
        assert f'<li>{name} <span class="digest">{file.sha256[:12]}</span></li>' in page
        assert str(tmp_path) not in page


def test_without_a_laboratory_the_pdf_is_the_report(tmp_path: Path) -> None:
    page = _printed(_content(tmp_path, None, *CHECK))
    assert "Settings" in page
    assert "Signature" not in page


def test_texts_of_a_laboratory_stay_texts_also_in_the_style() -> None:
    """Signs that end a string, a style or a rule are escaped; `\\2c ` is a comma."""
    shown = page_environment().filters["style_text"]
    assert shown('a"}</style>, é') == '"a\\22 \\7d \\3c \\2f style\\3e \\2c  \\e9 "'
    document = replace(plain_content().document, title=ATTACK)
    assert "<script>alert" not in contents_text([PageContent(document)], scripts=False)


def test_a_long_table_stands_in_blocks_that_lose_no_row() -> None:
    """60 rows of seven columns: two blocks of 30 on one page; 200 rows: three groups."""
    from pretravel.show.document import Column, Table

    blocks = page_environment().filters["printed_blocks"]
    for rows, sizes in ((19, [[19]]), (60, [[30, 30]]), (200, [[34, 34], [34, 34], [34, 30]])):
        table = Table(tuple(Column.of(str(k), range(rows)) for k in range(7)))
        groups = blocks(table)
        assert [[len(block[0].values) for block in group] for group in groups] == sizes
        values = [v for group in groups for block in group for v in block[-1].values]
        assert values == list(range(rows))
    wide = Table(tuple(Column.of(str(k), range(100)) for k in range(9)))
    assert len(blocks(wide)[0]) == 1


class TestTextsOfStandards:
    """What was not checked is said; a laboratory that owns the text can state its check."""

    def test_by_default_it_is_said_that_nobody_compared(self, tmp_path: Path) -> None:
        shown = _printed(_content(tmp_path, filled_file(tmp_path, LaboratoryStatements()), *CHECK))
        sentence = (
            "were programmed without the text of the standard and were not checked against it."
        )
        assert f"The rules of ISO 10360-5 {sentence}" in shown
        assert "This is not a statement of conformity" in shown
        assert shown.count("without the text of the standard") == 2  # sentence, verdict
        assert shown.count("not checked") == 1 + 2  # sentence, two definitions

    def test_a_laboratory_states_that_it_compared_the_text(self, tmp_path: Path) -> None:
        shown = _printed(_content(tmp_path, filled_file(tmp_path, RIGHT), *CHECK))
        assert "North Ltd declares that it compared what is used here of ISO 10360-5" in shown
        assert "(edition 2020, A. Lee, 2026-03-02)" in shown
        assert "without the text of the standard" not in shown
        assert "This is not a statement of conformity" not in shown

    def test_the_statement_holds_for_its_standard_alone(self, tmp_path: Path) -> None:
        lab = filled_file(tmp_path, RIGHT)
        targets, touches = tmp_path / "t.csv", tmp_path / "s.csv"
        run("pattern", "iso230-10", "--diameter", 25, "-o", targets)
        run("simulate", "omp40-2", "--surface", "sphere:radius=12.5", "--targets", targets,
            "-o", touches)  # fmt: skip
        command = ("check", "iso230-10", touches, "--diameter", 25)
        shown = _printed(_content(tmp_path, lab, *command))
        assert "ISO 230-10 were programmed without the text of the standard" in shown
        assert "This is not a statement of conformity" in shown
