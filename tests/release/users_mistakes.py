"""A program with mistakes that a type checker must find, on the marked lines."""

from __future__ import annotations

import pretravel


def name_of_an_attribute(points: pretravel.Points) -> None:
    print(points.pretravels)  # mistake


def type_of_a_result(touches: pretravel.Touches) -> str:
    return touches.take([0])  # mistake


def name_of_a_parameter(touches: pretravel.Touches, pretravel_map: pretravel.PretravelMap) -> None:
    pretravel.apply(touches, pretravel_map, extrapolation=True)  # mistake


def type_of_an_argument(touches: pretravel.Touches) -> None:
    pretravel.qualify(touches, diameter="25")  # mistake
