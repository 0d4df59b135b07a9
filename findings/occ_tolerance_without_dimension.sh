#!/bin/sh
# Open CASCADE 8.0.1 writes a geometric tolerance of a part without a dimension in metres: a flatness of 0.05 mm comes back as 50 mm. One
# dimension beside it, and it comes back as 0.05.
# Expected: the unit of the file, mm.
. "$(dirname "$0")/setup.sh"
packages cadquery-ocp-novtk==8.0.1.1.0
python >"$folder/out" 2>&1 <<'END' || { tail -3 "$folder/out"; exit 1; }
from OCP import XCAFDimTolObjects as names
from occ_pmi import Tolerance, dimension, round_trip

kinds = names.XCAFDimTolObjects_GeomToleranceType
flatness = Tolerance()
flatness.SetType(kinds.XCAFDimTolObjects_GeomToleranceType_Flatness)
flatness.SetValue(0.05)
found = []
for dimensions in ([], [dimension("LinearDistance", 30.0, upper=0.1, lower=0.0)]):
    _, tolerances, *_ = round_trip("box.stp", dimensions, [flatness])
    found.append(round(tolerances[0].GetValue(), 9))
print("SEEN without and with a dimension:", found)
assert found == [50.0, 0.05], found
END
grep SEEN "$folder/out"
