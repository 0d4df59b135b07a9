#!/bin/sh
# pygcode 0.2.1: its machine under G20 stays in mm (X1 is 1), a probing move (G38.2) ends where it was told to, and G10 L2 moves no zero.
# A line with a comment in brackets and one after a semicolon, "G1 X5 (wall) ; probe", is refused, as are variables (#1=5).
# Expected: 25.4; both comments.
. "$(dirname "$0")/setup.sh"
packages pygcode==0.2.1
python <<'END'
from pygcode import Line, Machine

machine = Machine()
for text in ("G21 G90 G54", "G20", "G1 X1 F10", "G10 L2 P1 X100", "G38.2 Z-10 F1"):
    machine.process_block(Line(text).block)
print(machine.pos)
assert (machine.pos.X, machine.pos.Z) == (1, -10), machine.pos
assert [str(g) for g in Line("G1 X5 ; probe").block.gcodes] == ["G01 X5"]
for text in ("G1 X5 (wall) ; probe", "#1=5"):
    try:
        Line(text)
    except Exception as error:
        print(text, "->", type(error).__name__)
        assert type(error).__name__ == "GCodeWordStrError"
    else:
        raise SystemExit(f"'{text}' is read now")
END
