"""LinuxCNC's interpreter alone, without a machine."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path


def interpret(program: Path) -> subprocess.CompletedProcess[str]:
    """Run a program with rs274, in the folder of the program.

    The folder is also the home: rs274 empties the file .tool.mmap there, which all LinuxCNC
    processes of a user share. In the user's home it would end one that runs beside.
    """
    return subprocess.run(
        ["rs274", "-g", program.name], cwd=program.parent, capture_output=True, text=True,
        check=False, timeout=300, env=dict(os.environ, HOME=str(program.parent)),
    )  # fmt: skip
