"""Kinds of map by name, and qualification with the setup of an earlier one."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pretravel.base.directions import sphere_pattern_25
from pretravel.base.errors import PretravelError
from pretravel.files.map_file import read_map, write_map
from pretravel.maps.kinds import kind_named, kinds
from pretravel.maps.kinds.wozniak import WozniakBasis, WozniakKind
from pretravel.maps.provenance import Origin, Provenance, QualificationSetup
from pretravel.qualification.qualify import qualify, qualify_like
from pretravel.touches import Touches


def _touches(pretravel: np.ndarray | float, axis: int = 2) -> Touches:
    n = np.roll(sphere_pattern_25(), axis - 2, axis=1)
    return Touches(n * (12.5 + 3.0 - np.asarray(pretravel) * np.ones(25))[:, None], n)


def test_a_map_made_again_keeps_its_setup(tmp_path: Path) -> None:
    """Tip, uncertainty of the diameter, axis and axial pretravel; through a file too."""
    first = qualify(
        _touches(0.010, axis=0), 25.0, tip_diameter=6.0, u_diameter=5e-4, axial_pretravel=3e-3,
        axis=(1.0, 0.0, 0.0), kind="harmonic", u_temperature=0.0,
    ).pretravel_map  # fmt: skip
    write_map(tmp_path / "map.json", first)
    earlier = read_map(tmp_path / "map.json")
    assert earlier.provenance == first.provenance
    again = qualify_like(_touches(0.012, axis=0), earlier, 25.0)
    assert again.setup == first.provenance.setup
    assert again.pretravel_map.u_tip_radius == pytest.approx(2.5e-4)
    assert again.pretravel_map.kind == "harmonic"
    # At the pole, which is +x here, the map has the axial pretravel that the setup names.
    assert again.pretravel_map.pretravel([[1.0, 0.0, 0.0]])[0] == pytest.approx(3e-3, abs=1e-12)


def test_a_map_of_an_earlier_version_keeps_its_uncertainty() -> None:
    """Earlier files have no setup: u of the radius was half that of the diameter."""
    first = qualify(
        _touches(0.010), 25.0, tip_diameter=6.0, u_diameter=5e-4, u_temperature=0.0, kind="harmonic"
    ).pretravel_map
    words = Provenance(Origin.QUALIFIED, first.provenance.source)
    again = qualify_like(_touches(0.010), replace(first, provenance=words), 25.0)
    assert again.pretravel_map.u_tip_radius == pytest.approx(2.5e-4)
    assert again.setup.tip_diameter == pytest.approx(6.0)


def test_settings_of_a_kind_are_kept(tmp_path: Path) -> None:
    n = sphere_pattern_25()
    lobes = 0.004 * WozniakBasis(0.3).design(n)[:, 0]
    first = qualify(_touches(lobes), 25.0, tip_diameter=6.0, kind=WozniakKind(0.3)).pretravel_map
    write_map(tmp_path / "map.json", first)
    again = qualify_like(_touches(lobes), read_map(tmp_path / "map.json"), 25.0)
    assert again.kind == WozniakKind(0.3)


def test_touches_at_one_feed_do_not_replace_a_map_with_delay() -> None:
    first = qualify(_touches(0.010), 25.0, tip_diameter=6.0).pretravel_map
    moving = replace(first, delay=2e-3, feed=0.0)
    with pytest.raises(PretravelError, match="touch the reference at two feeds"):
        qualify_like(_touches(0.010), moving, 25.0)


@pytest.mark.parametrize("name", list(kinds()))
def test_every_kind_has_its_name(name: str) -> None:
    assert kind_named(name).name == name
    assert kind_named(name).title


def test_unknown_kind_and_unknown_setting() -> None:
    with pytest.raises(PretravelError, match="'oval' is not known; there are mean, sectors"):
        kind_named("oval")
    with pytest.raises(PretravelError, match="kind mean"):
        kind_named("mean", transducer="piezo")


def test_provenance_through_plain_values() -> None:
    made = Provenance(
        Origin.QUALIFIED,
        "a",
        "b",
        "c.csv",
        "d",
        False,
        "",
        QualificationSetup(25.0),
        {"x": 1.0},
        "separator ';'",
    )
    assert Provenance.from_dict(made.as_dict()) == made


@pytest.mark.parametrize("name", ["diameter", "tip_diameter"])
@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_setup_refuses_impossible_diameters(name: str, value: float) -> None:
    with pytest.raises(PretravelError, match="must be positive") as error:
        QualificationSetup(**{"diameter": 25.0, name: value})
    assert error.value.inputs == (name,)
