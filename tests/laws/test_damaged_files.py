"""Law of all text formats: a damaged file is read or refused; no other error occurs."""

from __future__ import annotations

import random

import pytest

from pretravel.errors import PretravelError
from pretravel.formats.file_format import ReadingOptions
from pretravel.formats.format_registry import format_named, format_of
from pretravel.formats.readings import read_readings
from pretravel.formats.source_file import SourceFile
from tests.support.control_logs import REFUSED_FILES, SAMPLES

TEXTS = [(name, text, options) for name, (text, options) in SAMPLES.items()] + [
    (name, text, None) for name, (texts, _) in REFUSED_FILES.items() for text in texts
]
SIGNS = '0123456789.,-+eE<>[]{}":;=/$ \n\tXYZINFabc\x00\ufeff\u2028µ'
DAMAGES = 60
"""For each sample; twenty thousand were tried once."""


def _damaged(text: str, chance: random.Random) -> str:
    """A text with one to four places changed, left out, doubled, or cut off at the end."""
    signs = list(text)
    for _ in range(chance.randint(1, 4)):
        first, last = sorted(chance.randrange(len(signs) + 1) for _ in range(2))
        kind = chance.randrange(5)
        if kind == 0:
            signs[first : first + 1] = [chance.choice(SIGNS)]
        elif kind == 1:
            signs.insert(first, chance.choice(SIGNS))
        elif kind == 2:
            signs[first:last] = []
        elif kind == 3:
            signs[first:last] *= 2
        else:
            del signs[last:]
    return "".join(signs)


def _refusal(file: SourceFile, stated: str | None, options: ReadingOptions) -> str:
    """The message of the refusal; empty where the file is read."""
    try:
        known = format_of(file) if stated is None else format_named(stated)
        if known.parse_features is not None:
            known.parse_features(file, options)
        else:
            read_readings(file, options, file_format=known.name)
    except PretravelError as error:
        return str(error)
    return ""


@pytest.mark.parametrize(("name", "text", "options"), TEXTS)
def test_a_damaged_file_is_read_or_refused(
    name: str, text: str, options: ReadingOptions | None
) -> None:
    chance = random.Random(name)
    for _ in range(DAMAGES):
        file = SourceFile("damaged.txt", _damaged(text, chance).encode())
        for stated in (None, name):
            refusal = _refusal(file, stated, options or ReadingOptions())
            assert not refusal or refusal.startswith("damaged.txt")
