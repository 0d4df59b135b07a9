"""The command line in this process, and the tables that it writes."""

from __future__ import annotations

import contextlib
import csv
import io
import shlex
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

from pretravel.cli import main
from tests.support.examples import EXAMPLES


def run(*arguments: object, code: int = 0) -> str:
    """Run a command in this process; return stdout, or stderr if a fault (2) is expected."""
    out, err = both_outputs(*arguments, code=code)
    return err if code == 2 else out


def both_outputs(*arguments: object, code: int = 0) -> tuple[str, str]:
    """Run a command in this process; return stdout and stderr, where warnings go."""
    out, err = io.StringIO(), io.StringIO()
    stopped = 0
    with (
        pytest.MonkeyPatch.context() as patch,
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        patch.setattr(sys, "argv", ["pretravel", *map(str, arguments)])
        try:
            main.run()
        except SystemExit as stop:
            stopped = int(stop.code or 0)
    assert stopped == code, out.getvalue() + err.getvalue()
    assert "Traceback" not in err.getvalue()
    return out.getvalue(), err.getvalue()


def follow(line: str, *, code: int = 0) -> str:
    """Do what a line of a page says, in the folder where the test is; what it prints, with stderr.

    A line is a command of pretravel, with ``>`` where stdout goes to a file and ``|| [ $? -eq 3 ]``
    where its answer is exit code 3, or a ``cp``.
    """
    line = line.replace("$EXAMPLES", str(EXAMPLES))
    program, *words = shlex.split(line, comments=True)
    if program == "cp":
        shutil.copy(*words)
        return ""
    assert program == "pretravel", line
    if words[-6:] == ["||", "[", "$?", "-eq", "3", "]"]:
        words, code = words[:-6], 3
    to_file = words[-2:-1] == [">"]
    out, err = both_outputs(*(words[:-2] if to_file else words), code=code)
    if to_file:
        Path(words[-1]).write_text(out, encoding="utf-8")
    return out + err


def rows(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def positions(path: Path) -> np.ndarray:
    return np.array([[float(row[k]) for k in ("x_mm", "y_mm", "z_mm")] for row in rows(path)])
