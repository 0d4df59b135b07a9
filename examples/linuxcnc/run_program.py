#!/usr/bin/python3
"""The user interface of the simulated machine: brings it up, runs one program, and leaves.

LinuxCNC starts it by the line DISPLAY of machine.ini; the program's path comes in
PRETRAVEL_PROGRAM; PRETRAVEL_FEED_OVERRIDE is a factor. Its exit status becomes that of linuxcnc:
0 the program ran to its end, 1 the control reported an error, 3 a fault of the control itself (run
the program again): the race "Queue is not empty after probing", a machine that does not come up or
home, a task that vanished or stands still.
"""

import os
import subprocess
import sys
import time
from pathlib import Path

import linuxcnc

LONGEST = float(os.environ.get("PRETRAVEL_TIMEOUT", "1800"))  # s
STANDSTILL = 60.0  # s, much longer than any pause of our programs
RACE = "Queue is not empty after probing"


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


def main():  # noqa: PLR0915, C901
    program = os.environ.get("PRETRAVEL_PROGRAM")
    if not program or not Path(program).is_file():
        print(f"PRETRAVEL_PROGRAM names no file: {program}", file=sys.stderr)
        return 1
    command, status, channel = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()

    def wait_until(reached, seconds):
        stop = time.monotonic() + seconds
        while time.monotonic() < stop:
            status.poll()
            if reached():
                return True
            time.sleep(0.01)
        return False

    command.state(linuxcnc.STATE_ESTOP_RESET)
    command.wait_complete()
    command.state(linuxcnc.STATE_ON)
    command.wait_complete()
    if not wait_until(lambda: status.task_state == linuxcnc.STATE_ON, 60.0):
        errors_of(channel)
        print("the machine did not come up", file=sys.stderr)
        return 3
    # A busy computer can lose a command; homing again does no harm.
    for _ in range(6):
        command.mode(linuxcnc.MODE_MANUAL)
        command.wait_complete()
        command.home(-1)
        if wait_until(lambda: all(status.homed[: status.joints]), 10.0):
            break
    else:
        errors_of(channel)
        print("the machine did not home", file=sys.stderr)
        return 3
    command.mode(linuxcnc.MODE_AUTO)
    command.wait_complete()
    command.feedrate(float(os.environ.get("PRETRAVEL_FEED_OVERRIDE", "1")))
    command.wait_complete()
    command.program_open(program)
    command.wait_complete()
    command.auto(linuxcnc.AUTO_RUN, 0)
    # A short program may be over before it is seen running.
    wait_until(lambda: status.interp_state != linuxcnc.INTERP_IDLE, 1.0)
    errors = []
    stop = time.monotonic() + LONGEST
    watch = Watch()
    while not errors:
        status.poll()
        errors += errors_of(channel)
        if fault := watch.fault(status):
            print(fault, file=sys.stderr)
            return 3
        if status.interp_state == linuxcnc.INTERP_IDLE and status.inpos:
            break
        if time.monotonic() > stop:
            errors.append(f"the program did not end within {LONGEST:g} s")
            print(errors[-1], file=sys.stderr)
        time.sleep(0.02)
    time.sleep(0.1)
    errors += errors_of(channel)
    status.poll()
    active = sorted({code for code in status.gcodes[1:] if code > 0})
    modes = " ".join(f"G{code / 10:g}" for code in active)
    print(f"modes at the end: {modes}", file=sys.stderr)
    print(f"largest depth of the straight tip: {largest_depth()} mm", file=sys.stderr, flush=True)
    if errors:
        command.abort()
        command.wait_complete()
    command.state(linuxcnc.STATE_OFF)
    if any(RACE in text for text in errors):
        return 3
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
