"""The journal of a study: what is done stays done, however the study ends.

An SQLite file beside the output holds each block of designs from the moment it is computed. SQLite
writes a block whole or not at all, also when the process is killed or the disk is full.
"""

from __future__ import annotations

import contextlib
import sqlite3
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import TracebackType

from pretravel.base.errors import PretravelError
from pretravel.studies.outputs import Outcome
from pretravel.studies.packed_outcome import unpacked

_HEADER = b"SQLite format 3\0"
_SECONDS = 1.0
"""How long another process may keep the journal before this one is refused."""


def journal_path(output: Path) -> Path:
    """Where the journal of an output lies.

    >>> journal_path(Path("study.nc")).name
    'study.nc.journal'
    """
    return output.with_name(output.name + ".journal")


class Journal:
    """An open journal, which no other process can open.

    Parameters
    ----------
    path : Path
        Made where it does not exist.
    digest : str
        Of the study; see `pretravel.studies.run.digest_of`.
    anew : bool
        Whether what it contains is removed, also where it belongs to another study.

    Raises
    ------
    PretravelError
        Another process runs a study with this output; the journal belongs to another study, or is
        no journal; the disk is full.
    """

    def __init__(self, path: Path, digest: str, *, anew: bool = False) -> None:
        self.path = path
        if anew and not _is_database(path):
            path.unlink(missing_ok=True)
        with self._faults():
            self._base = sqlite3.connect(path, timeout=_SECONDS, isolation_level=None)
            # Held until the connection is closed, or the process ends in any way.
            self._base.execute("PRAGMA locking_mode = EXCLUSIVE")
            self._base.execute("PRAGMA synchronous = NORMAL")
            self._base.execute("BEGIN EXCLUSIVE")
            if anew:
                self._base.execute("DROP TABLE IF EXISTS study")
                self._base.execute("DROP TABLE IF EXISTS design")
            self._base.execute("CREATE TABLE IF NOT EXISTS study (digest TEXT)")
            self._base.execute(
                "CREATE TABLE IF NOT EXISTS design (number INTEGER PRIMARY KEY, content BLOB)"
            )
            written = self._base.execute("SELECT digest FROM study").fetchone()
            if written is None:
                self._base.execute("INSERT INTO study VALUES (?)", (digest,))
            self._base.execute("COMMIT")
        if written is not None and written[0] != digest:
            self.close()
            raise PretravelError(
                f"{path} holds results of another study, or of another version of this one; "
                "write to another output, or begin anew",
                inputs=("restart",),
            )

    def __enter__(self) -> Journal:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    @contextlib.contextmanager
    def _faults(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            if "locked" in str(error):
                raise PretravelError(
                    f"another process runs a study with this output ({self.path} is in use); wait "
                    "for its end, or write to another output"
                ) from None
            if "not a database" in str(error) or "malformed" in str(error):
                raise PretravelError(
                    f"{self.path} is no journal of a study, or a damaged one; begin anew",
                    inputs=("restart",),
                ) from None
            raise PretravelError(
                f"{self.path} cannot be written: {error}. What was computed before is kept; run "
                "the command again"
            ) from None

    def close(self) -> None:
        """Let another process open it."""
        self._base.close()

    def done(self) -> set[int]:
        """The numbers of the designs that are computed."""
        with self._faults():
            return {row[0] for row in self._base.execute("SELECT number FROM design")}

    def add(self, block: Sequence[tuple[int, bytes]]) -> None:
        """Keep a block of designs.

        Parameters
        ----------
        block : sequence of number and bytes
            See `packed`.

        Raises
        ------
        PretravelError
            It cannot be written; nothing of the block is kept then.
        """
        with self._faults():
            self._base.execute("BEGIN")
            try:
                self._base.executemany(
                    "INSERT OR REPLACE INTO design VALUES (?, ?)",
                    block,
                )
                self._base.execute("COMMIT")
            except sqlite3.Error:
                with contextlib.suppress(sqlite3.Error):
                    self._base.execute("ROLLBACK")
                raise

    def outcomes(self) -> Iterator[tuple[int, Outcome]]:
        """The computed designs by number, one after the other."""
        with self._faults():
            rows = self._base.execute("SELECT number, content FROM design ORDER BY number")
            for number, content in rows:
                yield number, unpacked(content)

    def remove(self) -> None:
        """Close and delete it."""
        self.close()
        for ending in ("", "-journal", "-wal", "-shm"):
            self.path.with_name(self.path.name + ending).unlink(missing_ok=True)


def _is_database(path: Path) -> bool:
    """Whether a file begins as those of SQLite do; it may be in use."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        return file.read(len(_HEADER)) == _HEADER
