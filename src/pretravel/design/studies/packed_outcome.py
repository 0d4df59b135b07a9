"""An outcome as bytes: what workers send, and what the journal keeps.

Dask would send each array of an outcome as a part of its own; a thousand small parts of a block
take longer than their numbers.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from pretravel.base import FloatArray
from pretravel.design.studies.outputs import Outcome

_ARRAYS = ("force", "sensing_distance", "pretravel")


def packed(outcome: Outcome) -> bytes:
    """A line of JSON, and the arrays as they are in memory.

    Returns
    -------
    bytes
        Equal for equal outcomes, to the last bit.

    >>> outcome = Outcome({"pretravel_range": 0.1})
    >>> unpacked(packed(outcome)).numbers
    {'pretravel_range': 0.1}
    """
    shape, arrays = None, b""
    if outcome.force is not None:
        kept = [getattr(outcome, name) for name in _ARRAYS]
        shape = list(outcome.force.shape)
        arrays = b"".join(np.ascontiguousarray(values, "<f8").tobytes() for values in kept)
    header: dict[str, Any] = {
        "numbers": {name: float(value).hex() for name, value in outcome.numbers.items()},
        "reason": outcome.reason,
        "shape": shape,
    }
    return json.dumps(header).encode() + b"\n" + arrays


def unpacked(content: bytes) -> Outcome:
    """The outcome of `packed`."""
    line, _, rest = content.partition(b"\n")
    header = json.loads(line)
    numbers = {name: float.fromhex(value) for name, value in header["numbers"].items()}
    arrays: dict[str, FloatArray] = {}
    if header["shape"] is not None:
        values = np.frombuffer(rest, "<f8").reshape(len(_ARRAYS), *header["shape"])
        arrays = dict(zip(_ARRAYS, values, strict=True))
    return Outcome(numbers, reason=header["reason"], **arrays)
