#!/usr/bin/python3
"""The user interface of the simulated machine: brings it up, runs one program, and leaves.

LinuxCNC starts it by the line DISPLAY of machine.ini; the program's path comes in
PRETRAVEL_PROGRAM; PRETRAVEL_FEED_OVERRIDE is a factor. How the run ended is the first word of the
file that PRETRAVEL_OUTCOME names, because the exit status of linuxcnc says it only where this
program was reached:

- `ended`: the program ran to its end;
- `error`: the control reported an error;
- `fault`: the control itself failed during the program: the race "Queue is not empty after
  probing", a task that vanished or stands still;
- `start`: the machine did not come up, home, load the program or begin it.

Every command is repeated until the state that it asks for is there: a busy computer loses commands.
"""

import os
import re
import subprocess
import sys
import time
from pathlib import Path

import linuxcnc

LONGEST = float(os.environ.get("PRETRAVEL_TIMEOUT", "1800"))  # s
STANDSTILL = 60.0  # s, much longer than any pause of our programs
RACE = "Queue is not empty after probing"
PATIENCE = 90.0  # s, for each state on the way to the start of the program
REPEAT = 10.0  # s, after which a command counts as lost
END = re.compile(r"/?\s*(N\d+)?\s*M(0?2|30)\b", re.IGNORECASE)
"""The last line that runs, M2 or M30; a program between two % has none."""


class NoStartError(Exception):
    """The machine did not reach a state on the way to the start of the program."""


def errors_of(channel):
    """What the control said since it was last asked: errors, and messages of programs."""
    errors = []
    while (said := channel.poll()) is not None:
        kind, text = said
        print(f"control: {text.strip()}", file=sys.stderr, flush=True)
        if kind in (linuxcnc.NML_ERROR, linuxcnc.OPERATOR_ERROR):
            errors.append(text)
    return errors


def task_is_there():
    """Whether the process that interprets programs still runs; on a busy computer it can vanish."""
    for entry in Path("/proc").glob("[0-9]*/stat"):
        try:
            name, _, rest = entry.read_text().partition(") ")
        except OSError:
            continue
        # A process that has ended stays as a zombie, state Z, where nobody collects it.
        if name.endswith("(milltask") and not rest.startswith("Z"):
            return True
    return False


class Watch:
    """Notices that the control itself has failed: its task is gone, or nothing changes any more."""

    def __init__(self):
        self.looked = self.changed = time.monotonic()
        self.state = None

    def fault(self, status):
        """The fault as text, or "" while the control works or the program pauses on purpose."""
        now = time.monotonic()
        state = (status.motion_line, tuple(status.actual_position), status.interp_state)
        if state != self.state or status.paused:
            self.state, self.changed = state, now
        if now > self.changed + STANDSTILL:
            return f"the machine has stood still for {STANDSTILL:g} s within the program"
        if now > self.looked + 2.0:
            self.looked = now
            if not task_is_there():
                return "the task of the control has vanished"
        return ""


def largest_depth():
    """Of the tip in what it touches, were the stylus straight, as text."""
    command = ["halcmd", "getp", "pretravel-probe.0.largest-depth"]
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()


def reach(status, channel, wanted, ask, reached):
    """Give a command until its state is there; where it does not come, its name is the error."""
    stop = time.monotonic() + PATIENCE
    while time.monotonic() < stop:
        ask()
        again = time.monotonic() + REPEAT
        while time.monotonic() < again:
            status.poll()
            if reached():
                return
            time.sleep(0.01)
        errors_of(channel)
    raise NoStartError(f"{wanted} within {PATIENCE:g} s")


def bring_up(command, status, channel, program):
    """A machine that is on, homed, in mode AUTO, with the program loaded."""

    def come(wanted, ask, reached):
        reach(status, channel, wanted, ask, reached)

    def in_mode(name, mode):
        come(f"no mode {name}", lambda: command.mode(mode), lambda: status.task_mode == mode)

    def switch_on():
        command.state(linuxcnc.STATE_ESTOP_RESET)
        command.wait_complete(REPEAT)
        command.state(linuxcnc.STATE_ON)

    def home():
        in_mode("MANUAL", linuxcnc.MODE_MANUAL)
        command.home(-1)

    come("the machine did not come up", switch_on, lambda: status.task_state == linuxcnc.STATE_ON)
    come("the machine did not home", home, lambda: all(status.homed[: status.joints]))
    in_mode("AUTO", linuxcnc.MODE_AUTO)
    factor = float(os.environ.get("PRETRAVEL_FEED_OVERRIDE", "1"))
    come("no feed override", lambda: command.feedrate(factor), lambda: status.feedrate == factor)
    come(
        "the program was not loaded",
        lambda: command.program_open(program),
        lambda: status.file == program and status.interp_state == linuxcnc.INTERP_IDLE,
    )


def begin(command, status, channel):
    """Start the program. One that is over before it is seen running leaves its last line."""
    before = status.command
    command.auto(linuxcnc.AUTO_RUN, 0)
    stop = time.monotonic() + PATIENCE
    while time.monotonic() < stop:
        status.poll()
        if status.interp_state != linuxcnc.INTERP_IDLE or status.command != before:
            return []
        if errors := errors_of(channel):
            return errors
        time.sleep(0.005)
    raise NoStartError(f"the program did not begin within {PATIENCE:g} s")


def between_percent_signs(program):
    """Whether the program ends with %, as tapes did: its last line can be any."""
    return Path(program).read_text(errors="replace").rstrip().endswith("%")


def follow(status, channel, errors):
    """Wait for the end of the program; returns outcome and what the control said."""
    stop = time.monotonic() + LONGEST
    watch = Watch()
    while not errors:
        status.poll()
        errors = errors_of(channel)
        if fault := watch.fault(status):
            return f"fault {fault}", errors
        if status.interp_state == linuxcnc.INTERP_IDLE and status.inpos:
            break
        if time.monotonic() > stop:
            errors = [f"the program did not end within {LONGEST:g} s"]
            print(f"control: {errors[0]}", file=sys.stderr)
        time.sleep(0.02)
    time.sleep(0.1)  # messages of the last line
    errors += errors_of(channel)
    status.poll()
    if any(RACE in text for text in errors):
        return f"fault {RACE}", errors
    if errors:
        return "error", errors
    if not (END.match(status.command) or between_percent_signs(status.file)):
        return f"fault the program stopped at the line {status.command.strip()!r}", errors
    return "ended", errors


def main():
    program = os.environ.get("PRETRAVEL_PROGRAM")
    if not program or not Path(program).is_file():
        print(f"PRETRAVEL_PROGRAM names no file: {program}", file=sys.stderr)
        return 1
    command, status, channel = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()
    try:
        bring_up(command, status, channel, program)
        outcome, errors = follow(status, channel, begin(command, status, channel))
    except NoStartError as problem:
        errors_of(channel)
        outcome, errors = f"start {problem}", []
    else:
        active = sorted({code for code in status.gcodes[1:] if code > 0})
        modes = " ".join(f"G{code / 10:g}" for code in active)
        override = "on" if status.feed_override_enabled else "OFF"
        length = " ".join(f"{value:g}" for value in status.tool_offset[:3])
        state = f"feed override {override}, tool length {length} mm"
        print(f"modes at the end: {modes}, {state}", file=sys.stderr)
        print(
            f"largest depth of the straight tip: {largest_depth()} mm", file=sys.stderr, flush=True
        )
    if errors:
        command.abort()
        command.wait_complete()
    command.state(linuxcnc.STATE_OFF)
    print(outcome, file=sys.stderr)
    if kept := os.environ.get("PRETRAVEL_OUTCOME"):
        Path(kept).write_text(outcome + "\n")
    return 0 if outcome == "ended" else 1


if __name__ == "__main__":
    sys.exit(main())
