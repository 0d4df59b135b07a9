#!/bin/sh
# ncplot7py 0.2.0, macros for FANUC_MILL: ATAN[-1]/[-1] is 45 and ATAN[1]/[-1] is -45: the angle of a probed edge is half a turn off wherever the second
# number is below zero. ATAN[1,2], 10 MOD 3, LN[8] and EXP[2] are 0, and `errors` is empty. G68 X10 Y0 R90 is no rotation, but a move to X10.
# Expected: 225 (-135 by a parameter) and 135, as in FANUC's manual; 26.57, 1, 2.08, 7.39; X20 Y0 is at X10 Y10 after G68.
. "$(dirname "$0")/setup.sh"
packages ncplot7py==0.2.0
python <<'END'
import logging
import math

from ncplot7py.application.nc_execution import NCExecutionEngine
from ncplot7py.domain.cnc_state import CNCState
from ncplot7py.domain.machines import get_machine_config
from ncplot7py.infrastructure.machines.base_stateful_control import UniversalConfigDrivenControl

logging.disable()


def run(program):
    control = UniversalConfigDrivenControl(init_nc_states=[CNCState(machine_config=get_machine_config("FANUC_MILL"))])
    engine = NCExecutionEngine(control)
    result = engine.get_Syncro_plot([program], synch=False)[0]
    assert not engine.errors, engine.errors
    return result["variables"], [(round(move["x"][-1], 6), round(move["y"][-1], 6)) for move in result["plot"]]


right = {"ATAN[1]/[1]": 45, "SIN[30]": 0.5, "ROUND[2.5]": 3, "10-2-3": 5}
wrong = {"ATAN[-1]/[-1]": (45, 225), "ATAN[1]/[-1]": (-45, 135), "ATAN[1,2]": (0, math.degrees(math.atan2(1, 2))),
         "10 MOD 3": (0, 1), "LN[8]": (0, math.log(8)), "EXP[2]": (0, math.exp(2))}
for text, value in right.items():
    assert abs(run(f"#1={text}\nM30\n")[0]["1"] - value) < 1e-9, text
for text, (value, expected) in wrong.items():
    seen = run(f"#1={text}\nM30\n")[0]["1"]
    print(f"{text} = {seen:g}, expected {expected:g}")
    assert abs(seen - value) < 1e-9, text
moves = run("G90 G17 G0 X0 Y0\nG68 X10 Y0 R90\nG1 X20 Y0 F100\nG69\nM30\n")[1]
print("G68:", moves, "expected (0, 0) and (10, 10)")
assert moves == [(0, 0), (10, 0), (20, 0)]
END
