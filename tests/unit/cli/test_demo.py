"""pretravel demo: the whole chain on the example data."""

from __future__ import annotations

import re
from base64 import b64decode
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from pretravel.demo import demonstration
from pretravel.demo.demonstration import BEST, KINDS
from pretravel.demo.demonstration_report import DEMONSTRATION_FILES
from pretravel.qualification.qualification import Qualification
from pretravel.touches import Touches
from tests.support.commands import run
from tests.support.examples import EXAMPLES

MEAN_LOSS = 2.0
"""Of 255: a large page stores its pictures with small losses; another picture differs more."""


def _pixels(file: Path | BytesIO) -> np.ndarray:
    with Image.open(file) as image:
        return np.asarray(image.convert("RGB"), dtype=np.float64)


def _compare_quickly(patch: pytest.MonkeyPatch) -> None:
    """Three kinds of map are compared, of which the physical one is fitted as a harmonic one."""
    real = demonstration._qualified

    def quick(touches: Touches, kind: str, **more: bool) -> Qualification:
        main_job = more.get("search_outliers", False)
        return real(touches, kind if main_job or kind != BEST else "harmonic", **more)

    patch.setattr(
        demonstration, "KINDS", {kind: KINDS[kind] for kind in ("mean", "harmonic", BEST)}
    )
    patch.setattr(demonstration, "_qualified", quick)


@pytest.mark.long
@pytest.mark.parametrize("whole", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_demo(whole: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if not whole:
        _compare_quickly(monkeypatch)
    text = run("demo", "--data", EXAMPLES, "-o", tmp_path / "out")
    # One answer, in lines that a terminal shows at once; the page has the rest.
    words = " ".join(text.split())
    assert (
        "with the tip radius alone both are outside, compensated with the map both are inside"
        in words
    )
    assert "bore1 20.0408 20.0102 0.64 bore2 20.0257 19.9951 0.64" in words
    assert len(text.splitlines()) <= 16
    steps = [line[:6] for line in text.splitlines() if " of 4: " in line]
    assert steps == ["1 of 4", "2 of 4", "3 of 4", "4 of 4"]
    made = {path.name for path in (tmp_path / "out").iterdir()}
    pictures = {"bores.png", "qualification.png", "points.png", "compare.png", "kp3_ring.png"}
    assert (
        made == {"index.html", "map.json", "part_points.csv", *pictures} == set(DEMONSTRATION_FILES)
    )
    page = (tmp_path / "out" / "index.html").read_text()
    assert all(name in page for name in pictures)
    assert "harmonic map" in page
    # The headline decides no more than the section of the bores.
    assert "not a statement of conformity" in words
    assert page.count("not a statement of conformity") >= 2
    assert "proven" not in page
    assert page.index("<img") < page.index("The probe, qualified on the sphere")
    assert page.index("Errors of each kind of map") < page.index("SHA-256")
    shown = re.findall(r'<img [^>]*src="data:image/\w+;base64,([^"]*)"', page)
    beside = [tmp_path / "out" / name for name in DEMONSTRATION_FILES if name in pictures]
    for coded, path in zip(shown, beside, strict=True):  # the very pictures that are beside it
        assert np.abs(_pixels(BytesIO(b64decode(coded))) - _pixels(path)).mean() < MEAN_LOSS


def test_demo_keeps_files_of_another_kind(tmp_path: Path) -> None:
    (tmp_path / "part_points.csv").write_bytes(b"\x7fELF\x00")
    assert "part_points.csv" in run("demo", "--data", EXAMPLES, "-o", tmp_path, code=2)
    assert (tmp_path / "part_points.csv").read_bytes() == b"\x7fELF\x00"


def test_demo_elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # the folder of the tests can have a demo-output
    assert "no such folder" in run("demo", "--data", "nowhere", code=2)
