"""The designs of a study: which values, how many, always the same ones."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.base.errors import PretravelError
from pretravel.base.toml_file import parse_toml
from pretravel.design.studies.definition import Study, study_in
from pretravel.design.studies.plan import Plan
from pretravel.design.studies.results import collected

PRELOAD = '[[factor]]\nkey = "spring.preload_N"\nrange = [4.0, 8.0]\nlevels = 3\n'
STEM = '[[factor]]\nkey = "stylus.2.length_mm"\nrange = [38.0, 88.0]\nlevels = 2\n'
PRELOADS, STEMS = (each.partition("levels")[0] for each in (PRELOAD, STEM))
MATERIAL = '[[factor]]\nkey = "stylus.2.material"\nvalues = ["ceramic", "steel"]\n'


def study(plan: str, *factors: str, settings: str = "") -> Study:
    text = f'[study]\nplan = "{plan}"\n{settings}\n' + "".join(factors)
    return study_in(parse_toml(text, "study.toml"))


def test_full_factorial_is_the_product_of_all_values() -> None:
    plan = Plan(study("full-factorial", PRELOAD, STEM, MATERIAL))
    designs = {tuple(plan.levels(number).values()) for number in range(len(plan))}
    assert designs == {
        (preload, stem, material)
        for preload in (4.0, 6.0, 8.0)
        for stem in (38.0, 88.0)
        for material in ("ceramic", "steel")
    }
    assert len(plan) == 12


def test_one_at_a_time_begins_with_the_base() -> None:
    plan = Plan(study("one-at-a-time", PRELOAD, STEM))
    assert [dict(plan.levels(number)) for number in range(len(plan))] == [
        {},
        {"spring.preload_N": 4.0},
        {"spring.preload_N": 6.0},
        {"spring.preload_N": 8.0},
        {"stylus.2.length_mm": 38.0},
        {"stylus.2.length_mm": 88.0},
    ]


def test_the_base_is_stated_in_the_results() -> None:
    """The catalogue's preload is 5.91 N, its stem 38 mm."""
    one = study("one-at-a-time", PRELOAD, STEM)
    results = collected(one, Plan(one), [])
    assert results.factors["spring.preload_N"].tolist() == [5.91, 4.0, 6.0, 8.0, 5.91, 5.91]
    assert results.factors["stylus.2.length_mm"].tolist() == [38.0, 38.0, 38.0, 38.0, 38.0, 88.0]


def test_a_latin_hypercube_has_one_design_in_each_slice() -> None:
    plan = Plan(study("latin-hypercube", PRELOADS, STEMS, settings="samples = 40"))
    preload = np.array([plan.levels(number)["spring.preload_N"] for number in range(40)])
    assert sorted(((preload - 4.0) / 0.1).astype(int)) == list(range(40))


def test_a_sobol_plan_changes_one_factor_from_a_to_b() -> None:
    plan = Plan(study("sobol", PRELOADS, STEMS, settings="samples = 5"))
    assert len(plan) == 8 * 4  # a power of two, A, B and two factors
    for sample in range(8):
        a, b, preload, stem = (dict(plan.levels(sample + 8 * part)) for part in range(4))
        assert preload == {**a, "spring.preload_N": b["spring.preload_N"]}
        assert stem == {**a, "stylus.2.length_mm": b["stylus.2.length_mm"]}
        assert a["spring.preload_N"] != b["spring.preload_N"]


@pytest.mark.parametrize("plan", ["latin-hypercube", "sobol"])
def test_the_seed_alone_decides(plan: str) -> None:
    def designs(seed: int) -> list[object]:
        made = Plan(study(plan, PRELOADS, STEMS, settings=f"samples = 4\nseed = {seed}"))
        return [tuple(made.levels(number).values()) for number in range(len(made))]

    assert designs(1) == designs(1)
    assert designs(1) != designs(2)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('[study]\nplan = "best"\n' + PRELOAD, "study.toml, line 1: plan has 'best'; known are"),
        ('[study]\noutputs = ["mass"]\n' + PRELOAD, "outputs has 'mass'; known are force"),
        ('[study]\nprobe = "omp99"\n' + PRELOAD, "line 2: the probe 'omp99' is neither in the cat"),
        ("[study]\n", "factor"),
        (PRELOAD + PRELOAD, "line 6: the factor spring.preload_N occurs twice"),
        ('[[factor]]\nkey = "spring.preload_N"\n', "needs either values or a range"),
        ('[[factor]]\nkey = "a.b"\nvalues = [1.0]', "line 2: 'a.b': there is no table 'a'"),
        ('[[factor]]\nkey = "stylus.3.length_mm"\nvalues = [1.0]', "none of the numbers 1 to 2"),
        ('[[factor]]\nkey = "spring.preload_N"\nrange = [5.0, 4.0]', "the first number"),
        ('[[factor]]\nkey = "spring.preload_N"\nvalues = [4.0, "5"]', "all numbers or all texts"),
        ('[[factor]]\nkey = "spring.preload_N"\nvalues = [4.0, 4.0]', "a value twice"),
        (PRELOAD + '[directions]\nazimuth_deg = "0:350"\n', "expected one angle, a list"),
        ('[study]\nplan = "sobol"\n[[factor]]\nkey = "spring.preload_N"\nvalues = [4.0]', "range"),
        ('[[factor]]\nkey = "spring.preload_N"\nrange = [4.0, 8.0]\nlevels = 1', "2 to 1000"),
        ("[study]\nsamples = 9\n" + PRELOAD, "line 2: samples is not used by the plan full"),
        ("[study]\nseed = 9\n" + PRELOAD, "line 2: seed is not used by the plan full"),
        ('[study]\nplan = "sobol"\n' + PRELOAD, "line 6: levels of spring.preload_N is not used"),
        (PRELOAD + '[directions]\nazimuth_deg = "0:360:30"\n', "azimuth 0° occurs twice (0° and"),
        (PRELOAD + "[directions]\npolar_deg = [45, 90, 45]\n", "polar angle 45° occurs twice"),
        (PRELOAD + "[touch]\nfriction = 0.2\n", "line 5: the table [touch] changes nothing"),
        ('[[factor]]\nkey = "calibration.noise_um"\nvalues = [0.1, 0.2]', "_um changes nothing"),
        ('[[factor]]\nkey = "moving.mass_g"\nvalues = [5.0, 9.0]', "mass_g changes nothing"),
        ('[[factor]]\nkey = "spring.preload_N"\nvalues = [4.0]\nlevels = 3', "line 4: levels of"),
        (PRELOAD + "[directions]\npolar_deg = [90, 200]\n", "polar angle is 200°"),
    ],
)  # fmt: skip
def test_a_study_that_cannot_be_says_why(text: str, said: str) -> None:
    with pytest.raises(PretravelError) as refused:
        study_in(parse_toml(text, "study.toml"))
    assert said in str(refused.value)


def test_too_many_designs_are_refused() -> None:
    factor = PRELOAD.replace("levels = 3", "levels = 1000")
    with pytest.raises(PretravelError, match="1000000000 designs; at most 1000000"):
        Plan(
            study(
                "full-factorial",
                factor,
                factor.replace("spring.preload_N", "tripod.radius_mm"),
                factor.replace("spring.preload_N", "stylus.2.length_mm"),
            )
        )
