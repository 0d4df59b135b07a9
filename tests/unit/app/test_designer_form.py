"""The description of a probe as a form."""

from __future__ import annotations

import tomllib
from typing import Any

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.design.screen.form import (
    all_fields,
    changes_of,
    designed_probe,
    designed_text,
    setting_names,
    start_values,
)
from pretravel.prediction.catalogue import catalogue_names, description_text, parse_probe

# What a prediction without weight does not use; the machine's side of the description.
NOT_IN_THE_FORM = {
    ("name",), ("tip", "u_radius_um"), ("moving", "mass_g"), ("moving", "height_mm"),
    ("orientation", "axis"), ("orientation", "rotation_deg"),
    ("seats", "friction"),  # minutes for each picture; a slider must answer at once
}  # fmt: skip


def places(tables: Any, above: tuple[Any, ...] = ()) -> set[tuple[Any, ...]]:
    """The places of all values in a description."""
    if isinstance(tables, dict):
        return {p for key, part in tables.items() for p in places(part, (*above, key))}
    if isinstance(tables, list):
        return {p for i, part in enumerate(tables) for p in places(part, (*above, i))}
    return {above}


@pytest.mark.parametrize("name", catalogue_names())
def test_every_value_of_a_description_has_a_field(name: str) -> None:
    text = description_text(name)
    tables = {key: part for key, part in tomllib.loads(text).items() if key != "sources"}
    found = {place for place in places(tables) if place[:2] not in NOT_IN_THE_FORM}
    fields = {field.path for field in all_fields(text)}
    assert found - fields - {("name",)} == set()
    assert {field.name for field in all_fields(text)} <= set(setting_names())


@pytest.mark.parametrize("name", catalogue_names())
def test_a_form_that_nobody_touched_is_the_start(name: str) -> None:
    text = description_text(name)
    values = start_values(text)
    assert changes_of(text, values) == {}
    changed = designed_text(text, dict(values))
    assert parse_probe(changed.replace(", changed", "")) == parse_probe(text)


def test_the_text_and_the_prediction_are_of_one_probe() -> None:
    text = description_text("omp40-2")
    changes: dict[str, float | str] = {
        "design.stylus.1.length_mm": 100.0,
        "design.stylus.0.length_mm": 20.0,
        "design.stylus.1.material": "tungsten carbide",
        "design.tripod.rod_azimuths_deg.1": 110.0,
        "design.tip.radius_mm": 5.0,
    }
    probe = designed_probe(text, changes, "mine")
    assert parse_probe(designed_text(text, changes, "mine")) == probe
    assert probe.stylus_length == pytest.approx(100.0, abs=1e-9)  # the whole, not the stem alone
    assert probe.stylus[1].length == pytest.approx(80.0, abs=1e-9)
    assert probe.tip.radius == 2.5  # the form has the diameter
    assert probe.name == "mine"


def test_sources_say_what_was_designed_and_comments_stay() -> None:
    changed = designed_text(description_text("omp40-2"), {"design.stylus.1.diameter_mm": 6.0})
    sources = tomllib.loads(changed)["sources"]
    assert sources["stylus.2.diameter_mm"] == "designed; Stem diameter was 4.5 mm"
    assert sources["spring.preload_N"] == "Rodrigues 2021, Table 3.1"
    assert "# axis to the points where the rods rest" in changed


def test_an_error_names_the_fields_that_can_correct_it() -> None:
    text = description_text("omp40-2")
    changes: dict[str, float | str] = {
        "design.tip.radius_mm": 5.0, "design.stylus.1.diameter_mm": 5.5,
        "design.spring.preload_N": 4.0,
    }  # fmt: skip
    with pytest.raises(PretravelError, match=r"a tip of 5 mm diameter is smaller") as caught:
        designed_probe(text, changes)
    assert set(caught.value.inputs) == {"design.tip.radius_mm", "design.stylus.1.diameter_mm"}


def test_a_design_with_a_contact_that_opens_beside_one_without() -> None:
    """Only one of both has the share of the opening; the picture of the parts shows 0 for the
    other (was: KeyError, "a flaw of pretravel")."""
    from pretravel.design.screen.pictures import design_figures
    from pretravel.design.screen.work import predicted_text

    text = description_text("omp40-2")
    stated = text.replace('"first_contact" ', '"arm_lift"\nopening_um = 0.1 #')
    assert "design.trigger.opening_um" in start_values(stated)
    assert {field.name for field in all_fields(stated)} <= set(setting_names())
    assert "design.trigger.opening_um" not in start_values(text)
    opened = predicted_text(designed_text(stated, {"design.trigger.opening_um": 0.2}))
    assert opened.probe.opening == pytest.approx(0.2e-3)
    for pair in ((opened, predicted_text(text)), (predicted_text(text), opened)):
        parts = design_figures(("A", pair[0]), pair[1])["parts"]
        # The mean turn on walls, a L / (1.5 R) times the mean of |cos psi| of 72 directions.
        psi = np.radians(np.mod(np.arange(0.0, 360.0, 5.0) + 60.0, 120.0) - 60.0)
        mean = 0.2 * 64.4 / (1.5 * 16.34) * np.cos(psi).mean()
        last = sorted({float(bars["x"][-1]) for bars in parts["data"]})
        assert last == pytest.approx([0.0, mean], abs=1e-6)  # a picture has six digits
