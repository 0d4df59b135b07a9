#!/usr/bin/python3
"""The user interface of the simulated machine: brings it up, runs one program, and leaves.

LinuxCNC starts it by the line DISPLAY of machine.ini; the program's path comes in
PRETRAVEL_PROGRAM. Its exit status becomes that of linuxcnc: 0 the program ran to its end,
1 the control reported an error, 3 the race "Queue is not empty after probing" (run it again).
"""

import os
import sys
import time
from pathlib import Path

import linuxcnc

LONGEST = float(os.environ.get("PRETRAVEL_TIMEOUT", "1800"))  # s
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


def main():
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
    if not wait_until(lambda: status.task_state == linuxcnc.STATE_ON, 10.0):
        errors_of(channel)
        print("the machine did not come up", file=sys.stderr)
        return 1
    command.mode(linuxcnc.MODE_MANUAL)
    command.wait_complete()
    command.home(-1)
    if not wait_until(lambda: all(status.homed[: status.joints]), 10.0):
        errors_of(channel)
        print("the machine did not home", file=sys.stderr)
        return 1
    command.mode(linuxcnc.MODE_AUTO)
    command.wait_complete()
    command.program_open(program)
    command.wait_complete()
    command.auto(linuxcnc.AUTO_RUN, 0)
    # A short program may be over before it is seen running.
    wait_until(lambda: status.interp_state != linuxcnc.INTERP_IDLE, 1.0)
    errors = []
    stop = time.monotonic() + LONGEST
    while not errors:
        status.poll()
        errors += errors_of(channel)
        if status.interp_state == linuxcnc.INTERP_IDLE and status.inpos:
            break
        if time.monotonic() > stop:
            errors.append(f"the program did not end within {LONGEST:g} s")
            print(errors[-1], file=sys.stderr)
        time.sleep(0.02)
    time.sleep(0.1)
    errors += errors_of(channel)
    if errors:
        command.abort()
        command.wait_complete()
    command.state(linuxcnc.STATE_OFF)
    if any(RACE in text for text in errors):
        return 3
    return 1 if errors else 0


if __name__ == "__main__":
    sys.exit(main())
