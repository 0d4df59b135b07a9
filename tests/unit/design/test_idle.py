"""What varies must change what is computed."""

from __future__ import annotations

from pathlib import Path

import pytest

from pretravel.base.errors import PretravelError
from pretravel.base.toml_file import parse_toml
from pretravel.design.studies.definition import study_in
from pretravel.design.studies.design_search import find_design
from pretravel.design.studies.run import Workers, run_study
from pretravel.design.studies.wish import wish_in

GRID = '[directions]\nazimuth_deg = "0:330:30"\npolar_deg = 90\n'
OTHER = '[[factor]]\nkey = "spring.preload_N"\nvalues = [4.0, 6.0]\n'


@pytest.mark.parametrize(
    ("key", "values", "more"),
    [
        ("orientation.rotation_deg", "[0, 30]", ""),
        ("tip.u_radius_um", "[0.1, 5.0]", ""),
        ("hub.radius_mm", "[8.0, 9.0]", ""),
        ("sources.hub", '["a", "b"]', ""),
        ("seats.ball_radius_mm", "[2.0, 3.0]", '[prediction]\nmodel = "shen"\n'),
        ("orientation.rotation_deg", "[0, 30]", '[prediction]\nmodel = "fem"\n'),
    ],
)
def test_a_factor_that_changes_nothing_is_refused(
    key: str, values: str, more: str, tmp_path: Path
) -> None:
    text = f'{GRID}{more}{OTHER}[[factor]]\nkey = "{key}"\nvalues = {values}\n'
    with pytest.raises(PretravelError, match=f"{key} changes nothing: the results are the same"):
        run_study(study_in(parse_toml(text)), tmp_path / "study.nc", Workers(count=1))


def test_a_factor_that_acts_with_some_values_of_another_is_run(tmp_path: Path) -> None:
    """The seat balls act where the contact is elastic, and not where it is rigid."""
    text = (
        f'{GRID}[[factor]]\nkey = "seats.contact"\nvalues = ["rigid", "hertz"]\n'
        '[[factor]]\nkey = "seats.ball_radius_mm"\nvalues = [2.0, 3.0]\n'
        '[[factor]]\nkey = "tip.radius_mm"\nvalues = [3.0]\n'  # one value: a condition
    )
    assert len(run_study(study_in(parse_toml(text)), tmp_path / "study.nc", Workers(count=1))) == 4


def test_a_search_refuses_a_free_quantity_that_decides_nothing() -> None:
    """Else it would write a number of chance into the description."""
    text = (
        f'[wish]\nleast = "pretravel_deviation"\n{GRID}'
        '[[free]]\nkey = "spring.preload_N"\nrange = [4.0, 6.0]\n'
        '[[free]]\nkey = "hub.radius_mm"\nrange = [7.0, 9.0]\n'
        '[[limit]]\nof = "trigger_force_least"\nat_least = 0.6\n'
    )
    said = "hub.radius_mm changes nothing: pretravel_deviation, trigger_force_least are the same"
    with pytest.raises(PretravelError, match=said):
        find_design(wish_in(parse_toml(text)))
