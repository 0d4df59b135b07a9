"""examples/main_job.ipynb runs from top to bottom, and its numbers are those of the main job.

The cells run in this process, as a kernel would run them; tools/check_release.py runs the notebook
in Jupyter, beside the built package.
"""

from __future__ import annotations

import ast
import json
from typing import Any

import numpy as np
import pytest

import pretravel
from tests.support.examples import ROOT

NOTEBOOK = ROOT / "examples" / "main_job.ipynb"
BORE = 20.010
"""Diameter of the first bore, from examples/data/README.md. [mm]"""


def _cells() -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = json.loads(NOTEBOOK.read_text("utf-8"))["cells"]
    return found


def _run(source: str, names: dict[str, Any]) -> object:
    """Execute a cell; the value of its last line, where that is an expression."""
    tree = ast.parse(source)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, NOTEBOOK.name, "exec"), names)
    if last is None:
        return None
    return eval(compile(ast.Expression(last.value), NOTEBOOK.name, "eval"), names)


@pytest.fixture(scope="module")
def results() -> tuple[dict[str, Any], list[object]]:
    """The names that the cells leave, and what each shows."""
    names: dict[str, Any] = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(NOTEBOOK.parent)
        shown = [
            _run("".join(cell["source"]), names) for cell in _cells() if cell["cell_type"] == "code"
        ]
    return names, shown


def test_it_is_kept_without_outputs() -> None:
    """Outputs would be old after the next change, and would hide what changed."""
    content = json.loads(NOTEBOOK.read_text("utf-8"))
    assert (content["nbformat"], content["nbformat_minor"]) == (4, 5)
    for cell in _cells():
        if cell["cell_type"] == "code":
            assert cell["outputs"] == []
            assert cell["execution_count"] is None
    names = [cell["id"] for cell in _cells()]
    assert len(set(names)) == len(names)


def test_what_it_shows_has_a_form_for_notebooks(
    results: tuple[dict[str, Any], list[object]],
) -> None:
    shown = [value for value in results[1] if value is not None]
    assert len(shown) >= 6
    for value in shown:
        if isinstance(value, pretravel.Touches | pretravel.Points | pretravel.PretravelMap):
            assert value._repr_html_().startswith("<div")
        else:
            assert len(str(value)) < 3000


def test_its_numbers_are_those_of_the_example_data(
    results: tuple[dict[str, Any], list[object]],
) -> None:
    names = results[0]
    found = names["diameter"]
    assert found.value == pytest.approx(BORE, abs=3 * found.u)
    # Without the map the bore is too large by twice its mean pretravel.
    bore = names["table"]["feature"] == "bore1"
    twice = 2e-3 * float(np.mean(names["table"]["pretravel_um"][bore]))
    assert found.uncompensated - found.value == pytest.approx(
        twice, rel=0.05
    )  # a circle through uneven points
