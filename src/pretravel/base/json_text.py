"""JSON of strangers: what a text would take of the memory is known before it is parsed."""

from __future__ import annotations

import json
from typing import Any

from pretravel.base.errors import PretravelError

MOST_MEMORY = 300_000_000
"""Most memory of the values of a text; a map of a million directions takes it. [bytes]"""


def memory_of_json(content: bytes) -> int:
    """About the memory of the values of a JSON text, not of their signs.

    Lists take 64 bytes, texts and numbers 32 and their place 32; a text can have one each 3 bytes.

    >>> memory_of_json(b'[[0.5, 1.5], ["a"]]')
    416
    """
    lists = content.count(b"[") + content.count(b"{")
    return 96 * lists + 32 * content.count(b'"') + 32 * content.count(b",")


def parsed_json(content: bytes, **hooks: Any) -> Any:
    """The values of a JSON text.

    Parameters
    ----------
    content : bytes
    **hooks : function
        As those of `json.loads`.

    Raises
    ------
    PretravelError
        They would take too much memory, or are too deep within each other.
    ValueError
        It is not JSON, or not in UTF-8; an integer has more than 4300 digits.

    >>> parsed_json(b"[1, 2]")
    [1, 2]
    >>> parsed_json(b"[" + b"[]," * 4_000_000 + b"[]]")
    Traceback (most recent call last):
    ...
    pretravel.base.errors.PretravelError: its values would take more than 300 MB of memory
    """
    if memory_of_json(content) > MOST_MEMORY:
        raise PretravelError(
            f"its values would take more than {MOST_MEMORY / 1e6:.0f} MB of memory"
        )
    try:
        return json.loads(content.decode("utf-8-sig"), **hooks)
    except RecursionError:
        raise PretravelError("its values are nested too deeply") from None
