"""Print what a laboratory states in reports and certificates, to fill in."""

from __future__ import annotations

from pretravel.task import SILENT, Progress, Task, TextResult


class Laboratory(Task):
    """Print a file to edit with the laboratory, its instrument and reference (--lab)."""

    name = "laboratory"
    example = "pretravel laboratory > lab.toml"

    def run(self, progress: Progress = SILENT) -> TextResult:
        """The text of the file."""
        del progress
        from pretravel.files import laboratory_template

        return TextResult(laboratory_template())
