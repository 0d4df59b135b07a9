#!/bin/sh
# Open CASCADE 8.0.1 loses the sign of a lower deviation: 30 mm +0.1/-0.2 is written and read as +0.1/+0.2, and
# 30 mm +0.3/+0.1 (a fit beside its nominal size) is the same file as +0.3/-0.1.
# Expected: a signed lower bound, as of the measure in the file.
. "$(dirname "$0")/setup.sh"
packages cadquery-ocp-novtk==8.0.1.1.0
python >"$folder/out" 2>&1 <<'END' || { tail -3 "$folder/out"; exit 1; }
from occ_pmi import dimension, round_trip

found = []
for upper, lower in ((0.1, -0.2), (0.3, 0.1), (0.3, -0.1)):
    dimensions, *_ = round_trip(
        "box.stp", [dimension("LinearDistance", 30.0, upper=upper, lower=lower)]
    )
    found.append((dimensions[0].GetUpperTolValue(), dimensions[0].GetLowerTolValue()))
print("SEEN", found)
assert found == [(0.1, 0.2), (0.3, 0.1), (0.3, 0.1)], found
END
grep SEEN "$folder/out"
