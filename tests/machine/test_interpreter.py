"""LinuxCNC's own interpreter: the model of the machine says the same, and programs run on it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.support import commands
from tests.support.linuxcnc_interpreter import interpret
from tests.support.machine_model.machine import Machine, run

ARITHMETIC = """
#1=[2+3*4**2] #2=[2**3**2] #3=[10-2-3*2] #4=[-7 MOD 3] #5=[1 OR 0 AND 0]
#6=[ROUND[-2.5]] #7=FIX[-2.8] #8=FUP[-2.8] #9=ATAN[1]/[-1]
(PRINT,#1 #2 #3 #4 #5 #6 #7 #8 #9)
#10=-2 #11=-#10 #12=[-#10**2] #13=SQRT[ABS[#10]] #14=[EXP[1]+LN[2]] #15=[2**-1]
(PRINT,#10 #11 #12 #13 #14 #15)
#16=[1 EQ 1.00005] #17=[1 LT 1.00005] #18=[1 GE 1.00005] #19=[0.5 XOR 0] #20=[3 NE 3.1]
(PRINT,%d#16 #17 #18 #19 #20)
#21=0.00005 #22=0.0001 #23=0.000099
(PRINT,%.9f#21 %.6f#22 %f#23 %lf#1 #<_nothing> 5% %.f)
#24=[ACOS[0.5]+ASIN[0.5]+TAN[45]+COS[60]-SIN[30]] #24=[#24+#24]
(PRINT,#24)
#25=26 #26=7 (PRINT,##25)
#[25+1]=[##25+1]
(PRINT,#26)
#<a name>=3 #<_pretty>=[EXISTS[#<aname>]+2*EXISTS[#<other>]]
(PRINT,#<aname> #<_pretty>)
"""
FLOW = """
o<twice> sub
(PRINT,in #1 #2 #3 #30)
#1=5 #31=6 #<kept>=1
o<twice> endsub [#1*2]
o<early> sub
o1 if [#1 GT 0]
o<early> return
o1 endif
o<early> endsub [3]
#1=9 #<kept>=8
o<twice> call [1] [2]
(PRINT,#1 #31 #<kept> #<_value> #<_value_returned>)
o<early> call [1]
(PRINT,#<_value> #<_value_returned>)
o<early> call [0]
(PRINT,#<_value> #<_value_returned>)
#4=0
o10 while [#4 LT 5]
#4=[#4+1]
o11 if [#4 EQ 2]
o10 continue
o11 elseif [#4 EQ 4]
o10 break
o11 else
(PRINT,while #4)
o11 endif
o10 endwhile
o20 do
#4=[#4+1]
o20 while [#4 LT 6]
o30 repeat [3]
#4=[#4+10]
o31 if [#4 GT 20]
o32 if [0]
(PRINT,never)
o32 endif
o31 else
(PRINT,small)
o31 endif
o30 endrepeat
(PRINT,#4)
o33 sub
(PRINT,computed)
o33 endsub
o[30+3] call
"""
COORDINATES = """
G21 G90 G54
G10 L2 P2 X10 Y20 Z30 R30
G55 G0 X1 Y2 Z3
(PRINT,#5420 #5421 #5422 #<_abs_x> #<_abs_y> #<_abs_z> #5220 #<_coord_system>)
G91 G1 X1 F100
(PRINT,#<_x> #<_y> #<_abs_x> #<_abs_y> #<_absolute> #<_feed>)
G90 G92 X5
(PRINT,#5420 #<_abs_x> #5210)
G0 X0 Y0 Z0
(PRINT,#<_abs_x> #<_abs_y> #<_abs_z>)
G92.1
G10 L20 P0 X3 Y4 Z5
(PRINT,#5420 #5421 #5422 #<_abs_x> #<_abs_y>)
G20 (PRINT,#<_metric>)
(PRINT,#5420 #5421 #5422 #<_abs_x>)
G0 X1
(PRINT,#5420 #<_abs_x> #<_abs_y>)
G53 G0 Z1
(PRINT,#5422 #<_abs_z>)
G21 G43.1 Z10
(PRINT,#5422 #<_abs_z> #<_tool_offset>)
G0 Z0
(PRINT,#5422 #<_abs_z>)
G49
(PRINT,#5422 #<_abs_z>)
"""
STATE = """
G21 G90 G54 G61 F100.26 S500 M5 M9
o<changes> sub
M73
G20 G91 G55 F3 M49 M8
(PRINT,#<_metric> #<_absolute> #<_coord_system> #<_feed_override> #<_flood>)
o<changes> endsub
o<changes> call
(PRINT,#<_metric> #<_absolute> #<_coord_system> #<_feed_override> #<_feed>)
M70
G91 G56 M50 P0 M3 G93 F2
M52 P1
(PRINT,#<_spindle_on> #<_adaptive_feed> #<_feed_override> #<_speed_override> #<_inverse_time>)
M72
(PRINT,#<_spindle_on> #<_adaptive_feed> #<_feed_override> #<_speed_override> #<_feed>)
(PRINT,#<_absolute> #<_coord_system> #<_units_per_minute>)
M50 P0
M70
M48
M72
(PRINT,#<_feed_override> #<_speed_override>)
M49
M70
M51 P1
M72
(PRINT,#<_feed_override> #<_speed_override>)
"""
WRONG = (
    "#1=[1/0]", "#1=[#<nothing>]", "G1 X1", "G99.9", "X1", "G0 G1 X1", "F10 G38.2 X0", "M72",
    "#1=[1+", "G0 X1 X2", "T99", "G43 H99", "(ABORT,hello #5220)", "M48 M50",
    "F3 G53 G38.2 X1", "#<_x>=3", "G80 X3", "#1=SQRT[-1]", "#1=[-2**0.5]", "(a(b)",
    "G10 L20 P1 R3", "#5400=1", "G91 G53 G0 X1", "F1 G38.3", "#1=ACOS[2]", "G0 X#[0-1]",
)  # fmt: skip


def real(folder: Path, text: str) -> list[str]:
    """What LinuxCNC's interpreter prints, without its canonical commands."""
    program = folder / "program.ngc"
    program.write_text(text)
    done = interpret(program)
    lines = [line for line in done.stdout.splitlines() if " N....." not in line]
    errors = [line for line in done.stderr.splitlines() if line != "executing"]
    return lines + errors[:1]


class TestModelOfTheMachine:
    @pytest.mark.parametrize(
        "text",
        [ARITHMETIC, FLOW, COORDINATES, STATE],
        ids=["arithmetic", "flow", "places", "state"],
    )
    def test_small_programs(self, tmp_path: Path, text: str) -> None:
        text = text.strip() + "\nM2\n"
        trace = run(Machine(position=(0.0, 0.0, 0.0)), text)
        assert trace.error == ""
        assert list(trace.printed) == real(tmp_path, text)

    def test_messages_of_errors(self, tmp_path: Path) -> None:
        for line in WRONG:
            text = f"G21\n{line}\nM2\n"
            trace = run(Machine(position=(0.0, 0.0, 0.0)), text)
            told = real(tmp_path, text)
            assert trace.error, line
            assert told[-1:] == [trace.error], line

    @pytest.mark.parametrize("saved", ["M48", "M49", "M50 P0", "M51 P0"])
    @pytest.mark.parametrize("now", ["M48", "M49", "M50 P0", "M51 P0"])
    def test_overrides_after_M72(self, tmp_path: Path, saved: str, now: str) -> None:
        text = f"{saved}\nM70\nM48\n{now}\nM72\n(PRINT,#<_feed_override> #<_speed_override>)\nM2\n"
        assert list(run(Machine(), text).printed) == real(tmp_path, text)


@pytest.mark.parametrize("by_hand", [False, True])
def test_a_program_turns_the_spindle_once_and_keeps_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, by_hand: bool
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mill.toml").write_text(commands.run("machine"))
    # The subroutines lie beside the program, as on a machine: those of the program come first.
    commands.run("program", "mdi", "-o", ".")
    more = ["--by-hand"] if by_hand else []
    commands.run("program", "sphere", "mill.toml", "--diameter", 25, "--count", 4, "--polar", "90",
        "--spindle", 180, *more, "-o", "a.ngc")  # fmt: skip
    calls = [
        line.split("..... ")[1]
        for line in interpret(Path("a.ngc").absolute()).stdout.splitlines()
        if "..... " in line
    ]
    turned = "PROGRAM_STOP()" if by_hand else "ORIENT_SPINDLE(0, 180.0000, 0)"
    at = calls.index(turned)
    touches = [n for n, call in enumerate(calls) if call.startswith("STRAIGHT_PROBE")]
    assert touches[0] < at < touches[1]  # up to the safe height, and then all others
    last = calls.index('LOG("done,4,end")')
    assert touches[-1] < last
    released = [call for call in calls[at:last] if call.startswith("STOP_SPINDLE")]
    assert bool(released) == by_hand
