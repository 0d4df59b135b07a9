"""What a report decides, in a word: in its values, on its page, and for the right reason."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from pretravel.show.document import Document, Judgement
from pretravel.show.page import page_text
from pretravel.show.result_file import read_result
from pretravel.tasks.qualify.summary import judgement
from tests.support.commands import run
from tests.support.examples import SPHERE


@pytest.mark.parametrize(
    ("scatter_mm", "dof", "expected"),
    [
        (0.3e-3, 50.0, ("good", "Good")),
        (1.0e-3, 50.0, ("caution", "Usable")),
        (2.0e-3, 50.0, ("bad", "Poor")),
        (0.3e-3, 0.0, ("caution", "Not known")),  # nothing was touched twice
    ],
)
def test_of_a_probe(scatter_mm: float, dof: float, expected: tuple[str, str]) -> None:
    result = SimpleNamespace(
        pretravel_map=SimpleNamespace(single_touch=scatter_mm),
        fit=SimpleNamespace(observation=SimpleNamespace(repeats=SimpleNamespace(dof=dof))),
        effects=SimpleNamespace(step=0.0),
        repeatability=scatter_mm,
        copies=0,
    )
    assert judgement(result) == Judgement(*expected)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("form_limit", "code", "expected"),
    [(100, 0, ("good", "Within the limits")), (0.1, 3, ("bad", "Exceeds the limit"))],
)
def test_of_a_standard(
    tmp_path: Path, form_limit: float, code: int, expected: tuple[str, str]
) -> None:
    targets, touches, made = tmp_path / "t.csv", tmp_path / "s.csv", tmp_path / "check.json"
    run("pattern", "iso10360-5", "--diameter", 25, "-o", targets)
    run("simulate", "omp40-2", "--surface", "sphere:radius=12.5", "--targets", targets,
        "-o", touches)  # fmt: skip
    run("check", "iso10360-5", touches, "--diameter", 25, "--tip-diameter", 6, "--form-limit",
        form_limit, "-o", made, code=code)  # fmt: skip
    assert read_result(made).document.judgement == Judgement(*expected)


@pytest.mark.parametrize(
    ("moved_mm", "code", "expected"),
    [(0.0, 0, ("good", "No change found")), (0.02, 3, ("bad", "Changed"))],
)
def test_of_a_verification(
    tmp_path: Path, moved_mm: float, code: int, expected: tuple[str, str]
) -> None:
    """Touches of another sphere, which is larger: as if the pretravel had changed everywhere."""
    probe_map, made = tmp_path / "map.json", tmp_path / "verified.json"
    run("qualify", SPHERE, "--diameter", 24.9987, "--tip-diameter", 6, "--kind", "harmonic",
        "-o", probe_map)  # fmt: skip
    run("verify", SPHERE, "--map", probe_map, "--diameter", 24.9987 - moved_mm, "-o", made,
        code=code)  # fmt: skip
    assert read_result(made).document.judgement == Judgement(*expected)


def test_a_page_shows_word_and_colour() -> None:
    document = Document("Form", "The form exceeds its limit", judgement=Judgement("bad", "Exceeds"))
    html = page_text(document)
    assert '<p class="verdict bad"><strong class="judgement">Exceeds</strong>' in html
    assert 'class="judgement"' not in page_text(replace(document, judgement=None))
