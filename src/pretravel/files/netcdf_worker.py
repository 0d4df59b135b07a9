"""Reads a NetCDF file in a process of its own; imports nothing of pretravel, to start quickly.

The file comes on standard input. On standard output go eight bytes (the length of the header), the
header as JSON, and the arrays of numbers, one after the other. `pretravel.files.netcdf` starts
this script and knows why.
"""

from __future__ import annotations

import io
import json
import math
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

if __name__ == "__main__":  # isolated (-I), it takes the folders of modules as its argument
    sys.path[:] = json.loads(sys.argv.pop(1))

import numpy as np

_MOST_VALUES_OF_ATTRIBUTE = 10_000
_MEMORY, _TIMES = 500_000_000, 8
"""Memory for a file: a part for each, and so many times its size. [bytes]"""
_SECONDS, _BYTES_A_SECOND = 2, 5_000_000
"""Processor time for a file: a part for each, and a part that grows with its size."""


def content(stored: Any, largest: int) -> tuple[dict[str, Any], list[bytes]]:
    """Header and arrays of an open file."""
    declared = sum(
        int(np.prod([int(n) for n in variable.shape], dtype=object)) * variable.dtype.itemsize
        for variable in stored.variables.values()
    )
    if declared > largest:
        raise ValueError(f"it declares arrays of {declared:,} bytes")
    buffers: list[bytes] = []
    variables = []
    for name, variable in stored.variables.items():
        variables.append(
            {
                "name": str(name),
                "axes": [str(axis) for axis in variable.dimensions],
                "values": _described(np.asarray(variable[...]), buffers),
                "attributes": _attributes(variable, buffers),
            }
        )
    return {"variables": variables, "attributes": _attributes(stored, buffers)}, buffers


def _attributes(of: Any, buffers: list[bytes]) -> dict[str, Any]:
    found = {}
    for name, value in of.attrs.items():
        if np.size(value) > _MOST_VALUES_OF_ATTRIBUTE:
            raise ValueError(f"the attribute {name} has {np.size(value)} values")
        found[str(name)] = _described(np.asarray(value), buffers)
    return found


def _described(values: Any, buffers: list[bytes]) -> dict[str, Any]:
    if values.dtype.kind in "SUO":
        texts = [v.decode() if isinstance(v, bytes) else v for v in values.ravel().tolist()]
        if not all(isinstance(text, str) for text in texts):
            raise ValueError("it contains values that are neither numbers nor text")
        return {"shape": values.shape, "texts": texts}
    if values.dtype.kind not in "biuf" or values.dtype.itemsize > 8:
        raise ValueError(f"it contains values of the type {values.dtype}")
    plain = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<"))
    buffers.append(plain.tobytes())
    return {"shape": values.shape, "type": plain.dtype.str}


def _limit(size: int) -> None:
    with suppress(ImportError, OSError, ValueError):  # some systems have no such limits
        import resource

        seconds = math.ceil(time.process_time()) + _SECONDS + size // _BYTES_A_SECOND
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 1))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        pages = int(Path("/proc/self/statm").read_text("ascii").split()[0])
        memory = pages * resource.getpagesize() + _MEMORY + _TIMES * size
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))


def answer(read: bytes, largest: int) -> list[bytes]:
    """The parts of the answer: with the content, or with a header that has the key ``error``."""
    from h5netcdf import File

    _limit(len(read))
    buffers: list[bytes] = []
    try:
        with File(io.BytesIO(read), "r") as stored:
            header, buffers = content(stored, largest)
    # Whatever a foreign file makes these libraries raise, the file is at fault.
    except Exception as error:
        header = {"error": f"{type(error).__name__}: {' '.join(str(error).split())[:200]}"}
    text = json.dumps(header).encode()
    return [len(text).to_bytes(8, "little") + text, *buffers]


def main() -> None:
    """Read a file from standard input, and answer."""
    for part in answer(sys.stdin.buffer.read(), int(sys.argv[1])):
        sys.stdout.buffer.write(part)


if __name__ == "__main__":
    main()
