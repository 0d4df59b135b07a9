"""Results of features and matrices of heights, which are no touches; and touches that look so."""

from __future__ import annotations

import pytest

from pretravel.base import InputError
from pretravel.files import ReadingOptions, SourceFile, format_of, look_at


def _file(text: str) -> SourceFile:
    return SourceFile("a.csv", text.encode())


@pytest.mark.parametrize(
    "text",
    [
        "Feature,X,Y,Z,R\nC1,10,10,-5,4.001\nC2,20,10,-5,4.002\n",
        "Name,X center,Y center,Z center,D\nA,10,10,-5,8.01\nB,20,10,-5,8.02\n",
        "Name,X,Y,Z,I,J,K,Size\nS1,10,10,-5,0,0,1,8.001\nS2,20,10,-5,0,0,1,8.002\n",
        "Name,Centre X,Centre Y,Centre Z,I,J,K\nCYL1,1,1,-5,0,0,1\nCYL2,2,1,-5,0,0,1\n",
        "Name,X,Y,Z,I,J,K,Angle\nCON1,10,10,-5,0,0,1,45.01\nCON2,20,10,-5,0,0,1,45.02\n",
        "No,Center X,Center Y,Center Z,Axis I,Axis J,Axis K\nH1,1,1,-5,0,0,1\nH2,2,1,5,0,0,1\n",
        "Name,MP X,MP Y,MP Z,Durchm.\nA,10,10,-5,8.01\nB,20,10,-5,8.02\n",
        "要素,X,Y,Z,直径\n円1,10,10,-5,8.001\n円2,20,10,-5,8.002\n",
    ],
)
def test_results_of_features_are_refused(text: str) -> None:
    assert format_of(_file(text)).name == "feature-list"


@pytest.mark.parametrize(
    "text",
    [
        "Name,X,Y,Z,I,J,K\nbore1,10,0,-5,-1,0,0\nbore2,0,10,-5,0,-1,0\n",
        "Name,X,Y,Z,I,J,K\nbore1-1,10,0,-5,0,0,1\nbore1-2,0,10,-5,0,0,1\n",
        "Nr,Element,X,Y,Z,I,J,K\n"
        + "".join(f"{i},plane{i // 3},{i},1,3.01,0,0,1\n" for i in range(6)),
        "X,Y,Z,D\n10,0,-5,0.001\n0,10,-5,-.002\n-10,0,-5,.003\n",
        "X,Y,Z,R\n10,0,-5,3.0\n0,10,-5,3.0\n-10,0,-5,3.0\n",
    ],
)
def test_touches_that_look_so_are_read(text: str) -> None:
    found, _ = look_at(_file(text), ReadingOptions(units="mm"), format_of(_file(text)))
    assert found is not None


def test_a_matrix_of_heights_is_refused_by_its_name() -> None:
    file = _file(",0,10,20\n0,.012,.013,.011\n10,.014,-2.5,.012\n20,.010,.013,.015\n")
    with pytest.raises(InputError, match="line 1: this is a matrix of heights"):
        look_at(file, ReadingOptions(units="mm"), format_of(file))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("CIR1 X=1 Y=1 Z=-5 I=0 J=0 K=1 D=8.001\nCIR2 X=2 Y=1 Z=-5 I=0 J=0 K=1 D=8.002\n",
         "D is 8.001 to 8.002 mm, and the tip's diameter is 6 mm"),
        ("Name,X,Y,Z,I,J,K,Radius\nH1,1,1,-5,0,0,1,4.001\nH2,2,1,-5,0,0,1,4.001\n",
         "Radius is 4.001 mm, and the tip's radius is 3 mm"),
        ("Name,X,Y,Z,I,J,K,Radius\nH1,1,1,-5,0,0,1,3.0\nH2,2,1,-5,0,0,1,3.0\n", ""),
        ("P1 X=1 Y=1 Z=-5 I=0 J=0 K=1 D=8.001\nP2 X=2 Y=1 Z=-5 I=0 J=0 K=1 D=8.002\n", ""),
    ],
)  # fmt: skip
def test_a_size_that_is_not_the_tips_is_named(text: str, words: str) -> None:
    options = ReadingOptions(units="mm", tip_radius=3.0)
    found, _ = look_at(_file(text), options, format_of(_file(text)))
    assert found is not None
    told = " ".join(found.warnings)
    assert words in told
    assert bool(words) == ("circles or other features" in told)
