"""Law of options with a fixed list of words: another word is refused, and the list is shown."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from pretravel import ReadingOptions, SourceFile, WozniakKind, load_probe, read_points, read_touches
from pretravel.base.errors import PretravelError
from pretravel.design.fem.reduction_cache import reduced_model

TABLE = SourceFile("a.csv", b"X;Y;Z;I;J;K\n0,5;0;3;0;0;1\n")
POINTS = b"label,x_mm,y_mm,z_mm,nx,ny,nz,pretravel_um,u_um\na,0,0,0,0,0,1,1,1\n"


@pytest.mark.parametrize("unit", ["inches", "in", "INCH", "um", "MM", ""])
def test_an_unknown_unit_is_not_taken_for_millimetres(unit: str) -> None:
    """It was: coordinates in inches were 25 times too small, without a word."""
    with pytest.raises(PretravelError, match=rf"'{unit}' is not known; there are mm and inch"):
        read_touches(TABLE, ReadingOptions(units=unit))


WORDS: dict[str, tuple[Callable[[Path], object], str]] = {
    "decimal": (lambda _: ReadingOptions(decimal=","), "comma and point"),
    "transducer": (lambda _: WozniakKind(transducer="optical"), "contact, piezo"),
    "units of points": (lambda _: read_points(SourceFile("p.csv", POINTS), units="in"), "inch"),
    "solver": (lambda _: reduced_model(load_probe("omp40-2"), solver="lu"), "auto"),
}


@pytest.mark.parametrize("option", WORDS)
def test_an_unknown_word_is_refused_with_the_list(option: str, tmp_path: Path) -> None:
    call, words = WORDS[option]
    with pytest.raises(PretravelError, match=f"is not known; there are .*{words}"):
        call(tmp_path)
