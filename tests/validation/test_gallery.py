"""The scripts of the gallery run, and the statement of each is checked as a number."""

from __future__ import annotations

import runpy
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.support.coarse_models import MESHES, models_by_name_are_coarse

GALLERY = Path(__file__).parents[2] / "docs" / "gallery"


@pytest.fixture
def script(monkeypatch: pytest.MonkeyPatch) -> Any:
    monkeypatch.syspath_prepend(str(GALLERY))

    def run(name: str) -> dict[str, Any]:
        try:
            return runpy.run_path(str(GALLERY / name))
        finally:
            sys.modules.pop("published", None)

    return run


@pytest.fixture(params=MESHES)
def mesh(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """The finite elements of a script; the statements hold with a coarse mesh too."""
    if request.param == "coarse":
        models_by_name_are_coarse(monkeypatch)


def assert_the_number(names: dict[str, Any], computed: Any) -> None:
    names["STATEMENT"].check(names["stated"](computed))


def test_the_numbers_that_the_site_shows_are_those_that_were_asserted(script: Any) -> None:
    """Those of slow scripts too: the limits are read, nothing is computed."""
    kept = tomllib.loads((GALLERY / "numbers.toml").read_text("utf-8"))
    scripts = sorted(path.stem for path in GALLERY.glob("plot_*.py"))
    assert sorted(kept) == scripts
    for name in scripts:
        script(f"{name}.py")["STATEMENT"].check(kept[name])


@pytest.mark.published(
    "Rodrigues 2021", "Figures 4.7 to 4.15",
    what="force and distance over azimuth",
    ours="5.63 µm at 90°, 60°",
    theirs="5.6 µm",
    verdict="agrees",
)  # fmt: skip
@pytest.mark.slow
def test_figures_4_07_to_4_15(script: Any, mesh: None) -> None:
    names = script("plot_rodrigues_fig_4_07_to_4_15_sensing_distance.py")
    computed = names["compute"]()
    assert_the_number(names, computed)
    rigid, hertz, existing = computed.values()
    # The force is largest at 60, 180, 300 degrees, as the thesis states.
    for triggers in computed.values():
        assert set(names["AZIMUTH"][np.argsort(triggers[0].force)[-3:]]) == {60.0, 180.0, 300.0}
    # The "existing method" overestimates at large polar angles.
    assert np.all(existing[0].sensing_distance > hertz[0].sensing_distance)
    assert np.all(hertz[0].sensing_distance > rigid[0].sensing_distance)
    assert len(names["draw"](computed).axes) == 18


def test_deviation_of_the_diameter(script: Any) -> None:
    """A table of diameters does not see lobes of three; the map does."""
    names = script("plot_kp3_deviation_of_the_diameter.py")
    computed = names["compute"]()
    assert_the_number(names, computed)
    assert names["left"](computed["one radius"]) == pytest.approx(6.80, abs=0.01)
    # Less than three quarters of what diameters leave. It was 3.9 µm before the search for the six
    # seats was global: the most probable tripod is not the best one for this probe, which is none.
    assert names["left"](computed["map, kind physical"]) < 0.75 * names["left"](
        computed["diameter by angle"]
    )
    assert len(names["draw"](computed).axes) == 2


def test_what_u_contains(script: Any) -> None:
    """Form of a face does not average out, and lobes leave the diameter of equal steps."""
    names = script("plot_what_u_contains.py")
    computed = names["compute"]()
    assert_the_number(names, computed)
    bore, _, _, position = computed.parts.values()
    form = names["FORM_OF_PART"]
    # As independent errors, the lobes would be 2 · 2 µm / sqrt(2) / sqrt(8) = 1.0 µm.
    assert bore[form] < 1.0 / 3.0
    # Planes are rough by three times the noise.
    assert position[form] > 2.0 * max(u for cause, u in position.items() if cause != form)
    # Faces depart from their form independently.
    for name, by_face in computed.by_face.items():
        whole = sum(each**2 for each in by_face.values())
        assert whole == pytest.approx(computed.parts[name][form] ** 2, rel=0.01)
    assert len(names["draw"](computed).axes) == 4


@pytest.mark.published(
    "Rodrigues 2021", "Figure 4.16",
    what="distance over polar angle",
    ours="picture above",
    theirs="picture",
    verdict="agrees; its text is [not right](#sliding)",
)  # fmt: skip
def test_figure_4_16(script: Any, mesh: None) -> None:
    names = script("plot_rodrigues_fig_4_16_polar_sweep.py")
    distances = names["compute"]()
    assert_the_number(names, distances)
    assert np.all(np.diff(distances, axis=0) < 0.0)  # the distance decreases with the polar angle
    assert len(names["draw"](distances).axes[0].lines) == 16


@pytest.mark.published(
    "Rodrigues 2021", "Figures 4.19, 4.23, 4.24",
    what="slides",
    ours="71.87 µm after 20 µm at v = 0.5",
    theirs="71.825 µm",
    verdict="agrees",
)  # fmt: skip
def test_figures_4_19_to_4_24(script: Any) -> None:
    names = script("plot_rodrigues_fig_4_19_to_4_24_sliding.py")
    computed = names["compute"]()
    assert_the_number(names, computed)
    for name, (history, _, printed) in computed.items():
        shift = 0.449 if "ellipsoid" in name else 0.0
        rounding = 0.5 if "inclined" in name else 0.008
        # Printed in micrometres, whole ones for the plane; its solver has 0.1 % for the convex.
        allowed = rounding + 1e-3 * printed[:19]
        assert np.all(np.abs(1e3 * history.deflection[:19] + shift - printed[:19]) <= allowed)
    assert len(names["draw"](computed).axes) == 8


@pytest.mark.published(
    "Rodrigues 2021", "Figure 4.25",
    what="travel over polar angle",
    ours="curvature +0.03 % at equal normals",
    theirs="−27.7 %",
    verdict="differs: two directions",
)  # fmt: skip
def test_figure_4_25(script: Any, mesh: None) -> None:
    names = script("plot_rodrigues_fig_4_25_spindle_travel.py")
    computed = names["compute"]()
    assert_the_number(names, computed)
    plane, ellipsoid, plane_there, true = computed
    assert np.all(ellipsoid < plane)  # over the thesis's parameter
    # Over the true angle they differ only by the effect of curvature, a thousandth.
    assert ellipsoid == pytest.approx(plane_there, rel=1e-3)
    assert np.all(ellipsoid > plane_there)
    assert true == pytest.approx(np.degrees(np.arctan(0.6 * np.tan(np.radians(names["ANGLE"])))))


def test_curvature_study(script: Any) -> None:
    names = script("plot_curvature_study.py")
    computed = names["compute"]()
    assert_the_number(names, computed)
    convex, concave, flat = computed["sideways only"]
    # A convex surface recedes from the sliding tip, a concave one approaches it.
    assert np.all(convex[:, :-1] > 0.0)
    assert np.all(concave[:, :-1] < 0.0)
    assert np.all(np.diff(convex, axis=1) < 0.0)
    # Of the order of slide over R + r: at 26.7° the tip's centre slides by travel / tan(polar).
    slide = flat[1] / np.tan(np.radians(26.7))
    scale = 1e-3 * slide / (names["RADII"] + 3.0) * 100.0
    assert np.all(convex[1] < 2.0 * scale)
    assert np.all(convex[1] > 0.1 * scale)
    # All are far below 27.7 %.
    assert max(np.abs(c).max() for c in (convex, concave)) < 15.0
    assert len(names["draw"](computed).axes) == 2


def test_tip_friction(script: Any) -> None:
    names = script("plot_tip_friction.py")
    computed = names["compute"]()
    assert_the_number(names, computed)
    free, stuck = computed[0.0].pretravel, computed[np.inf].pretravel
    between = [computed[mu].pretravel for mu in (0.05, 0.1, 0.2, 0.4)]
    steep = (names["POLAR"] > 25.0) & (names["POLAR"] < 80.0)
    for less, more in zip([free, *between], [*between, stuck], strict=True):
        assert np.all(more[steep] < less[steep])  # friction holds the tip, the stylus bends less
    # On a floor the tip does not slip and friction has no effect.
    assert stuck[0] == pytest.approx(free[0], abs=1e-9)
    assert len(names["draw"](computed).axes) == 3


@pytest.mark.published("Rodrigues 2021", "Figures 4.35, 4.36")
@pytest.mark.slow
def test_figures_4_27_to_4_36(script: Any) -> None:
    names = script("plot_rodrigues_fig_4_27_to_4_36_sensitivity.py")
    computed = names["compute"]()
    assert_the_number(names, computed)
    for figure, pair in computed.items():
        base, varied = pair.values()
        same_force = np.allclose(base.force, varied.force, rtol=1e-12)
        assert same_force == ("diameter" in figure or "material" in figure)
    assert len(names["draw"](computed).axes) == 8


@pytest.mark.published("Woźniak", "Figure 5")
def test_wozniak_figure_5(script: Any) -> None:
    names = script("plot_wozniak_fig_5_reduction.py")
    results = names["compute"]()
    assert_the_number(names, results)
    assert all(
        names["reduction"](*values) > 1.5 for by in results.values() for values in by.values()
    )
    assert len(names["draw"](results).axes) == 4


@pytest.mark.published(
    "Nafi and Mayer 2011", "Figure 4",
    what="errors of machine and probe",
    ours="three lobes (the example)",
    theirs="three lobes",
    verdict="agrees",
)  # fmt: skip
def test_nafi_mayer_figures_4_and_5(script: Any) -> None:
    names = script("plot_nafi_mayer_fig_4_and_5.py")
    result = names["compute"]()
    assert_the_number(names, result)
    # The probe is three-lobed: its third harmonic is the largest.
    spectrum = np.abs(np.fft.rfft(result.probe_error - result.probe_error.mean()))
    assert int(np.argmax(spectrum)) == 3
    assert len(names["draw"](result).axes) == 4


@pytest.mark.published("Ren 2020", "Figure 6")
def test_ren_figure_6(script: Any) -> None:
    """The crossover by a search in numpy: 18 mm, 2 mm, 200 GPa; 1.5, 0.9744, balls of 1 mm."""
    names = script("plot_ren_fig_6_terms.py")
    terms = names["compute"]()
    assert_the_number(names, terms)
    force = np.geomspace(1e-5, 1e-2, 200_001)
    bending = force * 18.0**3 * 64.0 / (3.0 * np.pi * 200e3 * 2.0**4)
    rotation = 1.5 * 0.655 * 0.9744 * np.cbrt((2.0 / 200e3) ** 2 * 3.0 * force**2)
    crossing = force[np.argmax(bending > rotation)]
    assert names["stated"](terms) == pytest.approx(1e3 * crossing, rel=1e-4)
    assert len(names["draw"](terms).axes) == 2


@pytest.mark.published(
    "Nafi and Mayer 2011", "Figure 3",
    what="measured and predicted errors",
    ours="93.1 % of the variance explained (the example)",
    theirs="curves",
    verdict="agrees; readings are not printed",
)  # fmt: skip
def test_nafi_mayer_figure_3(script: Any) -> None:
    """The explained share by means of rows and columns, in numpy."""
    names = script("plot_nafi_mayer_fig_3_measured_and_modelled.py")
    result = names["compute"]()
    assert_the_number(names, result)
    data = np.genfromtxt(names["READINGS"], delimiter=",", names=True)
    table = np.full((24, 24), np.nan)
    places = data["machine_index"].astype(int) - 1, data["probe_index"].astype(int) - 1
    table[places] = data["error_um"]
    fitted = table.mean(axis=1, keepdims=True) + table.mean(axis=0) - table.mean()
    share = 1.0 - np.sum((table - fitted) ** 2) / np.sum((table - table.mean()) ** 2)
    assert names["stated"](result) == pytest.approx(100.0 * share, rel=1e-9)
    assert len(names["draw"](result).axes) == 4


@pytest.mark.published(
    "Woźniak", "Figures 2, 3",
    what="pretravel all around",
    ours="three lobes; one force all around: a round section",
    theirs="a triangle; a circle",
    verdict="agrees in shape; R² 0.98 of equation 4",
)  # fmt: skip
def test_wozniak_figures_2_and_3(script: Any) -> None:
    names = script("plot_wozniak_fig_2_and_3_pretravel_all_around.py")
    pretravel = names["compute"]()
    assert_the_number(names, pretravel)
    around = pretravel[-1, :-1].reshape(3, -1)  # thirds of a turn are alike
    assert np.ptp(around, axis=0).max() < 1e-9
    assert around.max() / around.min() > 1.3
    assert len(names["draw"](pretravel).axes) >= 1
