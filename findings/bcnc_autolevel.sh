#!/bin/sh
# bCNC 0.9.16 levels a program by a probed map in absolute ends, whatever the program says: under G91 two steps of 5 mm from X2 become X7,
# X10 and X12, which a control in G91 adds up. G20 and G55 are left out where they stand in the line of a move: G20 G1 X0.5 is G1 X0.5.
# Expected: steps, or G90 before the ends; G20 and G55 kept. Words in lines of their own are kept, and absolute programs levelled right.
. "$(dirname "$0")/setup.sh"
export PIP_NO_DEPS=1 # its window needs more; the module that levels needs these alone
packages bcnc==0.9.16 svgelements==1.9.6 numpy==1.26.4
python <<'END'
import builtins
import importlib.util
import pathlib
import sys

root = pathlib.Path(next(iter(importlib.util.find_spec("bCNC").submodule_search_locations)))
sys.path[:0] = [str(root), str(root / "lib")]
builtins._ = str
from CNC import GCode

nodes = [f"{x} {y} 0.1" for y in (0, 10, 20) for x in (0, 10, 20)]
pathlib.Path("flat.probe").write_text("\n".join(["0 20 3", "0 20 3", "-5 5 100", "", *nodes]) + "\n")

def levelled(*lines):
    program = GCode()
    program.probe.load("flat.probe")
    program.initPath()
    return program.autolevelBlock(list(lines))

absolute = levelled("G90", "G0 X2 Y2 Z1", "G1 X7 F100")
steps = levelled("G0 X2 Y2 Z1", "G91", "G1 X5 F100", "G1 X5")
inches, zero = levelled("G20 G1 X0.5 F10"), levelled("G55 G0 X1 Y1 Z1")
print(*map(" | ".join, (absolute, steps, inches, zero)), sep="\n")
assert absolute == ["G90", "G0X2Y2Z1.1", "G1X7Y2Z1.1F100"]
assert steps == ["G0X2Y2Z1.1", "G91", "G1X7Y2Z1.1F100", "G1X10Y2Z1.1", "G1X12Y2Z1.1"]
assert inches[-1] == "G1X0.5Y0Z0.0039" and zero == ["G0X1Y1Z1.1"]
END
