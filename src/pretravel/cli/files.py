"""Output files of commands: their endings, and checks before any work is done."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pretravel.base import PretravelError, is_stream, refuse_other_kinds
from pretravel.task import PAGES


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
        Paths that will be written (None for no output), and the endings that they may have.
    inputs : paths
        Files that are read; none of them may be overwritten (None for no input).
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
                f"cannot write {path}: its name has no ending, which decides the format; write a "
                f"file with the ending {' or '.join(endings)}"
            )
        if path.suffix.lower() not in endings and not (stream and not path.suffix):
            raise PretravelError(f"cannot write {path}: the ending must be {' or '.join(endings)}")
        if not path.parent.is_dir():
            raise PretravelError(f"cannot write {path}: the folder {path.parent} does not exist")
        resolved = path.resolve()
        if resolved in seen and not stream:
            raise PretravelError(f"cannot write two outputs to {path}")
        if resolved in sources:
            raise PretravelError(
                f"cannot write {path}: this file is also read and would be overwritten; choose "
                "another name"
            )
        refuse_other_kinds([path], programs=programs)
        seen.add(resolved)
