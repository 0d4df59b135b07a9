"""The readers of binary files, with samples of their files."""

from __future__ import annotations

from tests.support.mutated_files import Reader

BINARY_READERS: tuple[Reader, ...] = ()
