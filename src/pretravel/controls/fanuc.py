"""Macro programs for Fanuc controls."""

from __future__ import annotations

from pretravel.controls.macro_b import MacroDialect, macro_b_control

FANUC = MacroDialect(
    "Fanuc",
    free=((500, 999),),
    base=600,
    digits=4,
    volatile=(100, 199),
    angles="fanuc/angles.nc",
    verified=(
        "not yet tried on a Fanuc control - test with care",
        "its arithmetic was tested in LinuxCNC and with the interpreter of pretravel",
    ),
)
"""Macro B of Fanuc. The table starts above the variables of the usual probing macros."""

TO_FANUC = macro_b_control(FANUC, f"{FANUC.base}")
