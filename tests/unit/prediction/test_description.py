"""Descriptions of probes: refused with line and key; numbers have sources."""

from __future__ import annotations

import math
import tomllib

import pytest

from pretravel.base.errors import DescriptionError, InputError
from pretravel.prediction.catalogue import (
    catalogue_names,
    description_text,
    load_probe,
    parse_probe,
)
from pretravel.prediction.described_maps import described_map
from pretravel.prediction.seats import seat_doubts


def _edited(old: str, new: str) -> str:
    text = description_text("omp40-2")
    assert old in text
    return text.replace(old, new)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[0.0, 120.0, 240.0]", "[0.0, 10.0, 20.0]", "leave a gap"),
        ("[0.0, 120.0, 240.0]", "[0.0, 0.0, 180.0]", "gap"),
        ("[0.0, 120.0, 240.0]", "[0.0, 2.0, 180.5]", "leave a gap|apart"),
        ("[0.0, 120.0, 240.0]", "[0.0, 120.0]", "three numbers"),
        ("[0.0, 120.0, 240.0]", "[0.0, nan, 240.0]", "finite"),
        ("support_angle_deg = 27.266", "support_angle_deg = 0.0", "support angle is 0°"),
        ("support_angle_deg = 27.266", "support_angle_deg = 90.0", "support angle is 90°"),
        ("radius_mm = 16.34", "radius_mm = -16.34", "must be positive"),
        ("radius_mm = 16.34", "radius_mm = 1.0", "do not fit"),
        ("radius_mm = 16.34", "radius_mm = inf", "must be a finite number"),
        ("radius_mm = 3.0", "radius_mm = 2.0", "smaller than the stem"),
        ("length_mm = 38.0", "length_mm = -41.0", "must be positive"),
        ("length_mm = 38.0", 'length_mm = "long"', "must be a number"),
        ("length_mm = 38.0", "length_mm = true", "must be a number"),
        ('material = "ruby"', 'material = "glass"', "'glass' is not known"),
        ("preload_N = 5.91", "preload_N = 0.0", "preload is 0 N"),
        ("preload_N = 5.91", "preload_mN = 5910", "has no preload_mN"),
        ("offset_mm = 14.4", "offset_mm = -1.0", "between 0 and 1000"),
        ("offset_mm = 14.4", "offset_mm = nan", "nan"),
        ("axis = [0.0, 0.0, 1.0]", "axis = [0.0, 0.0, 2.0]", "unit vector"),
        ('criterion = "first_contact"', 'criterion = "luck"', "known are"),
        ("threshold_N = 0.0", "threshold_N = -1.0", "cannot be negative"),
        ("mass_g = 25.0", "mass_g = -25.0", "cannot be negative"),
        ("mass_g = 25.0", "mass_g = 25000.0", "mass is 25 kg; the largest one"),
        ("height_mm = -15.0", "height_mm = -15000.0", "between -1000 and 1000"),
        ("height_mm = -15.0", "height_mm = -150.0", "150 mm below .* the tip ends at 67.4 mm"),
        # 4.8 g of steel, 2.4 g of ceramic and 0.45 g of ruby
        ("mass_g = 25.0", "mass_g = 0.025", "stylus and tip alone.* are 7.6 g: was it meant in kg"),
        ("u_radius_um = 0.2", "u_radius_um = 200.0", "uncertainty is 200 µm; .* 0 and 50 µm"),
        ("u_radius_um = 0.2", "u_radius_um = -1.0", "uncertainty is -1 µm"),
        ("[spring]", "[springs]", r"\[spring\]"),
        ("u_radius_um = 0.2", "u_radius_mm = 0.2", "has no u_radius_mm"),
        ("[tripod]", "[tripod", "not valid TOML"),
    ],
)
def test_impossible_descriptions(old: str, new: str, words: str) -> None:
    with pytest.raises((InputError, DescriptionError), match=words) as error:
        parse_probe(_edited(old, new), "mine.toml")
    assert str(error.value).startswith("mine.toml")


@pytest.mark.parametrize("mean", [3.0, 87.0])
def test_both_angles_of_uneven_seats_lie_within_the_limits(mean: float) -> None:
    """2° from a limit each way: a difference of up to 4°, half of it on each side."""
    uneven = f"support_angle_deg = {mean}\nright_less_left_deg = "
    stated = "support_angle_deg = 27.266"
    parse_probe(_edited(stated, f"{uneven}3.9"))
    with pytest.raises(DescriptionError, match=r"differ by 4\.1°.* one is not between 1° and 89°"):
        parse_probe(_edited(stated, f"{uneven}4.1"))


def test_seat_balls_that_overlap_are_doubted() -> None:
    """Two of a rod, 2 (2.75 + 3.5) cos 60° apart; two of neighbours, at a small radius."""
    stated = "support_angle_deg = 27.266"
    (doubt,) = seat_doubts(parse_probe(_edited(stated, "support_angle_deg = 60")))
    assert "A-left and A-right, of radius 3.5 mm, overlap: their centres are 6.25 mm" in doubt
    limit = math.degrees(math.acos(3.5 / 6.25))
    assert seat_doubts(parse_probe(_edited(stated, f"support_angle_deg = {limit - 0.1}"))) == ()
    assert seat_doubts(parse_probe(_edited(stated, f"support_angle_deg = {limit + 0.1}"))) != ()
    (doubt,) = seat_doubts(parse_probe(_edited("radius_mm = 16.34", "radius_mm = 7.0")))
    assert "A-left and B-right" in doubt


OWN = """
[materials."my steel"]
youngs_modulus_GPa = 206
poissons_ratio = 0.29
density_g_cm3 = 7.8
source = "certificate of the rod"
"""


def test_materials_of_the_description() -> None:
    """The table of docs/reference/materials.md, used wherever a description names a material."""
    text = description_text("omp40-2")
    for name in ("tungsten carbide", "stainless steel", "ceramic", "ruby"):
        text = text.replace(f'material = "{name}"', 'material = "my steel"')
    probe = parse_probe(text + OWN)
    own = probe.part_material("my steel")
    assert (own.youngs_modulus, own.poissons_ratio, own.density) == (206e3, 0.29, 7.8e-6)
    assert probe.hub is not None
    named = [probe.tripod.material, probe.seats.material, probe.hub.material, probe.tip.material]
    assert named + [part.material for part in probe.stylus] == [own] * 6
    assert probe.part_material("steel").youngs_modulus == 210e3
    assert load_probe("omp40-2").materials == ()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("poissons_ratio = 0.29", "poissons_ratio = 0.6", "between -1 and 0.5"),
        ("density_g_cm3 = 7.8", "density = 7.8", "has no density"),
        ("youngs_modulus_GPa = 206", "", "needs youngs_modulus_GPa"),
        ("= 206", "= 206000", "2.06e.08 MPa is more than that of any material"),
        ("= 7.8", "= 7800", "0.0078 kg/mm³ is more than"),
        ("source =", "hardness_GPa = 700\nsource =", "hardness 700000 MPa is more than"),
    ],
)
def test_materials_that_cannot_be(old: str, new: str, words: str) -> None:
    with pytest.raises((InputError, DescriptionError), match=words):
        parse_probe(description_text("omp40-2") + OWN.replace(old, new), "mine.toml")


def test_a_part_of_a_material_that_nobody_knows() -> None:
    with pytest.raises(DescriptionError, match="'cheese' is not known") as error:
        load_probe("omp40-2").part_material("cheese")
    assert error.value.inputs == ("workpiece",)


def test_a_name_that_the_catalogue_does_not_have() -> None:
    with pytest.raises(DescriptionError, match=r"no probe .omp41. in .*; there are .*omp"):
        description_text("omp41")


def test_stylus_must_be_a_list() -> None:
    text = description_text("omp40-2")
    single = text[: text.index("[[stylus]]")] + text[text.index("[tip]") :]
    with pytest.raises(InputError, match=r"\[stylus\]"):
        parse_probe(single)
    with pytest.raises(InputError, match=r"write \[\[stylus\]\]"):
        parse_probe(single + "\n[stylus]\nlength_mm = 50.0\n")


@pytest.mark.parametrize("name", catalogue_names())
def test_every_number_of_the_catalogue_has_its_source(name: str) -> None:
    tables = tomllib.loads(description_text(name))
    sources = tables.pop("sources")
    tables.pop("name")
    expected = set()
    for table, content in tables.items():
        entries = content if isinstance(content, list) else [content]
        for number, entry in enumerate(entries, start=1):
            prefix = f"{table}.{number}" if isinstance(content, list) else table
            expected |= {f"{prefix}.{key}" for key in entry}
    assert set(sources) == expected
    assert all(sources.values())
    load_probe(name)


def test_a_map_with_another_tip_than_the_description_s() -> None:
    """A ball of 5 mm has a radius of 2.5 mm; the description's has 3 mm."""
    assert described_map("omp40-2", tip_diameter=5.0).tip_radius == 2.5
    assert described_map("omp40-2").tip_radius == 3.0
