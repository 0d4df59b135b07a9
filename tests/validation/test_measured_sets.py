"""Every measured set has the form that its README states, and agrees with its answer."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pretravel import qualify
from pretravel.files.touches_csv import read_touches, write_touches
from pretravel.touches import Touches
from tests.support.reference_touches import sphere_touches

MEASURED = Path(__file__).parents[1] / "data/measured"
LINES = ("Licence:", "Instrument:", "Reference:", "Measured:", "Answer:")
LICENCES = ("CC0", "CC BY")


def complaints(folder: Path) -> list[str]:
    """What a set lacks."""
    needed = ("README.md", "touches.csv", "description.json", "answer.json")
    found = [f"{name} is missing" for name in needed if not (folder / name).is_file()]
    raw = folder / "raw"
    if not (raw.is_dir() and any(raw.iterdir())):
        found.append("raw/ has no record")
    if found:
        return found
    text = (folder / "README.md").read_text("utf-8")
    found += [f"README.md has no line {line}" for line in LINES if f"\n{line}" not in "\n" + text]
    licence = next((each for each in text.splitlines() if each.startswith("Licence:")), "")
    if not any(each in licence for each in LICENCES):
        found.append(f"the licence is none of {LICENCES}")
    answer, described = (json.loads((folder / name).read_text("utf-8"))
                         for name in ("answer.json", "description.json"))  # fmt: skip
    return found or _against(answer, described, read_touches(folder / "touches.csv"))


def _against(
    answer: Mapping[str, Any], described: Mapping[str, Any], touches: Touches
) -> list[str]:
    """The centre by the independent program, within the U of both."""
    if not answer.get("source"):
        return ["answer.json does not state its source"]
    result = qualify(touches, described["diameter_mm"], tip_diameter=described["tip_diameter_mm"],
                     ring=described["reference"] == "ring")  # fmt: skip
    axes = 2 if described["reference"] == "ring" else 3
    off = np.abs(result.center - np.array(answer["center_mm"]))[:axes]
    allowed = answer["u_center_um"] * 2e-3
    return [] if (off <= allowed).all() else [f"the centre is {off} mm off, {allowed} is allowed"]


@pytest.mark.parametrize("folder", [each for each in MEASURED.iterdir() if each.is_dir()])
def test_sets_have_their_form_and_agree(folder: Path) -> None:
    assert complaints(folder) == []


def _simulated_set(folder: Path) -> Path:
    """A set of the right form, of simulated touches."""
    n = np.vstack([np.eye(3), -np.eye(3)[:2], [[0.6, 0.0, 0.8], [0.0, 0.6, 0.8]]])
    touches = sphere_touches(np.full(7, 0.010), n, center=(5.0, -7.0, 9.0))
    (folder / "raw").mkdir()
    write_touches(folder / "raw/log.csv", touches)
    write_touches(folder / "touches.csv", touches)
    stated = {"reference": "sphere", "diameter_mm": 25.0, "tip_diameter_mm": 6.0}
    (folder / "description.json").write_text(json.dumps(stated))
    answer = {"source": "by construction", "center_mm": [5.0, -7.0, 9.0], "u_center_um": 5.0}
    (folder / "answer.json").write_text(json.dumps(answer))
    (folder / "README.md").write_text("\n".join(f"{line} CC0" for line in LINES))
    return folder


def test_a_set_of_the_right_form(tmp_path: Path) -> None:
    assert complaints(_simulated_set(tmp_path)) == []


@pytest.mark.parametrize(
    ("name", "old", "new", "said"),
    [
        ("README.md", "Licence: CC0", "Licence: mine", "the licence is none of"),
        ("README.md", "Answer:", "", "no line Answer:"),
        ("answer.json", "[5.0", "[5.02", "the centre is"),
        ("answer.json", "by construction", "", "does not state its source"),
    ],
)
def test_what_a_set_lacks(tmp_path: Path, name: str, old: str, new: str, said: str) -> None:
    path = _simulated_set(tmp_path) / name
    path.write_text(path.read_text("utf-8").replace(old, new))
    (found,) = complaints(tmp_path)
    assert said in found


def test_a_set_without_its_record(tmp_path: Path) -> None:
    (_simulated_set(tmp_path) / "raw/log.csv").unlink()
    assert complaints(tmp_path) == ["raw/ has no record"]
