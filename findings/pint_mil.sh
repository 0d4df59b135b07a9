#!/bin/sh
# pint 0.25.3: "mil" is an angle (1/6400 of a turn), a thousandth of an inch is "thou". unyt 3.2.0 and metrolopy 1.1.1 read "mil" as 0.0254 mm.
# Expected: what machinists say.
. "$(dirname "$0")/setup.sh"
packages pint==0.25.3 unyt==3.2.0 metrolopy==1.1.1 numpy==2.4.6
python <<'END'
import pint
import unyt
from metrolopy import gummy

units = pint.UnitRegistry()
print("unyt", unyt.unyt_quantity(1, "mil").to("mm"), "metrolopy", gummy(1, unit="mil").convert("mm"))
assert abs(float(unyt.unyt_quantity(1, "mil").to("mm")) - 0.0254) < 1e-12
assert abs(units("thou").to("mm").magnitude - 0.0254) < 1e-12
try:
    units("mil").to("mm")
except pint.DimensionalityError as error:
    print("pint:", error)
else:
    raise SystemExit("mil is a length now")
END
