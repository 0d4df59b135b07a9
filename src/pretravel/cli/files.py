"""Output files of commands: their endings, and checks before any work is done."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from pathlib import Path

from pretravel.base.errors import PretravelError
from pretravel.base.whole_file import is_stream
from pretravel.cli.running import note_inputs

PICTURES = (".png", ".svg", ".pdf")
PAGES = (".html", ".pdf")
MAPS = (".json", ".csv", *PAGES)
_BEGIN = 4096
"""Bytes that show of which kind a file is."""
_SIGNATURES: dict[str, tuple[bytes, ...]] = {
    ".nc": (b"\x89HDF\r\n\x1a\n", b"CDF"),
    ".parquet": (b"PAR1",),
    ".pdf": (b"%PDF-",),
    ".png": (b"\x89PNG\r\n\x1a\n",),
}
"""First bytes of files that are no text."""


def check_files(
    outputs: Sequence[tuple[Path | None, Sequence[str]]],
    inputs: Sequence[Path | str | None] = (),
    *,
    programs: bool = False,
) -> None:
    """Refuse outputs that cannot be written, before any work is done for them.

    Parameters
    ----------
    outputs : pairs of path and endings
        Paths that will be written (None: no such output), and the endings that they may have.
    inputs : paths
        Files that are read; none of them may be overwritten (None: no such input). Where a page is
        an output, their checksums are noted for it.
    programs : bool
        The outputs are programs of machines, as for `refuse_other_kinds`.

    Raises
    ------
    PretravelError
        The ending is not one of those (a device or pipe needs none where there is one format), the
        folder does not exist, the file is also read, or the path exists and is a folder or a file
        of another kind than its ending says (see `refuse_other_kinds`).

    >>> check_files([(Path("map.xyz"), (".json",))])
    Traceback (most recent call last):
    ...
    pretravel.base.errors.PretravelError: cannot write map.xyz: the ending must be .json
    """
    sources = {Path(source).resolve() for source in inputs if source is not None}
    seen: set[Path] = set()
    for path, endings in outputs:
        if path is None:
            continue
        stream = is_stream(path)
        formats = [ending for ending in endings if ending not in PAGES]
        if stream and not path.suffix and len(formats) != 1:
            raise PretravelError(
                f"cannot write {path}: its name has no ending, which tells the format; write a "
                f"file with the ending {' or '.join(endings)}"
            )
        if path.suffix.lower() not in endings and not (stream and not path.suffix):
            raise PretravelError(f"cannot write {path}: the ending must be {' or '.join(endings)}")
        if not path.parent.is_dir():
            raise PretravelError(f"cannot write {path}: the folder {path.parent} does not exist")
        refuse_other_kinds([path], programs=programs)
        resolved = path.resolve()
        if resolved in seen and not stream:
            raise PretravelError(f"cannot write two outputs to {path}")
        if resolved in sources:
            raise PretravelError(
                f"cannot write {path}: this file is also read and would be overwritten; choose "
                "another name"
            )
        seen.add(resolved)
    if any(is_page(path) and ".html" in endings for path, endings in outputs):
        note_inputs(inputs)


def is_page(path: Path | None) -> bool:
    """Whether an output is a page for people, not a file of values.

    >>> is_page(Path("map.json")), is_page(Path("map.html")), is_page(None)
    (False, True, False)
    """
    return path is not None and path.suffix.lower() in PAGES


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
        except ValueError:
            return "JSON"
    mark = {".html": b"<html", ".svg": b"<svg"}.get(ending, b"")
    return "" if mark in begin.lower() else ending[1:].upper()
