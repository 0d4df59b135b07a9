"""A bracket whose text gets further PMI."""

from collections.abc import Callable
from pathlib import Path

import pytest

from pretravel.drawing.pmi import model
from pretravel.drawing.pmi.model import ModelDrawing, read_model_drawing
from pretravel.surface import Part, read_part
from tests.support.examples import EXAMPLES

Reader = Callable[..., ModelDrawing]


@pytest.fixture(scope="module")
def part() -> Part:
    """The CAD kernel reads it once: further text does not change its faces."""
    return read_part(EXAMPLES / "bracket.step")


@pytest.fixture
def bracket(tmp_path: Path, part: Part, monkeypatch: pytest.MonkeyPatch) -> Reader:
    """Reads the bracket with further text."""
    monkeypatch.setattr(model, "read_part", lambda path: part)

    def read(*added: str, replaced: dict[str, str] | None = None) -> ModelDrawing:
        text = (EXAMPLES / "bracket.step").read_text()
        for old, new in (replaced or {}).items():
            assert old in text
            text = text.replace(old, new)
        head, end, tail = text.rpartition("ENDSEC;")
        path = tmp_path / "part.step"
        path.write_text(head + "".join(added) + end + tail)
        return read_model_drawing(path)

    return read
