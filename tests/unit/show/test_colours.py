"""Scales of colours, light and dark."""

from __future__ import annotations

import pytest

from pretravel.show.colours import DARK, LIGHT, SEQUENTIAL, SIGNED, scale_colours


def _luminance(colour: str) -> float:
    """Relative luminance (WCAG 2.2)."""
    parts = (int(colour[place : place + 2], 16) / 255.0 for place in (1, 3, 5))
    linear = [
        part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts
    ]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def _contrast(one: str, other: str) -> float:
    low, high = sorted((_luminance(one), _luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("dark", [False, True])
def test_large_values_of_either_sign_stand_out_from_the_page(dark: bool) -> None:
    """3:1 (WCAG 2.2, 1.4.11) and more the larger they are; the middle is next to the page."""
    colours, paper = scale_colours(dark=dark), (DARK if dark else LIGHT)["paper"]
    against = [_contrast(colours[f"signed{place}"], paper) for place in range(11)]
    assert min(against[0], against[10]) > 3.0
    assert against[:6] == sorted(against[:6], reverse=True)
    assert against[5:] == sorted(against[5:])


def test_on_dark_the_lowest_value_is_not_black() -> None:
    """Viridis begins at 1.3:1 there; points have an outline, bodies a shape."""
    assert _contrast(scale_colours(dark=True)["low0"], DARK["paper"]) > 2.5


def test_on_light_the_scales_are_those_of_files() -> None:
    matplotlib = pytest.importorskip("matplotlib")
    for name, scale in (("low", SEQUENTIAL), ("signed", SIGNED)):
        theirs = [matplotlib.colors.to_hex(matplotlib.colormaps[scale](p / 10)) for p in range(11)]
        ours = [scale_colours()[f"{name}{place}"] for place in range(11)]
        for one, other in zip(ours, theirs, strict=True):
            parts = [(int(one[p : p + 2], 16), int(other[p : p + 2], 16)) for p in (1, 3, 5)]
            assert all(abs(a - b) <= 2 for a, b in parts), (name, one, other)  # 256 steps
