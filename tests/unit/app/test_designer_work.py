"""Two designs: finite elements of both, and how reports and commands call them."""

from __future__ import annotations

import logging
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from pretravel.app.project import Inputs, ScreenState
from pretravel.base.errors import MeshError, PretravelError
from pretravel.base.units import MICROMETRE
from pretravel.design.fem import reduction_cache
from pretravel.design.fem.elastic_field import field_at_trigger
from pretravel.design.screen.description import is_saved
from pretravel.design.screen.designer import _write_page
from pretravel.design.screen.pictures import design_figures
from pretravel.design.screen.work import (
    DESIGN_FILE,
    DESIGNS,
    FINITE_ELEMENTS,
    FiniteElementDesigns,
    compare_designs,
    compute_finite_elements,
    digest_of,
    follow_slide,
    start_text,
)
from pretravel.prediction.catalogue import description_text, load_probe
from pretravel.prediction.trigger import predict
from pretravel.show.document import Document
from tests.support.coarse_models import models_by_name_are_coarse

CHANGED = {"form_of": digest_of(start_text("omp40-2", None)), "design.spring.preload_N": 4.0}


def computed(
    settings: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> tuple[FiniteElementDesigns, list[str], list[float]]:
    """The designs, what was said, and the preloads of the probes whose models were asked for."""
    asked = []
    model = reduction_cache.model_in_memory

    def counted(probe: Any, *more: Any) -> Any:
        asked.append(probe.preload)
        return model(probe, *more)

    said: list[str] = []
    handler = logging.Handler()
    handler.emit = lambda record: said.append(record.getMessage())  # type: ignore[method-assign]
    logger = logging.getLogger("pretravel")
    monkeypatch.setattr(reduction_cache, "model_in_memory", counted)
    monkeypatch.setattr(logger, "handlers", [handler])
    monkeypatch.setattr(logger, "level", logging.INFO)
    return compute_finite_elements(Inputs(settings, {})), said, asked


@pytest.mark.slow  # the browser's test of the designer computes both, too
def test_finite_elements_of_both_designs_stand_beside_the_model_analytic(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made, said, asked = computed(CHANGED, monkeypatch)
    assert asked == [load_probe("omp40-2").preload, 4.0]
    assert {each.split(":")[0] for each in said} == {"A, omp40-2", "B, omp40-2 (changed)"}
    probes = load_probe("omp40-2"), replace(load_probe("omp40-2"), preload=4.0)
    table = made.document().tables[0]
    columns = {column.name: dict(zip(table.columns[0].values, column.values, strict=True))
               for column in table.columns}  # fmt: skip
    for letter, probe, design in zip("AB", probes, (made.other, made.design), strict=True):
        for words, model in (("", "analytic"), (", fem", "fem")):
            alone = predict(probe, design.predicted.trigger.directions, model)
            walls = np.abs(alone.directions[:, 2]) < 1e-9
            force, pretravel = alone.force[walls], alone.pretravel[walls] / MICROMETRE
            found = columns[f"{letter}{words}"]
            for name, value in (
                ("trigger force on walls, smallest / N", force.min()),
                ("trigger force on walls, mean / N", force.mean()),
                ("trigger force on walls, largest / N", force.max()),
                ("pretravel on walls, mean / µm", pretravel.mean()),
                ("pretravel on walls, range / µm", np.ptp(pretravel)),
            ):
                assert found[name] == pytest.approx(value)
        touched = field_at_trigger(probe, [1.0, 0.0, 0.0], design.reduced)
        stress = columns[f"{letter}, fem"]
        assert stress["highest stress at rest / MPa"] == pytest.approx(touched.rest_stress.max())
        # Azimuth 0° is one of those that are computed.
        highest = stress["highest stress at the trigger on walls / MPa"]
        assert float(highest) >= touched.stress.max() * (1.0 - 1e-9)
        assert np.isnan(columns[letter]["highest stress at rest / MPa"])
    change = columns["B against A, fem"]["trigger force on walls, mean / N"]
    # Without friction the trigger force is in proportion to the preload.
    assert change == pytest.approx(100.0 * (4.0 / probes[0].preload - 1.0))


def test_equal_designs_are_computed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    models_by_name_are_coarse(monkeypatch)
    made, said, asked = computed({}, monkeypatch)
    assert len(asked) == 1
    assert made.other is made.design
    assert all(each.startswith("A, omp40-2: ") for each in said)
    assert "the same as that of A" in made.document().verdict
    assert "against" in FINITE_ELEMENTS.settings


def test_an_error_says_which_design_it_is_of(monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(probe: Any) -> Any:
        raise MeshError(f"no mesh of preload {probe.preload:g}", inputs=("hub",))

    monkeypatch.setattr(reduction_cache, "model_in_memory", failing)
    with pytest.raises(PretravelError, match=r"^A, omp40-2: no mesh") as caught:
        compute_finite_elements(Inputs(CHANGED, {}))
    assert caught.value.inputs == ("hub",)


def test_both_designs_have_rings_of_finite_elements() -> None:
    """Rings of A at azimuths 0°, 10°, …, of B at 5°, 15°, …, so that equal ones are both seen."""
    made = compare_designs(Inputs(CHANGED, {}))
    figures = design_figures(("A: the start", made.other), made.design, (made.other, made.design))
    for name in ("force", "pretravel"):
        drawn = {trace["name"]: trace for trace in figures[name]["data"]}
        assert list(drawn)[-2:] == ["A by finite elements", "B by finite elements"]
        rings = [drawn[key] for key in list(drawn)[-2:]]
        assert [round(trace["theta"][0]) for trace in rings] == [0, 5]
        assert all(len(trace["theta"]) == 36 for trace in rings)
        lines = list(drawn.values())[:2]
        for ring, line in zip(rings, lines, strict=True):
            assert ring["marker"]["color"] == line["line"]["color"]


@pytest.mark.long
def test_no_report_names_a_file_that_nobody_saved(tmp_path: Path) -> None:
    own = tmp_path / "own.toml"
    own.write_text(description_text("omp40-2"), encoding="utf-8")
    files = {"description": (own,)}
    for settings, given, names, source in (
        ({}, {}, ("omp40-2", "omp40-2"), "omp40-2"),
        ({"against": "omp40-2-100mm"}, {}, ("omp40-2-100mm", "omp40-2"), "omp40-2"),
        (CHANGED, {}, ("omp40-2", "omp40-2 (changed)"), DESIGN_FILE),
        (CHANGED | {"name": "soft"}, {}, ("omp40-2", "soft"), DESIGN_FILE),
        ({}, files, ("own.toml", "own.toml"), "own.toml"),
        (CHANGED, files, ("own.toml", "own.toml (changed)"), DESIGN_FILE),
    ):
        made = compare_designs(Inputs(settings, given))
        assert (made.names, made.source) == (names, source)
        assert made.document().title == f"A: {names[0]}, B: {names[1]}"
        if not given:  # pages take a second each
            continue
        page = tmp_path / "design.html"
        _write_page(page, made, saved=False)
        content = page.read_text(encoding="utf-8")
        assert DESIGN_FILE not in content
        assert ("pretravel compare" in content) is (source != DESIGN_FILE)
        _write_page(page, made, saved=True)
        command = f"pretravel compare {names[0]} {source}"
        assert command in page.read_text(encoding="utf-8")
    assert follow_slide(Inputs({}, {})).made.task.probe == "omp40-2"
    assert follow_slide(Inputs({}, files)).made.task.probe == "own.toml"


def test_a_design_is_saved_until_it_changes() -> None:
    state = ScreenState("designer")
    digest = compare_designs(Inputs(CHANGED, {})).digest()
    assert not is_saved(state, digest)
    state.settings["saved_description"] = [digest]
    assert is_saved(state, digest)
    assert not is_saved(state, compare_designs(Inputs({}, {})).digest())


def test_the_start_page_has_the_verdict_of_two_designs() -> None:
    report = DESIGNS.report(compare_designs(Inputs(settings=CHANGED, files={})))
    assert isinstance(report, Document)
    assert report.verdict
