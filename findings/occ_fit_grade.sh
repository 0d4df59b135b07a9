#!/bin/sh
# Open CASCADE 8.0.1 writes a fit H7 into AP242 as 'H', grade '9': the number of the grade in its own list (01, 0, 1 …
# is 0, 1, 2 …), not its name. Its own reader turns it back, another reads H9: 62 instead of 25 µm at 50 mm.
# Expected: LIMITS_AND_FITS('H','hole','7','').
. "$(dirname "$0")/setup.sh"
packages cadquery-ocp-novtk==8.0.1.1.0
python >"$folder/out" 2>&1 <<'END' || { tail -3 "$folder/out"; exit 1; }
import re

from OCP.XCAFDimTolObjects import XCAFDimTolObjects_DimensionFormVariance as Letter
from OCP.XCAFDimTolObjects import XCAFDimTolObjects_DimensionGrade as Grade
from occ_pmi import dimension, round_trip

written = {}
for grade in (6, 7, 8, 11):
    fit = dimension("Thickness", 10.0)
    fit.SetClassOfTolerance(
        True, Letter.XCAFDimTolObjects_DimensionFormVariance_H,
        getattr(Grade, f"XCAFDimTolObjects_DimensionGrade_IT{grade}"),
    )
    dimensions, _, _, text = round_trip("box.stp", [fit])
    assert dimensions[0].IsDimWithClassOfTolerance()
    written[grade] = re.search(r"LIMITS_AND_FITS\('(\w+)','hole','(\w*)'", text).groups()
print("SEEN", written)
assert written == {n: ("H", str(n + 2)) for n in written}, written
END
grep SEEN "$folder/out"
