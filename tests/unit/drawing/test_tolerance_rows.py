"""The table of the workbench keeps all that a drawing states, and nothing is lost on the way."""

from pathlib import Path

from pretravel.drawing.screen.rows import drawing_of, restored, rows_of, stored
from pretravel.drawing.tolerances.features_file import (
    Drawing,
    DrawnFeature,
    DrawnPattern,
    DrawnRelation,
    NotDecided,
    drawing_text,
    read_features_file,
)
from pretravel.drawing.tolerances.tolerance_frame import GeometricTolerance

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


def test_a_drawing_through_the_table() -> None:
    found = drawing_of(restored(stored(rows_of(DRAWING))))
    assert found.feature == DRAWING.feature
    assert found.pattern == DRAWING.pattern
    assert found.between == DRAWING.between
    assert found.not_decided == DRAWING.not_decided


def test_a_drawing_through_its_file(tmp_path: Path) -> None:
    path = tmp_path / "drawing.toml"
    path.write_text(drawing_text(DRAWING))
    assert read_features_file(path) == DRAWING


def test_a_row_is_called_as_its_line() -> None:
    """By this the value of a line stands beside its row."""
    rows = rows_of(DRAWING)
    assert [row.called("cylinder") for row in rows if row.feature == "bore"] == [
        "diameter", "position (M) (P 25) to A", "roundness",
        "parallelism to A, for a zone between planes",
    ]  # fmt: skip
    assert rows[-1].called("") != ""
    assert next(row for row in rows if "faces 7" in row.feature).called("") == "straightness"
