"""The log of our programs for LinuxCNC, which `pretravel.controls.logs.pretravel_log` reads.

The lines are comma-separated. Each line begins with its kind and ends with the word ``end``: no
reader has to count lines, and a reader detects a line that was cut off.
"""

from __future__ import annotations

LOG_HEAD = "pretravel-log"
"""Kind of the first line."""

SUBROUTINE_LINE = "o<"
"""Beginning of the lines that make a log a subroutine: LinuxCNC does not report a log that it
cannot write, and it can read only subroutines. The log is read back before the first move and at
the end."""

LOG_ENDING = "_log.ngc"
"""Of the name of each log."""

TOUCH_COLUMNS: tuple[str, ...] = (
    "label", "x_um", "y_um", "z_um", "nx", "ny", "nz", "ax", "ay", "az", "feed_mm_min",
    "nominal_x_mm", "nominal_y_mm", "nominal_z_mm", "touched",
)  # fmt: skip
"""Columns of a line ``touch`` of a program: the position of the tip's centre at the trigger in work
coordinates, then the planned touch. The control prints parameters below 1e-4 as zero; therefore
the values that it fills in are in micrometres. The planned values are text of the program."""

SUBROUTINE_TOUCH_COLUMNS: tuple[str, ...] = (
    "label", "x_um", "y_um", "z_um", "nx_millionths", "ny_millionths", "nz_millionths",
    "ax_millionths", "ay_millionths", "az_millionths", "feed_mm_min",
    "nominal_x_um", "nominal_y_um", "nominal_z_um", "touched",
)  # fmt: skip
"""Columns of a line ``touch`` of the subroutine pretravel_point, which has all values in
parameters."""

SURFACE_POINT_COLUMNS: tuple[str, ...] = (
    "label",
    "x_um",
    "y_um",
    "z_um",
    "pretravel_um",
    "deviation_um",
)
"""Columns of a line ``point``: the surface point that the control has compensated."""

FAULTS: tuple[str, ...] = (
    "no contact",
    "contact too early",
    "too late",
    "the probe stays tripped",
    "something in the way",
    "the probe was tripped before",
)
"""Causes of a stop, numbered from 1: in messages of the control, and in a line ``stopped``."""
