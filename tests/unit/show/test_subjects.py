"""The document of every subject has one text for each number in all its forms."""

from __future__ import annotations

import html
import json
import re
from collections.abc import Callable

import numpy as np
import pytest
from scipy.special import stdtrit

from pretravel.base.directions import fibonacci_cap, grid
from pretravel.controls.tasks.compare.report import comparison_document
from pretravel.design.tasks.predict.report import prediction_document
from pretravel.design.tasks.probes.report import catalogue_document
from pretravel.drawing.features.measured_feature import measure_feature
from pretravel.drawing.tasks.measure.report import features_document
from pretravel.drawing.tolerances.tolerances import FeatureTolerances, inspect_feature
from pretravel.files.laboratory_statements import LaboratoryStatements
from pretravel.files.touches_csv import read_touches
from pretravel.laboratory.certificate import calibration_certificate
from pretravel.laboratory.rig.budget import REN_BUDGET, calibration_budget, length_budget
from pretravel.laboratory.rig.calibration import calibrate_rig
from pretravel.laboratory.rig.events import rig_touch
from pretravel.laboratory.rig.rig_csv import read_rig_trace
from pretravel.laboratory.separation.plan import plan_separation
from pretravel.laboratory.separation.separation import separate
from pretravel.laboratory.separation.separation_csv import read_multi_step_readings
from pretravel.laboratory.standards.standard_check import CalibratedSphere
from pretravel.laboratory.tasks.check.report import standards_document
from pretravel.laboratory.tasks.rig import CalibratedRig
from pretravel.laboratory.tasks.rig.certificate_report import certificate_document
from pretravel.laboratory.tasks.rig.report import rig_document
from pretravel.laboratory.tasks.separate.report import separation_document, separation_plan_document
from pretravel.measurement.comparison import compare_corrections
from pretravel.measurement.compensation import apply
from pretravel.prediction.catalogue import load_probe
from pretravel.prediction.trigger import predict
from pretravel.qualification.prior_update import update_map
from pretravel.qualification.qualifying import qualify
from pretravel.qualification.touch_plan import plan_touches
from pretravel.show.as_json import document_values
from pretravel.show.document import Document
from pretravel.show.formatting import decimals, expanded_text, figure_text, value_text
from pretravel.show.page import page_text
from pretravel.show.terminal import terminal_text
from pretravel.task.standards import STANDARDS
from pretravel.tasks.compensate.report import points_document
from pretravel.tasks.plan_touches.report import touch_plan_document
from pretravel.tasks.qualify.report import qualification_document
from pretravel.tasks.qualify.update_report import map_update_document
from pretravel.uncertainty import EXPANDED_COVERAGE
from tests.support.example_maps import example_map
from tests.support.examples import EXAMPLES
from tests.support.feature_points import feature_points, features
from tests.support.reference_touches import sphere_touches

SPHERE = EXAMPLES / "sphere_touches.csv"


def _prediction() -> Document:
    probe = load_probe("omp40-2")
    directions = grid(np.radians([30.0, 90.0]), np.radians([0.0, 120.0, 240.0]))
    return prediction_document(predict(probe, directions, "analytic"), probe)


def _qualification() -> Document:
    made = qualify(read_touches(SPHERE), 24.9987, kind="mean", tip_diameter=6.0)
    return qualification_document(made, touches_name=SPHERE.name, warnings=["one more"])


def _points() -> Document:
    made = qualify(read_touches(SPHERE), 24.9987, kind="mean", tip_diameter=6.0)
    return points_document(apply(read_touches(EXAMPLES / "part_touches.csv"), made.pretravel_map))


def _comparison() -> Document:
    made = qualify(read_touches(SPHERE), 24.9987, kind="harmonic", tip_diameter=6.0)
    return comparison_document(compare_corrections(made.pretravel_map), map_name="map.json")


def _rig() -> Document:
    traces = [read_rig_trace(path) for path in sorted((EXAMPLES / "rig").glob("*.csv"))]
    calibration = calibrate_rig([rig_touch(trace) for trace in traces])
    budget = length_budget(calibration_budget(calibration, REN_BUDGET), calibration.pretravel)
    return rig_document(calibration, budget, traces)


def _certificate() -> Document:
    traces = [read_rig_trace(path) for path in sorted((EXAMPLES / "rig").glob("*.csv"))]
    calibration = calibrate_rig([rig_touch(trace) for trace in traces])
    data = calibration_certificate(calibration, REN_BUDGET, LaboratoryStatements())
    return certificate_document(data, traces)


def _separation() -> Document:
    readings = read_multi_step_readings(EXAMPLES / "redundancy_24x24.csv")
    return separation_document(separate(readings, method="least-squares"), pairs=[(2, 5)])


def _separation_plan() -> Document:
    return separation_plan_document(plan_separation(12, 0.5e-6, u_error=0.3e-3))


def _standard() -> Document:
    sphere = CalibratedSphere(24.9987)
    check = STANDARDS["iso10360-5"].procedure(read_touches(SPHERE), sphere, limits={"form": 0.002})
    return standards_document(check, touches_name=SPHERE.name)


def _map_update() -> Document:
    old = example_map()
    normals = fibonacci_cap(9)
    touches = sphere_touches(1.01 * old.pretravel(normals), normals)
    return map_update_document(update_map(touches, old, 25.0), prior_name="old.json")


def test_an_updated_map_has_u_with_and_without_the_centre() -> None:
    """The centre of few touches has a larger error than that of the old map's."""
    old = example_map("physical")
    normals = fibonacci_cap(9)
    touches = sphere_touches(1.01 * old.pretravel(normals), normals)
    document = map_update_document(update_map(touches, old, 25.0))
    (figure,) = (each for each in document.figures if each.name == "u of the map")
    found = re.search(
        r"(\S+) µm when the old map was made; .*Without it: (\S+) µm, old map (\S+) µm",
        figure.remark,
    )
    assert found
    before, apart, before_apart = (float(number) for number in found.groups())
    assert isinstance(figure.value, float)
    assert apart < figure.value
    assert before_apart <= before


def _touch_plan() -> Document:
    return touch_plan_document(plan_touches(example_map(), 6), map_name="old.json")


def _features() -> Document:
    positions, normals = features()["cone"]
    cone = measure_feature(feature_points(positions, normals), "cone", at=(0.0, 0.0, 1.0))
    tolerances = FeatureTolerances((12.0, 13.0), position=0.01, form=0.002)
    return features_document([inspect_feature(cone, tolerances)], points_name="points.csv")


def _catalogue() -> Document:
    return catalogue_document({"omp40-2": load_probe("omp40-2")})


@pytest.mark.long
@pytest.mark.parametrize(
    "subject",
    [
        _prediction,
        _qualification,
        _points,
        _comparison,
        _rig,
        _certificate,
        _separation,
        _separation_plan,
        _standard,
        _catalogue,
        _map_update,
        _touch_plan,
        _features,
    ],
)
def test_a_number_has_one_text(subject: Callable[[], Document]) -> None:
    document = subject()
    template = CalibratedRig.template if subject is _certificate else "page.html"
    page = html.unescape(page_text(document, template=template))
    # Lines are broken on a terminal only.
    short, full = (
        " ".join(terminal_text(document, verbose=verbose).split()) for verbose in (False, True)
    )
    figures = [*document.figures, *(f for section in document.sections for f in section.figures)]
    for figure in figures:
        text = figure_text(figure)
        # On a page, the number, its U, its unit and its remark are cells of a table.
        assert value_text(figure.value, "", figure.digits) in page
        assert expanded_text(figure) in page
        assert figure.remark in page
        assert " ".join(text.split()) in full
        assert figure.name in full
    assert len(short) <= len(full)
    assert document.verdict in page
    assert document.title in page
    json.dumps(document_values(document), allow_nan=False)


def test_a_mean_from_few_repeats_has_the_k_of_their_number() -> None:
    """Three directions, each twice: 3 degrees of freedom, k = 3.31 (GUM, Table G.2, 95.45 %)."""
    figures = [figure for section in _certificate().sections for figure in section.figures]
    (mean,) = [figure for figure in figures if figure.name == "pretravel r1 - r0"]
    assert mean.coverage_factor == pytest.approx(3.31, abs=0.005)


def test_results_of_a_certificate_have_the_digits_of_their_u() -> None:
    """Two digits of U, and the result to the same place (GUM, 7.2.6): U is about 0.2 µm."""
    tables = [table for section in _certificate().sections for table in section.tables]
    columns = {column.name: column for column in tables[0].columns}
    assert min(columns["U"].values) > 0.1
    for name in ("pretravel", "U", "hysteresis", "U of hysteresis"):
        assert columns[name].digits == decimals(2), name


def test_a_quantity_with_a_budget_has_the_u_of_its_budget() -> None:
    """The repeats of a qualification have few degrees of freedom: its k is larger than 2."""
    document = _qualification()
    point, radius = document.budgets
    assert point.coverage_factor() > 2.0
    assert f"U = {1e3 * point.expanded():.2f} µm (k = {point.coverage_factor():.2f})" in (
        document.verdict
    )
    figure = next(f for f in document.figures if f.name == "effective radius")
    wanted = f"{1e3 * radius.expanded():.2f} µm (k = {radius.coverage_factor():.2f})"
    assert expanded_text(figure) == wanted


def test_the_headline_of_few_touches_has_the_k_of_its_own_budget() -> None:
    """Five touches leave a mean radius one degree of freedom: k is that of Student's t for the
    degrees of freedom of the budget (Welch and Satterthwaite), rounded down (GUM, G.4)."""
    touches = read_touches(SPHERE).take(np.array([0, 3, 8, 13, 18]))
    document = qualification_document(
        qualify(touches, 24.9987, kind="mean", tip_diameter=6.0), touches_name="few"
    )
    point, _ = document.budgets
    found = re.search(r"U = ([\d.]+) µm \(k = ([\d.]+)\)", document.verdict)
    assert found is not None
    k = stdtrit(np.floor(point.effective_dof), 0.5 + 0.5 * EXPANDED_COVERAGE)
    assert k > 2.8
    assert float(found[2]) == pytest.approx(k, abs=0.01)
    assert float(found[1]) == pytest.approx(1e3 * k * point.combined, rel=0.01)


def test_the_key_figures_of_a_short_report_are_few() -> None:
    document = _qualification()
    assert (
        len(terminal_text(document).splitlines()) <= 9
    )  # one more where u of the diameter is assumed
    assert "residuals" in terminal_text(document, verbose=True)
    assert "one more" in document.warnings
