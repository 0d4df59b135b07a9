"""The text of the pages of a PDF that Chromium printed; its objects are not packed."""

from __future__ import annotations

import re
import unicodedata
import zlib
from pathlib import Path

_OBJECT = re.compile(rb"(\d+) 0 obj\s*(.*?)\s*endobj", re.DOTALL)
_SHOWN = re.compile(rb"/(F\d+) [\d.]+ Tf|<([0-9A-F]+)> Tj")
_SINGLE = re.compile(rb"<([0-9A-F]{4})> <([0-9A-F]+)>\s")
_RANGE = re.compile(rb"<([0-9A-F]{4})> <([0-9A-F]{4})> <([0-9A-F]{4})>")


def pdf_pages(path: Path) -> list[str]:
    """The signs of each page in the order of the file, without blanks."""
    objects = {int(m[1]): m[2] for m in _OBJECT.finditer(path.read_bytes())}
    pages = [each for each in objects.values() if re.search(rb"/Type /Page\b", each)]
    texts = (unicodedata.normalize("NFKC", _signs(page, objects)) for page in pages)  # no ligatures
    return ["".join(text.split()) for text in texts]


def _signs(page: bytes, objects: dict[int, bytes]) -> str:
    names = re.findall(rb"/(F\d+) (\d+) 0 R", page)
    fonts = {name: _signs_of_font(objects[int(number)], objects) for name, number in names}
    contents = re.search(rb"/Contents (\d+) 0 R", page)
    assert contents is not None
    text, font = "", b""
    for name, shown in _SHOWN.findall(_stream(objects[int(contents[1])])):
        font = name or font
        for start in range(0, len(shown), 4):
            text += fonts[font].get(shown[start : start + 4], "")
    return text


def _signs_of_font(font: bytes, objects: dict[int, bytes]) -> dict[bytes, str]:
    """The signs by the numbers of the glyphs."""
    place = re.search(rb"/ToUnicode (\d+) 0 R", font)
    if place is None:
        return {}
    table = _stream(objects[int(place[1])])
    found = {}
    for block in re.findall(rb"beginbfchar(.*?)endbfchar", table, re.DOTALL):
        for glyph, signs in _SINGLE.findall(block):
            found[glyph] = bytes.fromhex(signs.decode()).decode("utf-16-be")
    for block in re.findall(rb"beginbfrange(.*?)endbfrange", table, re.DOTALL):
        for first, last, sign in _RANGE.findall(block):
            for step in range(int(last, 16) - int(first, 16) + 1):
                found[b"%04X" % (int(first, 16) + step)] = chr(int(sign, 16) + step)
    return found


def _stream(content: bytes) -> bytes:
    packed = re.search(rb"stream\r?\n(.*)\r?\nendstream", content, re.DOTALL)
    assert packed is not None
    return zlib.decompress(packed[1])
