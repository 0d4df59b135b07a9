#!/usr/bin/python3
"""A user interface of the simulated machine that aborts a program again and again.

For each run in PRETRAVEL_ABORTS (JSON: a list of {"before": MDI lines, "how": …, "after_s": …},
with "mdi": a line in place of the program) it sets modes, starts the program, aborts it (Esc),
presses the emergency stop, switches the machine off, lets a limit switch stop the control, or waits
for an error of the program itself ("own"), and brings the machine back. The state before and after
goes to PRETRAVEL_STATES (JSON).
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))
import linuxcnc
import run_program

UP = "G53 G0 Z100"


def probe_off(off):
    """A probe that never trips, to get away from a wall after a stop."""
    value = "1" if off else "0"
    subprocess.run(["halcmd", "setp", "pretravel-probe.0.fault", value], check=True)


def state(status):
    """What an abort must not change."""
    status.poll()
    codes = {code for code in status.gcodes[1:] if code > 0}
    motion = (0, 10, 20, 30, 800, 382, 383, 384, 385)
    return {
        "codes": sorted(code / 10 for code in codes - set(motion)),
        # Where the screens say that the tip is.
        "work_offset": status.g5x_index,
        "work_origin": [*status.g5x_offset[:3], *status.g92_offset[:3]],
        "turn": status.rotation_xy,
        "units": status.program_units,
        "feed": status.settings[1],
        "tolerance": status.settings[3],
        "feed_override": bool(status.feed_override_enabled),
        "adaptive_feed": bool(status.adaptive_feed_enabled),
        "tool_offset": list(status.tool_offset[:3]),
    }


def said(channel):
    texts = []
    while (found := channel.poll()) is not None:
        texts.append(found[1].strip())
    return texts


def until(status, reached, wanted):
    stop = time.monotonic() + 60.0
    while time.monotonic() < stop:
        status.poll()
        if reached():
            return
        time.sleep(0.002)
    raise run_program.NoStartError(wanted)


class Runs:
    def __init__(self):
        self.command, self.status = linuxcnc.command(), linuxcnc.stat()
        self.channel = linuxcnc.error_channel()

    def mode(self, mode):
        run_program.reach(
            self.status, self.channel, "no mode",
            lambda: self.command.mode(mode), lambda: self.status.task_mode == mode,
        )  # fmt: skip

    def mdi(self, *lines):
        self.mode(linuxcnc.MODE_MDI)
        for line in lines:
            self.command.mdi(line)
            self.command.wait_complete(20.0)
            until(self.status, lambda: self.status.interp_state == linuxcnc.INTERP_IDLE, line)

    def on(self, stopped):
        def ask():
            if stopped:
                self.command.state(linuxcnc.STATE_ESTOP_RESET)
                self.command.wait_complete(5.0)
            self.command.state(linuxcnc.STATE_ON)

        run_program.reach(
            self.status, self.channel, "not on", ask,
            lambda: self.status.task_state == linuxcnc.STATE_ON,
        )  # fmt: skip
        # The enables of motion follow in a cycle of the servo.
        time.sleep(0.1)

    def begun(self, heard):
        heard += said(self.channel)
        return heard or self.status.interp_state != linuxcnc.INTERP_IDLE

    def one(self, program, run):
        probe_off(True)
        self.mdi("G49 G21 G90 G94", UP, *run["before"])
        probe_off(False)
        before = state(self.status)
        said(self.channel)
        if "mdi" in run:
            self.mode(linuxcnc.MODE_MDI)
            self.command.mdi(run["mdi"])
        else:
            self.mode(linuxcnc.MODE_AUTO)
            self.command.program_open(program)
            self.command.wait_complete(5.0)
            self.command.auto(linuxcnc.AUTO_RUN, 0)
        heard = []  # an error of the program itself can be over before anybody looks
        until(self.status, lambda: self.begun(heard), "begin")
        if run["how"] == "own":
            until(self.status, lambda: self.begun(heard) and heard, "an error")
        time.sleep(run["after_s"])
        self.status.poll()
        ran = self.status.interp_state != linuxcnc.INTERP_IDLE
        measuring = not self.status.feed_override_enabled
        if run["how"] == "abort":
            self.command.abort()
        elif run["how"] == "error":
            for value in "10":
                pin = ["halcmd", "setp", "joint.0.pos-lim-sw-in", value]
                subprocess.run(pin, check=True)
                time.sleep(0.05)
        elif run["how"] != "own":
            off = run["how"] == "off"
            self.command.state(linuxcnc.STATE_OFF if off else linuxcnc.STATE_ESTOP)
        self.command.wait_complete(5.0)
        until(self.status, lambda: self.status.interp_state == linuxcnc.INTERP_IDLE, "idle")
        time.sleep(0.1)
        self.on(run["how"] == "estop")
        after = state(self.status)
        return {
            "how": run["how"], "ran": ran, "measuring": measuring, "before": before,
            "after": after, "said": heard + said(self.channel),
        }  # fmt: skip


def main():
    program = os.environ["PRETRAVEL_PROGRAM"]
    runs = Runs()
    done = []
    outcome = "ended"
    try:
        run_program.bring_up(runs.command, runs.status, runs.channel, program)
        done = [runs.one(program, run) for run in json.loads(os.environ["PRETRAVEL_ABORTS"])]
    except run_program.NoStartError as problem:
        outcome = f"start {problem}"
    depth = run_program.largest_depth()
    sys.stderr.write(f"largest depth of the straight tip: {depth} mm\n")
    Path(os.environ["PRETRAVEL_STATES"]).write_text(json.dumps(done))
    runs.command.state(linuxcnc.STATE_OFF)
    Path(os.environ["PRETRAVEL_OUTCOME"]).write_text(outcome + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
