"""Macro programs for Haas controls."""

from __future__ import annotations

from pretravel.controls.macro_b import MacroDialect, macro_b_control

HAAS = MacroDialect(
    "Haas",
    free=((101, 149), (500, 549), (600, 699), (800, 999), (10001, 10149), (10200, 10499),
          (10500, 10549), (10600, 10699), (10800, 10999)),
    base=10200,
    digits=5,
    angles="haas/angles.nc",
    verified=(
        "not yet tried on a Haas control - test with care",
        "its arithmetic was tested with the interpreter of pretravel",
    ),
)  # fmt: skip
"""Macros of Haas: variables 10000 and above on the Next Generation Control, 800 to 999 on all.

150 to 199 and 550 to 599 belong to the probe, 700 to 749 to the control. 10500 to 10549 are 500
to 549 under another name, 10600 to 10699 are 600 to 699, 10800 to 10999 are 800 to 999: a table
from 10200 on ends before them.
"""

TO_HAAS = macro_b_control(HAAS, f"{HAAS.base} (800 on controls before NGC)")
