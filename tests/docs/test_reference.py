"""The columns that the reference states are those that the commands write and the readers need."""

from __future__ import annotations

import csv
import fnmatch
from collections.abc import Iterator
from pathlib import Path

import pytest

from docs.generated_reference import END, HERE, RENEWED, columns, csv_files, renewed, toml_keys
from pretravel.laboratory.rig.rig_csv import BUDGET_COLUMNS, COLUMNS, MORE_BUDGET_COLUMNS
from tests.support.commands import run
from tests.support.examples import EXAMPLES
from tests.support.touches_of_days import day_of

SPHERE, RIG = EXAMPLES / "sphere_touches.csv", EXAMPLES / "rig"
REFERENCE = ("--diameter", 24.9987)
WRITTEN: dict[str, tuple[tuple[object, ...], ...]] = {
    "Map": (("qualify", SPHERE, *REFERENCE, "--tip-diameter", 6, "--kind", "harmonic"),),
    "Points": (
        ("compensate", EXAMPLES / "bore_touches.csv", "--map", "map.json"),
        ("compensate", EXAMPLES / "part_touches.csv", "--map", "map.json", "--nominal",
         EXAMPLES / "part.step"),
    ),
    "Features": (("measure", "Points-0.csv", "--feature", "bore", "--select", "bore1*"),),
    "Residuals of features": (
        ("measure", "Points-0.csv", "--feature", "bore", "--select", "bore*", "--group"),
    ),
    "Comparison of corrections": (("compare", "map.json"),),
    "Comparison of two probes": (("compare", "omp40-2", "omp40-2-100mm"),),
    "Radii for a control": (("export", "map.json", "--to", "csv"),),
    "Targets": (
        ("plan-touches", "--map", "map.json", "--count", 5),
        ("pattern", "iso10360-5", "--diameter", 25),
        ("plan", EXAMPLES / "part.step", "--grid", "3x3"),
        ("plan-touches", "--block", 50),
    ),
    "Touches": (
        ("simulate", "omp40-2", "--surface", "sphere:radius=12.5", "--targets", "Targets-1.csv",
         "--feed", 50),
    ),
    "Prediction": (("predict", "omp40-2", "--polar", 90),),
    "Faces of a part": (("faces", EXAMPLES / "part.step"),),
    "Steps of one touch": (("slide", "omp40-2", "--surface", "convex", "--at", "0.5,0.5"),),
    "Cycles with seat friction": (
        ("hysteresis", "omp40-2", "--model", "analytic", "--friction", 0.1, "--azimuth", 0),
    ),
    "Results of a rig": (("rig", RIG), ("rig", RIG, "--probe", "omp40-2")),
    "Readings for a separation": (
        ("separation-plan", "--directions", 6, "--variance", 0.4, "--u-systematic", 0.3),
    ),
    "Machine and probe, separated": (("separate", EXAMPLES / "redundancy_24x24.csv"),),
    "Figures of a standard": (
        ("check", "iso10360-5", SPHERE, *REFERENCE, "--tip-diameter", 5.967),
    ),
    "History of a probe": (("history", "probe.jsonl"),),
    "Repeated touches": (("repeat", "octoprint.log"),),
    "Rotary axis": (("axis", EXAMPLES / "axis_touches.csv", "--axis", "C"),),
    "Terms of machine and probe": (
        ("qualify", EXAMPLES / "block_touches.csv", "--block", "25.4,50.8,76.2"),
    ),
    "Drift over days": (("history", "logs", "--map", "map.json", *REFERENCE, "--limit", 2),),
}  # fmt: skip
"""Commands by the kind of file that they write; later ones read the files of earlier ones."""
OPTIONS = {"Residuals of features": "--residuals"}
"""Options that name the written file, where it is not -o."""
NOT_WRITTEN_HERE = {
    "Trace of a rig": "read alone",
    "Budget of a rig": "read alone",
    "Check of a ruler": "read alone",
    "Measured trigger forces": "read alone",
    "Results of features": "the print-outs of controls: tests/unit/files",
}
ELSEWHERE = {
    "Touches": {"spindle_deg", "reference", "tip", "part", "pass", "orientation"},
    "Points": {"face", "files"},  # of a part: align; of several files
    "Faces of a part": {"part"},
    "Steps of one touch": {"applied_force_N"},
    "Drift over days": {"unseen_turn_deg"},  # of days with few azimuths
}
"""Columns that no command of this test writes."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    place = tmp_path_factory.mktemp("columns")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(place)
        harmonic = ("--tip-diameter", 6, "--kind", "harmonic")
        run("qualify", SPHERE, *REFERENCE, *harmonic, "-o", "map.json")
        heights = "".join(f"// probe at 5.0,5.0 is z={1.32 + 0.001 * (i % 3)}\n" for i in range(9))
        Path("octoprint.log").write_text(heights)
        run("verify", day_of(place, 1), "--map", "map.json", *REFERENCE, "--history", "probe.jsonl")
        run("pattern", "iso10360-5", "--diameter", 24.9987, "-o", "targets.csv")
        Path("logs").mkdir()
        sphere = ("map.json", "--surface", "sphere:radius=12.49935", "--targets", "targets.csv")
        for day in (1, 2, 3):
            day_file = f"logs/2026-03-0{day}.csv"
            run("simulate", *sphere, "--noise", 0.3, "--seed", day, "-o", day_file)
        for kind, commands in WRITTEN.items():
            for number, command in enumerate(commands):
                run(*command, OPTIONS.get(kind, "-o"), f"{kind}-{number}.csv")
        yield place


def _header(path: Path) -> list[str]:
    with path.open(encoding="utf-8", newline="") as stream:
        return next(csv.reader(stream))


@pytest.mark.parametrize("file", csv_files(), ids=lambda file: str(file["title"]))
def test_columns(file: dict[str, dict[str, str]], folder: Path) -> None:
    title, stated = str(file["title"]), set(file["columns"])
    if title in NOT_WRITTEN_HERE:
        return
    paths = [folder / f"{title}-{number}.csv" for number in range(len(WRITTEN[title]))]
    headers = [_header(path) for path in paths]
    for header in headers:
        unknown = [n for n in header if not any(fnmatch.fnmatchcase(n, s) for s in stated)]
        assert unknown == []
    found = {name for header in headers for name in header}
    never = {s for s in stated if not any(fnmatch.fnmatchcase(n, s) for n in found)}
    assert never == ELSEWHERE.get(title, set())


def test_columns_that_are_read() -> None:
    by_title = {file["title"]: file["columns"] for file in csv_files()}
    assert tuple(by_title["Trace of a rig"]) == COLUMNS
    assert tuple(by_title["Budget of a rig"]) == (*BUDGET_COLUMNS, *MORE_BUDGET_COLUMNS)
    assert _header(EXAMPLES / "rig_budget.csv") == [*BUDGET_COLUMNS]


def test_every_kind_of_file_is_tried() -> None:
    assert {file["title"] for file in csv_files()} == {*WRITTEN, *NOT_WRITTEN_HERE}


def test_a_key_has_its_unit_and_its_usual_value() -> None:
    """The lengths inside are in mm; the keys of a description and a study state µm."""
    assert "| `noise_um` | number | 0.3 |" in toml_keys("conditions")
    assert "| `tip_diameter_mm` | number | needed |" in toml_keys("machine")


@pytest.mark.parametrize("page", RENEWED, ids=[page.stem for page in RENEWED])
def test_a_page_is_whole_in_the_repository(page: Path) -> None:
    """`python -m docs.generated_reference` renews it."""
    text = page.read_text("utf-8")
    assert END in text
    assert renewed(text) == text


@pytest.mark.parametrize(
    ("page", "source"), [("csv-columns", "columns.toml"), ("toml-files", "toml_keys.toml")]
)
def test_pages_of_the_site_lead_to_what_they_are_made_from(page: str, source: str) -> None:
    """Who reads them in the repository finds the meanings there."""
    assert f"]({source})" in (HERE / "reference" / f"{page}.md").read_text("utf-8")
    assert (HERE / "reference" / source).is_file()


def test_columns_of_one_meaning_share_a_row() -> None:
    assert "| `x_mm`, `y_mm`, `z_mm` | tip centre" in columns("")


def test_a_part_without_an_end_is_made_for_the_site_alone() -> None:
    alone = "<!-- generated: commands Start -->"
    both = f"{alone}\n\n<!-- generated: materials -->\nold\n{END}\n"
    assert renewed(both).startswith(f"{alone}\n\n<!-- generated: materials -->\n\n| name |")
    assert "old" not in renewed(both)
