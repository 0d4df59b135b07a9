#!/bin/sh
# nc-gcode-interpreter 0.1.9 (programs of SINUMERIK; the newest for Python 3.11) reads G91 X5 after X10 as X5, keeps the offset of TRANS X10 after
# TRANS alone and after TRANS Y5, adds it again to X=IC(2), and takes ROT Z90 and MIRROR X0 for moves to Z90 and X0. None is an error.
# Expected: 15; TRANS alone deletes the offset, another TRANS replaces it; IC adds 2; a rotation that is applied or refused.
. "$(dirname "$0")/setup.sh"
packages nc-gcode-interpreter==0.1.9 polars==2.1.0
python <<'END'
from nc_gcode_interpreter import nc_to_dataframe

def ends(axis, *lines):
    return nc_to_dataframe("\n".join(lines) + "\n")[0][axis].to_list()[-1]

seen = {
    "G91 X5 after X10": ends("X", "G90 G1 X10 F100", "G91", "X5"),
    "X1 after TRANS alone": ends("X", "TRANS X10", "G1 X1 F100", "TRANS", "X1"),
    "X1 after TRANS Y5": ends("X", "TRANS X10", "TRANS Y5", "G1 X1 Y1 F100"),
    "X=IC(2) at 11, under TRANS X10": ends("X", "TRANS X10", "G1 X1 F100", "X=IC(2)"),
    "X=IC(2) at 11": ends("X", "G1 X11 F100", "X=IC(2)"),
    "Z after ROT Z90": ends("Z", "G1 X1 Z0 F100", "ROT Z90", "G1 X10"),
}
print(seen)
assert list(seen.values()) == [5, 11, 11, 23, 13, 90]
END
