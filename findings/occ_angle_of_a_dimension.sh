#!/bin/sh
# Open CASCADE 8.0.1 writes the value of an angular dimension as rad and reads it as degrees: one of 90 comes back as
# 5156.62 (90 * 180 / pi), one of pi/2 as 90. Its deviations are not changed: ±0.5 comes back as ±0.5 beside both.
# Expected: one unit for both ways, and for the deviations.
. "$(dirname "$0")/setup.sh"
packages cadquery-ocp-novtk==8.0.1.1.0
python >"$folder/out" 2>&1 <<'END' || { tail -3 "$folder/out"; exit 1; }
import math

from occ_pmi import dimension, round_trip

found = {}
for angle in (90.0, math.pi / 2):
    dimensions, *_ = round_trip("box.stp", [dimension("Angular", angle, upper=0.5, lower=-0.5)])
    found[angle] = (round(dimensions[0].GetValue(), 6), dimensions[0].GetUpperTolValue())
print("SEEN", found)
assert found == {90.0: (5156.620156, 0.5), math.pi / 2: (90.0, 0.5)}, found
END
grep SEEN "$folder/out"
