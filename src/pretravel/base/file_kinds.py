"""Whether files are of the kinds that their endings say, before they are replaced."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path

from pretravel.base.errors import PretravelError
from pretravel.base.whole_files import is_stream

_BEGIN = 4096
"""Bytes that show of which kind a file is."""
_SIGNATURES: dict[str, tuple[bytes, ...]] = {
    ".nc": (b"\x89HDF\r\n\x1a\n", b"CDF"),
    ".parquet": (b"PAR1",),
    ".pdf": (b"%PDF-",),
    ".zip": (b"PK\x03\x04",),
    ".png": (b"\x89PNG\r\n\x1a\n",),
}
"""First bytes of files that are not text."""


def refuse_other_kinds(paths: Iterable[Path], *, programs: bool = False) -> None:
    r"""Refuse to replace files whose content is not of the kind that their endings say.

    An output replaces an earlier one. A file of another kind under its name is probably a mistake;
    an empty file has nothing to lose.

    Parameters
    ----------
    paths : iterable of Path
        Files that will be written; those that do not exist, and devices, are passed over.
    programs : bool
        They are programs of machines: then .nc is not netCDF but text.

    Raises
    ------
    PretravelError
        A path is a folder, or the content of a file is of another kind.

    >>> import tempfile
    >>> path = Path(tempfile.mkdtemp()) / "points.csv"
    >>> _ = path.write_bytes(b"\x00\x01")
    >>> refuse_other_kinds([path])
    Traceback (most recent call last):
    ...
    pretravel.base.errors.PretravelError: cannot write ...: the file exists and is not text...
    """
    for path in paths:
        if path.is_dir():
            raise PretravelError(f"cannot write {path}: it is a folder")
        if not path.is_file() or is_stream(path) or path.stat().st_size == 0:
            continue
        if kind := _missing_kind(path, programs):
            raise PretravelError(
                f"cannot write {path}: the file exists and is not {kind}, as its ending says; "
                "choose another name, or remove the file"
            )


def _missing_kind(path: Path, is_program: bool) -> str:
    """The kind that the ending of a file states and its content lacks; empty where it has it."""
    ending = path.suffix.lower()
    with path.open("rb") as stream:
        begin = stream.read(_BEGIN)
    if ending in _SIGNATURES and not is_program:
        return "" if begin.startswith(_SIGNATURES[ending]) else f"a {ending} file"
    if b"\0" in begin:
        return "text"
    if ending == ".json":
        try:
            json.loads(path.read_bytes())
        except (ValueError, RecursionError):
            return "JSON"
    mark = {".html": b"<html", ".svg": b"<svg"}.get(ending, b"")
    return "" if mark in begin.lower() else ending[1:].upper()
