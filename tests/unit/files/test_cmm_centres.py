"""Tip centres of a CMM that took nothing off, joined with a list of faces."""

from __future__ import annotations

import pytest

from pretravel.base.errors import InputError
from pretravel.files.format_registry import format_of
from pretravel.files.readings import read_readings
from pretravel.files.source_file import SourceFile
from tests.support.control_logs import CENTRES_OPTIONS, CMM_CENTRES_FILE


def _file(text: str) -> SourceFile:
    return SourceFile("wheel.dat", text.encode())


def test_points_have_the_normals_of_their_faces() -> None:
    assert format_of(_file(CMM_CENTRES_FILE)).name == "cmm-centres"
    found = read_readings(_file(CMM_CENTRES_FILE), CENTRES_OPTIONS).touches
    assert found.labels == ("a-12", "a-13", "wall-17")
    assert found.normals.tolist() == [[0, 0, 1], [0, 0, 1], [1, 0, 0]]
    assert found.positions[1].tolist() == [-0.4, 0.1, 2.991]
    assert "column 4 and those after z are not read" in found.reading


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("13;3;a no comp", "13;3;a comp", "line 2: the point was compensated"),
        ("13;3", "12;3", "line 2: the point 12 occurs twice"),
        ("13;3;a no compensation;1;-0.4", "13;3;a no compensation;1;x", "line 2: 'x000' is not"),
        (
            "17;4;wall no compensation;1;23.0100;0.4000;-5.2000;;0.0000",
            "17;4;wall",
            "line 3: '17;4",
        ),
        ("wall no", "lid no", "line 3: the plan has no target or feature called 'lid'"),
    ],
)
def test_refused_with_its_line(old: str, new: str, words: str) -> None:
    changed = CMM_CENTRES_FILE.replace(old, new, 1)
    assert changed != CMM_CENTRES_FILE
    with pytest.raises(InputError) as caught:
        read_readings(_file(changed), CENTRES_OPTIONS, file_format="cmm-centres")
    assert words in str(caught.value)
