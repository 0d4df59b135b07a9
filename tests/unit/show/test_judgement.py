"""What a report decides, in a word: in its values, on its page, and for the right reason."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import from_angles, sphere_pattern_25
from pretravel.base.units import DEGREE
from pretravel.maps.kinds.harmonic import HarmonicBasis
from pretravel.qualification.qualifying import qualify
from pretravel.show.document import Document, Judgement
from pretravel.show.page import page_text
from pretravel.show.result_file import read_result
from pretravel.tasks.qualify.summary import judgement, map_span
from pretravel.touches import Touches
from tests.support.commands import run
from tests.support.example_maps import made_up_map
from tests.support.examples import SPHERE
from tests.support.touches_of_days import day_of


@pytest.mark.parametrize(
    ("scatter_um", "repeats", "grade", "expected", "next_step"),
    [
        (0.3, 3, "good", ("good", "Good"), ""),
        (0.9, 3, "usable", ("caution", "Usable"), ""),
        (2.5, 3, "poor", ("bad", "Poor"), "find out why touches scatter"),
        (0.3, 1, None, ("caution", "Not known"), ""),  # nothing was touched twice
        (2.5, 1, None, ("caution", "Not known"), "touch each direction three times"),
    ],
)
def test_of_a_probe(
    scatter_um: float,
    repeats: int,
    grade: str | None,
    expected: tuple[str, str],
    next_step: str,
) -> None:
    normals = np.repeat(sphere_pattern_25(), repeats, axis=0)
    noise = 1e-3 * scatter_um * np.random.default_rng(2).standard_normal(len(normals))
    touches = Touches(normals * (15.49 + noise)[:, None], normals)
    found = qualify(touches, 25.0, tip_diameter=6.0, kind="mean")
    assert found.grade == grade
    assert judgement(found) == Judgement(*expected)
    assert found.next_step.startswith(next_step)
    assert bool(found.next_step) == bool(next_step)


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
    run("verify", day_of(tmp_path, 1), "--map", probe_map, "--diameter", 24.9987 - moved_mm,
        "-o", made, code=code)  # fmt: skip
    assert read_result(made).document.judgement == Judgement(*expected)


def test_a_page_shows_word_and_colour() -> None:
    document = Document("Form", "The form exceeds its limit", judgement=Judgement("bad", "Exceeds"))
    html = page_text(document)
    assert '<p class="verdict bad"><strong class="judgement">Exceeds</strong>' in html
    assert 'class="judgement"' not in page_text(replace(document, judgement=None))


def test_the_smallest_pretravel_lies_between_the_directions_of_the_report() -> None:
    """Two pits at a polar angle of acos(1/√3): the directions spread over the map are some degrees
    apart and miss them. The steps of the search end at 0.02°, which leaves a millionth."""
    terms = np.array([[0, 0], [3, 2]])
    made = made_up_map(HarmonicBasis(terms), coefficients=np.array([0.010, 0.001]))
    truth = made.pretravel(from_angles(np.arccos(1 / np.sqrt(3.0)), np.array([90 * DEGREE])))
    spread = made.over_support()[1].min()
    assert spread > truth[0] * (1.0 + 1e-3)
    assert map_span(made).low == pytest.approx(truth[0] * 1e3, rel=1e-6)
