"""Output files of commands: their endings, and checks before any work is done."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextvars import ContextVar
from pathlib import Path

from pretravel.base.errors import PretravelError
from pretravel.base.made_files import current_command, makers
from pretravel.base.whole_file import is_stream
from pretravel.cli.running import note_inputs

PICTURES = (".png", ".svg", ".pdf")
PAGES = (".html", ".pdf")
MAPS = (".json", ".csv", *PAGES)
replace_all: ContextVar[bool] = ContextVar("replace_all", default=False)
"""Whether --force was given: files of other commands are replaced too."""


def check_files(
    outputs: Sequence[tuple[Path | None, Sequence[str]]], inputs: Sequence[Path | str | None] = ()
) -> None:
    """Refuse outputs that cannot be written, before any work is done for them.

    Parameters
    ----------
    outputs : pairs of path and endings
        Paths that will be written (None: no such output), and the endings that they may have.
    inputs : paths
        Files that are read; none of them may be overwritten (None: no such input). Where a page is
        an output, their checksums are noted for it.

    Raises
    ------
    PretravelError
        The ending is not one of those (a device or pipe needs none where there is one format), the
        folder does not exist, the path is a folder, the file is also read, or it exists and
        another command made it, or none (see `refuse_files_of_others`).

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
        if path.is_dir():
            raise PretravelError(f"cannot write {path}: it is a folder")
        resolved = path.resolve()
        if resolved in seen and not stream:
            raise PretravelError(f"cannot write two outputs to {path}")
        if resolved in sources:
            raise PretravelError(
                f"cannot write {path}: this file is also read and would be overwritten; choose "
                "another name"
            )
        seen.add(resolved)
    refuse_files_of_others(seen)
    if any(is_page(path) and ".html" in endings for path, endings in outputs):
        note_inputs(inputs)


def is_page(path: Path | None) -> bool:
    """Whether an output is a page for people, not a file of values.

    >>> is_page(Path("map.json")), is_page(Path("map.html")), is_page(None)
    (False, True, False)
    """
    return path is not None and path.suffix.lower() in PAGES


def refuse_files_of_others(paths: Iterable[Path]) -> None:
    """Refuse to replace files that this command did not make, unless --force is given.

    A command replaces what it made before. A file of another command, of another program or one
    that was changed by hand since is not replaced silently; an empty file has nothing to lose.

    Parameters
    ----------
    paths : iterable of Path
        Files that will be written; those that do not exist, and devices, are passed over.

    Raises
    ------
    PretravelError
        One of them was made by another command, or by none.
    """
    command = current_command()
    if replace_all.get() or not command:
        return
    for path in sorted(paths):
        if not path.is_file() or is_stream(path) or path.stat().st_size == 0:
            continue
        found = makers(path)
        if command in found:
            continue
        reason = (
            f"pretravel {min(found)} made it"
            if found
            else "pretravel has no record that it made the file as it is now. A person, another "
            "program or another computer wrote or changed it"
        )
        raise PretravelError(
            f"cannot write {_as_typed(path)}: the file exists, and {reason}. Choose another name; "
            "or add --force (-f) to replace it"
        )


def check_folder_of_texts(
    folder: Path, texts: Mapping[str, str], obsolete: Iterable[str] = ()
) -> None:
    """Refuse to replace or remove files of others in a folder.

    Parameters
    ----------
    folder : Path
        It need not exist.
    texts : mapping of str to str
        Texts that will be written, by the names of their files; a file with the same text stays.
    obsolete : iterable of str
        Names of files that will be removed.

    Raises
    ------
    PretravelError
        As `refuse_files_of_others`.
    """
    others = [
        folder / name
        for name, text in texts.items()
        if not (folder / name).is_file() or (folder / name).read_bytes() != text.encode()
    ]
    refuse_files_of_others([*others, *(folder / name for name in obsolete)])


def _as_typed(path: Path) -> Path:
    """A path relative to the current folder, where it is in it."""
    here = Path.cwd()
    return path.relative_to(here) if path.is_relative_to(here) else path
