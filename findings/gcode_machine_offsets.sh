#!/bin/sh
# gcode-machine 1.0.3, which simulates a control for senders, keeps inches as mm (G20, X1 is 1 mm) and leaves G92 out: after G92 X0 at
# 100 mm, X2 is 2 mm from the old zero. Work offsets G54, G55 are taken into account.
# Expected: 25.4 mm, and 102 mm.
. "$(dirname "$0")/setup.sh"
packages gcode-machine==1.0.3
python <<'END'
from gcode_machine import GcodeMachine

def end(program, **settings):
    machine = GcodeMachine(impos=(0, 0, 0), ics="G54", **settings)
    machine.do_fractionize_lines = False
    for line in program:
        machine.set_line(line)
        machine.strip()
        machine.tidy()
        machine.parse_state()
        machine.done()
    return list(machine.position_m)

zero = {"cs_offsets": {"G54": (0, 0, 0), "G55": (100, 0, 0)}}
inches = end(["G20", "G1 X1 F10"], **zero)
set_to_zero = end(["G21", "G1 X100 F100", "G92 X0", "G1 X2"], **zero)
offset = end(["G21", "G55", "G1 X2 F100"], **zero)
print("G20 X1:", inches, "G92:", set_to_zero, "G55:", offset)
assert (inches[0], set_to_zero[0], offset[0]) == (1.0, 2.0, 102.0)
END
