"""The CAD kernel's text form, record by record, as Open CASCADE's "BRep Format" describes it."""

from __future__ import annotations

import numpy as np
import pytest

from pretravel.errors import PretravelError
from pretravel.surface.cad.brep import ShapeRecord, _edge, _placements, _shape
from pretravel.surface.cad.brep_geometry import Tokens, read_curve, read_surface

T = np.linspace(0.05, 0.95, 7)


def _tokens(text: str) -> Tokens:
    return Tokens(text.split())


def _read(text: str, dimensions: int) -> np.ndarray:
    """Points of a curve at `T`; nothing of its record may be left, nor of the next one read."""
    tokens = _tokens(f"{text} next")
    curve = read_curve(tokens, dimensions)
    assert tokens.word() == "next"
    return curve.value(T)


@pytest.mark.parametrize(
    ("text", "dimensions", "expected"),
    [
        ("1 1 2 3 0 0.6 0.8", 3, [1.0 + 0.0 * T, 2.0 + 0.6 * T, 3.0 + 0.8 * T]),
        ("1 1 2 0.6 0.8", 2, [1.0 + 0.6 * T, 2.0 + 0.8 * T]),
        # Centre, normal, x, y, radius; in the plane no normal.
        ("2 1 2 3 0 0 1 1 0 0 0 1 0 5", 3,
         [1.0 + 5.0 * np.cos(T), 2.0 + 5.0 * np.sin(T), 3.0 + 0.0 * T]),
        ("2 1 2 1 0 0 1 5", 2, [1.0 + 5.0 * np.cos(T), 2.0 + 5.0 * np.sin(T)]),
        ("3 1 2 3 0 0 1 0 1 0 -1 0 0 5 4", 3,
         [1.0 - 4.0 * np.sin(T), 2.0 + 5.0 * np.cos(T), 3.0 + 0.0 * T]),
        # Parabola with the focal length p: t² / 4p along x, t along y.
        ("4 1 2 3 0 0 1 1 0 0 0 1 0 16", 3,
         [1.0 + T**2 / 64.0, 2.0 + T, 3.0 + 0.0 * T]),
        ("5 1 2 3 0 0 1 1 0 0 0 1 0 5 4", 3,
         [1.0 + 5.0 * np.cosh(T), 2.0 + 4.0 * np.sinh(T), 3.0 + 0.0 * T]),
        ("5 1 2 1 0 0 1 5 4", 2, [1.0 + 5.0 * np.cosh(T), 2.0 + 4.0 * np.sinh(T)]),
        # Bézier: rational, degree, poles, each with its weight.
        ("6 0 2 0 1 0 1 -2 0 2 3 0", 3,
         [2.0 * T * (1 - T) + 2.0 * T**2, (1 - T) ** 2 - 4.0 * T * (1 - T) + 3.0 * T**2, 0.0 * T]),
        ("6 1 1 0 1 1 4 3 2", 2,
         [8.0 * T / (1 + T), ((1 - T) + 6.0 * T) / (1 + T)]),
        # B-spline: rational, periodic, degree, number of poles and of knots, poles, knots.
        ("7 0 0 1 3 3 0 1 0 1 -2 0 2 3 0 0 2 0.25 1 1 2", 3,
         [np.interp(T, [0, 0.25, 1], [0, 1, 2]), np.interp(T, [0, 0.25, 1], [1, -2, 3]), 0.0 * T]),
        # Trimmed: a circle between two angles keeps its parameters.
        ("8 0.5 2.5 2 1 2 3 0 0 1 1 0 0 0 1 0 5", 3,
         [1.0 + 5.0 * np.cos(T), 2.0 + 5.0 * np.sin(T), 3.0 + 0.0 * T]),
        # Offset: a line along x moved along tangent x direction, y x... (0, 0, 1) sets the side.
        ("9 2 0 0 1 1 1 2 3 1 0 0", 3, [1.0 + T, 0.0 * T, 3.0 + 0.0 * T]),
        ("9 2 1 1 2 1 0", 2, [1.0 + T, 0.0 * T]),
    ],
)  # fmt: skip
def test_curves(text: str, dimensions: int, expected: list[np.ndarray]) -> None:
    assert _read(text, dimensions) == pytest.approx(np.column_stack(expected), abs=1e-12)


def test_a_trimmed_curve_has_the_range_of_its_record() -> None:
    curve = read_curve(
        Tokens(
            [
                "8",
                "0.5",
                "2.5",
                "2",
                "1",
                "2",
                "3",
                "0",
                "0",
                "1",
                "1",
                "0",
                "0",
                "0",
                "1",
                "0",
                "5",
            ]
        ),
        3,
    )
    assert curve.range == (0.5, 2.5)
    assert not curve.is_straight
    assert read_curve(_tokens("8 -4 5 1 1 2 3 1 0 0"), 3).is_straight


@pytest.mark.parametrize(
    ("read", "text", "words"),
    [
        (lambda tokens: read_curve(tokens, 3), "10 0 0", "a curve of unknown kind 10"),
        (read_surface, "12 0 0", "a surface of unknown kind 12"),
        (lambda tokens: read_curve(tokens, 3), "", "ends too early"),
        (lambda tokens: _shape(tokens, []), "Xx 1", "unknown shape 'Xx'"),
        (lambda tokens: _edge(tokens, ShapeRecord("Ed"), []), "0 0 0 0 9 0", "unknown form 9"),
        (lambda tokens: _edge(tokens, ShapeRecord("Ed"), []), "0 0 0 0 3 1 C0 1 0 0 1 0",
         "a seam of unknown form"),
    ],
)  # fmt: skip
def test_what_is_not_of_this_form_is_refused(read, text: str, words: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises((PretravelError, ValueError), match=words):
        read(_tokens(text))


def test_a_bounded_surface_is_the_one_within_its_bounds() -> None:
    """A plane, bounded; an offset of it; what follows is not read."""
    tokens = Tokens(
        [
            "10",
            "-1",
            "3",
            "-2",
            "4",
            "1",
            "1",
            "2",
            "3",
            "0",
            "0",
            "1",
            "1",
            "0",
            "0",
            "0",
            "1",
            "0",
            "next",
        ]
    )
    record = read_surface(tokens)
    assert tokens.word() == "next"
    assert record.surface is not None
    assert record.surface.derivatives(np.array([[2.0, 5.0]]))[0] == pytest.approx(
        np.array([[3.0, 7.0, 3.0]])
    )
    off = read_surface(_tokens("11 -2 1 1 2 3 0 0 1 1 0 0 0 1 0"))
    assert off.kind == "offset of plane"
    assert off.surface is not None
    point = off.surface.derivatives(np.array([[2.0, 5.0]]))[0]
    assert point == pytest.approx(np.array([[3.0, 7.0, 1.0]]))


def test_placements_are_products_of_powers_of_those_before() -> None:
    """A shift by (1, 2, 3); a quarter turn about z; twice the shift after the turn back."""
    text = "3 1 1 0 0 1 0 1 0 2 0 0 1 3 1 0 -1 0 0 1 0 0 0 0 0 1 0 2 2 -1 1 2 0"
    shift, turn, both = _placements(_tokens(text))
    assert shift[:3, 3].tolist() == [1.0, 2.0, 3.0]
    point = np.array([1.0, 0.0, 0.0, 1.0])
    assert (turn @ point)[:3] == pytest.approx([0.0, 1.0, 0.0])
    expected = np.linalg.inv(turn) @ shift @ shift
    assert both == pytest.approx(expected)


def test_edges_have_their_curves_and_skip_what_is_not_used() -> None:
    """Forms 1 to 7: a curve, curves on surfaces, a seam, and four that are skipped."""
    shape, shift = ShapeRecord("Ed"), np.diag([2.0, 2.0, 2.0, 1.0])
    text = (
        "1e-7 1 1 0 1 5 1 0.25 0.75 2 6 7 0 0.1 0.9 3 8 9C0 4 0 0.2 0.8 "
        "4 1 2 3 4 5 5 1 2 6 1 2 3 7 1 2 3 4 0 next"
    )
    tokens = _tokens(text)
    _edge(tokens, shape, [shift])
    assert tokens.word() == "next"
    assert shape.curve is not None
    index, placement, first, last = shape.curve
    assert (index, first, last) == (5, 0.25, 0.75)
    assert placement is shift
    assert shape.parameter_curves == [(7, 6, 0, 0.1, 0.9), (4, 8, 9, 0.2, 0.8)]
