"""Each fault of a probe on the real LinuxCNC, and the page that states what came of it.

`python -m tests.machine.fault_matrix` runs all of them and writes the table of the page.
"""

from __future__ import annotations

import os
import re
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from tests.machine.conftest import SIMULATOR, simulated
from tests.machine.test_linuxcnc_faults import HOME_IN_INCHES, depth_of, faulty, program_text

PAGE = Path(__file__).parent.parent.parent / "docs" / "how-to" / "linuxcnc-faults.md"
_LINE = "| --- | --- | --- | --- | --- |"
OPENS_OR_NOT = "the program ends normally, or `stopped with cause 4, the probe stays tripped`"
"""By chance, as the times of signal and control fall."""
STATE_BEFORE = "G20 G91 G55 G64 P0.001 G17 G94"
AS_BEFORE = re.compile(
    r"modes at the end: .*G20.*G55.*G64.*G91 .*, feed override on, tool length 0 0 0 mm"
)
AT_THE_END = re.compile(
    r"modes at the end: .*G17.*G20.*G54.*G64.*G90 .*G94.*, feed override on, tool length 0 0 0 mm"
)
"""M2 selects G17, G54, G90 and G94; all else is as before."""
AFTER = 4
"""The touch after this number has the fault."""


@dataclass(frozen=True)
class FaultCase:
    """A fault, its number in the simulated probe, and what the machine does."""

    words: str
    fault: int
    did: str
    size: float = 1.7
    after: int = AFTER
    clamp: bool = False
    varies: str = ""


CASES = (
    FaultCase("dead: no signal", 1, "moves to the end of the touch, then back to its start"),
    FaultCase("stuck: stays tripped after the touch", 2, "moves back to the start of the touch"),
    FaultCase("early: trips 1.7 mm before the surface", 3, "the control stops the move there"),
    FaultCase(
        "late: trips 1.7 mm behind the surface", 6, "stops at the contact, then back to the start"
    ),
    FaultCase("bounces on the way back", 5, "goes back once more; the program continues"),
    FaultCase(
        "chatters while it is in contact", 8, "goes back up to three times", varies=OPENS_OR_NOT
    ),
    FaultCase("breaks on the way back: no signal", 9, "the next touch ends as with a dead probe"),
    FaultCase("breaks on the way back: stays tripped", 10, "stops on the way back"),
    FaultCase(
        "knocked in the air, for 20 ms", 11, "tries up to three times to go on to the start", 1.9
    ),
    FaultCase("loses one touch", 12, "moves to the end of the touch, then back to its start"),
    FaultCase("spike of 2 ms, 1.7 mm before the surface", 7, "the control stops the move there"),
    FaultCase("tripped from the beginning", 4, "no move", after=0),
    FaultCase(
        "a clamp in the way", 0, "stops at the contact, then back on the same path", clamp=True
    ),
)


@dataclass(frozen=True)
class FaultOutcome:
    """What the control said, the depth of the straight tip, and the state. [mm]"""

    message: str
    depth: float
    as_before: bool
    ended: bool

    def row(self, case: FaultCase) -> str:
        """The row of the table."""
        depth = "nothing touched" if self.depth < -1.0 else f"{self.depth:.2f} mm"
        state = "as M2 leaves it" if self.ended and not case.varies else "as before"
        state = state if self.as_before else "NOT as before"
        message = case.varies or self.message
        return f"| {case.words} | {case.did} | {message} | {depth} | {state} |"


def outcome_of(case: FaultCase, folder: Path) -> FaultOutcome:
    """Run the program of twelve touches with this fault."""
    folder.mkdir(parents=True)
    program = folder / "sphere.ngc"
    program.write_text(HOME_IN_INCHES + program_text())
    probe = faulty(folder / "f.hal", case.fault, case.after, case.size)
    if case.clamp:  # Half a millimetre in the way beside the equator of the sphere.
        probe.write_text(
            probe.read_text()
            + "".join(
                f"setp pretravel-probe.0.{name}-3 {value}\n"
                for name, value in {"kind": 1, "x": 79.0, "y": 50.0, "z": -18.0, "a": 6.0}.items()
            )
        )
    done = simulated(program, probe, PRETRAVEL_STARTUP=STATE_BEFORE)
    said = done.stdout + done.stderr
    messages = re.findall(r"^control: ((?:s\d+: |Probe ).*)$", said, re.M)
    ran = "the program ends normally" if done.returncode == 0 else "no message"
    ended = done.returncode == 0
    as_before = bool((AT_THE_END if ended else AS_BEFORE).search(said))
    message = f"`{messages[-1]}`" if messages else ran
    return FaultOutcome(message, depth_of(said), as_before, ended)


def main() -> None:
    """Write the table of the page."""
    os.environ.setdefault("PATH", os.defpath)
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(2) as pool:
        work = [(case, Path(folder) / f"case{n}") for n, case in enumerate(CASES)]
        rows = pool.map(lambda item: outcome_of(*item).row(item[0]), work)
        head, _, rest = PAGE.read_text(encoding="utf-8").partition(_LINE)
        tail = rest[rest.index("\n\n") :]
        PAGE.write_text(head + _LINE + "\n".join(["", *rows]) + tail, encoding="utf-8")


if __name__ == "__main__":
    assert SIMULATOR.is_dir()
    main()
