"""The table of the workbench keeps all that a drawing states, and nothing is lost on the way."""

import json
import re
from collections.abc import Callable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from pretravel import measure_drawing
from pretravel.base import PretravelError
from pretravel.drawing.screen.rows import drawing_of, restored, rows_of, stored
from pretravel.drawing.tolerances.features_file import (
    Drawing,
    DrawnFeature,
    DrawnPattern,
    DrawnRelation,
    NotDecided,
    read_features_file,
)
from pretravel.drawing.tolerances.tolerance_frame import GeometricTolerance
from pretravel.drawing.tolerances.tolerances import FeatureTolerances
from pretravel.measurement import Points
from tests.support.feature_points import around, feature_points

DRAWING = Drawing(
    (
        DrawnFeature("plane", faces=(3,), label="A", form_tolerance=0.02, axis=(0.0, 0.0, 1.0)),
        DrawnFeature(
            "surface",
            faces=(1, 2),
            label="skin",
            geometric=(
                GeometricTolerance("profile", 0.4, ("A",), offset=-0.1, remark="in the free state"),
            ),
        ),
        DrawnFeature(
            "cylinder",
            faces=(12,),
            label="bore",
            tolerance="12..12.018",
            nominal=12.0,
            geometric=(
                GeometricTolerance("position", 0.1, ("A",), "M", between=(10.0, 35.0)),
                GeometricTolerance("roundness", 0.01),
                GeometricTolerance("parallelism", 0.1, ("A",), instead_of="a zone between planes"),
            ),
        ),
        DrawnFeature("cylinder", faces=(14,), label="bore2"),
        DrawnFeature(
            "plane",
            faces=(4,),
            label="side",
            geometric=(GeometricTolerance("parallelism", 0.1, ("A",), tangent=True),),
        ),
    ),
    (DrawnPattern("pattern1", ("bore", "bore2"), 0.2, ("A",), "", None, "datums A(M)"),),
    (DrawnRelation(("bore", "bore2"), "49.9..50.1", "distance", 50.0),),
    (NotDecided("faces 7, 8 (#99)", "straightness", "it is of lines", "0..0.1"),),
)


PLAIN = Points.plain(np.eye(3), ("a", "b", "c"))


def test_a_drawing_through_the_table() -> None:
    found = drawing_of(restored(stored(rows_of(DRAWING))))
    assert found.feature == DRAWING.feature
    assert found.pattern == DRAWING.pattern
    assert found.between == DRAWING.between
    assert found.not_decided == DRAWING.not_decided


KEYS = {
    name: f"{name}_mm"
    for name in ("at", "nominal", "form_tolerance", "position_tolerance", "offset", "between")
} | {"zone": "tolerance_mm"}


def _table(head: str, value: Any, keys: dict[str, str] = KEYS) -> str:
    stated = {f.name: getattr(value, f.name) for f in fields(value) if f.name != "geometric"}
    lines = [
        f"{keys.get(name, name)} = {json.dumps(each, ensure_ascii=False)}"
        for name, each in stated.items() if each not in (None, "", (), 0.0)
    ]  # fmt: skip
    return "\n".join([head, *lines]) + "\n"


def test_a_drawing_through_its_file(tmp_path: Path) -> None:
    path, blocks = tmp_path / "drawing.toml", []
    for each in DRAWING.feature:
        blocks += [_table("[[feature]]", each)]
        blocks += [_table("[[feature.geometric]]", one) for one in each.geometric]
    blocks += [_table("[[pattern]]", each) for each in DRAWING.pattern]
    blocks += [_table("[[between]]", each, {}) for each in DRAWING.between]
    blocks += [_table("[[not_decided]]", each, {}) for each in DRAWING.not_decided]
    path.write_text("".join(blocks))
    assert read_features_file(path) == DRAWING


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (lambda: DrawnFeature("plane", "top*", nominal=12.0), "which has no size"),
        (lambda: DrawnFeature("line", "edge*", tolerance="1..2"), "which has no size"),
        (lambda: DrawnFeature("bore", "b*", nominal=-3.0), "must be positive"),
        (lambda: DrawnFeature("bore", "b*", form_association="gaussian"), "no form_tolerance_mm"),
        (lambda: DrawnFeature("plane", "t*", targets=((3.0, 2.0, 0.0, -5.0),)), "cannot be neg"),
        (lambda: DrawnPattern("p", ("b1", "b1"), 0.1), "two features or more, each once"),
        (lambda: DrawnRelation(("b1", "b1"), "1..2"), "'b1' is given twice"),
        (lambda: GeometricTolerance("position", 0.0, ("A",)), "which only a tolerance at maximum"),
        (lambda: FeatureTolerances((-2.0, -1.0)), "must be larger than zero"),
        (lambda: FeatureTolerances(cast("Any", 12.0)), "the lower and the upper, not 12.0"),
        (
            lambda: GeometricTolerance("position", 0.1, cast("Any", "A|B")),
            "a tuple of their labels",
        ),
        (lambda: DrawnRelation(cast("Any", "AB"), "1..2"), "is between two features"),
        (lambda: DrawnFeature("bore", "b*", tolerance=cast("Any", (1.0, 2.0))), "is a text such"),
        (lambda: measure_drawing(cast("Any", DRAWING), DRAWING), "expected Points, not a Drawing"),
        (lambda: measure_drawing(PLAIN, cast("Any", "d.toml")), "expected Drawing, not a str"),
    ],
)
def test_what_a_feature_does_not_use_is_refused(made: Callable[[], object], message: str) -> None:
    with pytest.raises(PretravelError, match=message):
        made()


BETWEEN = '[[between]]\nfeatures = ["one", "two"]\ntolerance = "49..51"\nnominal = '


@pytest.mark.parametrize(
    ("select", "stated", "message"),
    [
        ("b1*", "nominal_mm = 20.0\n" + BETWEEN + "50.0", ""),
        ("b1*", "nominal_mm = 10.0", "the diameter is 20.000 mm, and the drawing's nominal_mm 10"),
        ("b1*", BETWEEN + "60.0", "nominal value is 60 mm, and the limits are 49 to 51 mm"),
        ("b1-[0-6]", "", "1 of 16 points belong to no feature of the drawing: b1$"),
        ("b2*", "nominal_mm = 20.0", "two and one have the same touches.* 50 mm apart"),
        ("b1*", 'nominal_mm = 10.0\ntolerance = "±0.01"', "those of the half, such as a radius"),
    ],
)
def test_what_contradicts_the_points(
    tmp_path: Path, select: str, stated: str, message: str
) -> None:
    outward, _ = around(8)
    points = feature_points(
        np.vstack([10.0 * outward, 10.0 * outward + [50.0, 0.0, 0.0]]), np.tile(-outward, (2, 1))
    )
    labels = tuple(f"b{k}-{i}" for k in (1, 2) for i in range(8))
    path = tmp_path / "drawing.toml"
    path.write_text(
        '[[feature]]\nlabel = "two"\nkind = "bore"\nselect = "b2*"\nat_mm = [50, 0, 0]\n'
        f'[[feature]]\nlabel = "one"\nkind = "bore"\nselect = "{select}"\nat_mm = [0, 0, 0]\n'
        + stated
    )
    try:
        found = measure_drawing(replace(points, labels=labels), read_features_file(path))
    except PretravelError as error:
        told = str(error)
    else:
        told = " ".join(found.left_out)
        assert found.nominals.get(("one", "diameter"), 20.0) in (10.0, 20.0)
    assert re.search(message, told) if message else not told, told


def test_a_row_is_called_as_its_line() -> None:
    """By this the value of a line stands beside its row."""
    rows = rows_of(DRAWING)
    assert [row.called("cylinder") for row in rows if row.feature == "bore"] == [
        "diameter", "position (M) (P 25) to A", "roundness",
        "parallelism to A, for a zone between planes",
    ]  # fmt: skip
    assert rows[-1].called("") != ""
    assert next(row for row in rows if "faces 7" in row.feature).called("") == "straightness"
