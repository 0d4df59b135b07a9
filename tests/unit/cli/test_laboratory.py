"""The statements of a laboratory: its file, and --lab of the commands whose reports it keeps."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from pretravel.files.laboratory_file import read_laboratory
from tests.support.commands import both_outputs, run
from tests.support.example_maps import example_map
from tests.support.examples import EXAMPLES, SPHERE
from tests.support.feature_points import around

RIG = sorted((EXAMPLES / "rig").glob("*.csv"))
STATED = {
    "[laboratory]\nname": "Shop <A> & sons",
    "machine_serial_number": "M-17",
    "probe_serial_number": "P-4711",
    "stylus_serial_number": "S-3",
    "operator": "J. Doe",
    "temperature": "20.1 °C, U = 0.2 °C",
}
"""What the filled-in file states. All other fields are open."""


@pytest.fixture(scope="module")
def lab(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The template, filled in with `STATED`."""
    text = run("laboratory")
    lines = []
    table = ""
    for line in text.splitlines():
        table = line.split("]")[0] + "]" if line.startswith("[") else table
        key = line.split(" = ")[0]
        stated = STATED.get(f"{table}\n{key}", STATED.get(key))
        lines.append(line if stated is None else line.replace('""', f'"{stated}"'))
    path = tmp_path_factory.mktemp("lab") / "lab.toml"
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def points(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from pretravel.files.points_writing import write_points
    from pretravel.measurement.compensation import apply, embed

    outward, _ = around(12)
    path = tmp_path_factory.mktemp("points") / "points.csv"
    write_points(path, apply(embed(10.0 * outward, -outward, example_map()), example_map()))
    return path


def _command(name: str, points: Path) -> list[object]:
    return {
        "qualify": ["qualify", SPHERE, "--diameter", 24.9987, "--kind", "mean"],
        "check": ["check", "iso10360-5", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6],
        "measure": ["measure", points, "--feature", "bore"],
        "separate": [
            "separate", EXAMPLES / "redundancy_24x24.csv", "--method", "least-squares",
        ],
        "rig": ["rig", *RIG],
    }[name]  # fmt: skip


COMMANDS = ("qualify", "check", "measure", "separate", "rig")


@pytest.mark.long
@pytest.mark.parametrize("name", COMMANDS)
def test_a_page_contains_what_the_laboratory_states(
    name: str, lab: Path, points: Path, tmp_path: Path
) -> None:
    page = tmp_path / "page.html"
    run(*_command(name, points), "--lab", lab, "-o", page)
    text = page.read_text(encoding="utf-8")
    for words in ("Shop &lt;A&gt; &amp; sons", "M-17", "P-4711", "S-3", "J. Doe", "20.1 °C"):
        assert words in text
    assert "<A>" not in text
    if name != "rig":  # a certificate has headings of its own
        assert "Laboratory and instrument" in text
        after = text[text.index("Serial number of the reference") :]
        assert "not stated" in after[: after.index("</tr>")]


@pytest.mark.long
@pytest.mark.parametrize("name", ["qualify", "measure"])
def test_a_page_without_statements_says_so(name: str, points: Path, tmp_path: Path) -> None:
    page = tmp_path / "page.html"
    run(*_command(name, points), "-o", page)
    text = page.read_text(encoding="utf-8")
    section = text[text.index("Laboratory and instrument") :]
    for table in ("instrument", "reference", "conditions"):
        row = section[section.index(f'<th scope="row">{table}</th>') :]
        assert "not stated" in row[: row.index("</tr>")]


@pytest.mark.parametrize("name", ["check", "measure", "separate", "rig"])
def test_json_contains_what_the_laboratory_states(
    name: str, lab: Path, points: Path, tmp_path: Path
) -> None:
    out = tmp_path / "result.json"
    run(*_command(name, points), "--lab", lab, "-o", out)
    sections = json.loads(out.read_text(encoding="utf-8"))["document"]["sections"]
    stated = {f["name"]: f["value"] for part in sections for f in part.get("figures", ())}
    assert stated["Serial number of the probe"] == "P-4711"
    if name != "rig":  # a certificate states the item and the method instead
        assert stated["Serial number of the reference"] == "not stated"


@pytest.mark.long
@pytest.mark.parametrize("name", COMMANDS)
def test_what_no_output_contains_is_warned_of(name: str, lab: Path, points: Path) -> None:
    warned = both_outputs(*_command(name, points), "--lab", lab)[1]
    assert "lab.toml was given, but is not shown" in warned
    shown, warned = both_outputs(*_command(name, points), "--lab", lab, "--verbose")
    assert "P-4711" in shown
    assert "lab.toml" not in warned


def test_a_table_of_results_is_told_apart_from_a_page(lab: Path, tmp_path: Path) -> None:
    out = tmp_path / "map.json"
    warned = both_outputs(*_command("qualify", out), "--lab", lab, "-o", out)[1]
    assert "map.json does not contain what lab.toml gives" in warned


@pytest.mark.parametrize("name", COMMANDS)
def test_the_file_is_not_overwritten(name: str, lab: Path, points: Path, tmp_path: Path) -> None:
    copy = tmp_path / "lab.png"
    copy.write_bytes(lab.read_bytes())
    text = run(*_command(name, points), "--lab", copy, "--plot", copy, code=2)
    assert "this file is also read" in text
    assert copy.read_bytes() == lab.read_bytes()


def test_files_of_earlier_versions_are_read(tmp_path: Path) -> None:
    """A file with the fields of a certificate alone; what it states of the item is not lost."""
    path = tmp_path / "lab.toml"
    path.write_text(
        '[laboratory]\nname = "Lab"\n[item]\nserial_number = 17\n[conditions]\nhumidity = "45 %"\n',
        encoding="utf-8",
    )
    statements = list(read_laboratory(path).of_report())
    values = {(each.table, each.key): each.text for each in statements}
    assert values["laboratory", "name"] == "Lab"
    assert [key for key in values if key[0] == "item"] == [("item", "serial_number")]
    assert values["item", "serial_number"] == "17"
    assert values["conditions", "temperature"] == ""
    assert values["conditions", "humidity"] == "45 %"
    assert "customer" not in {table for table, _ in values}


@pytest.mark.long
def test_a_complete_certificate_stays_complete(tmp_path: Path) -> None:
    """Instrument and operator are not fields that a certificate needs: none is counted open."""
    lines = run("laboratory").split("[instrument]")[0].replace('""', '"x"')
    path = tmp_path / "lab.toml"
    path.write_text(lines, encoding="utf-8")
    page = tmp_path / "certificate.html"
    warned = both_outputs("rig", *RIG, "--lab", path, "-o", page)[1]
    assert "not stated" not in warned
    assert "not stated" not in page.read_text(encoding="utf-8")
