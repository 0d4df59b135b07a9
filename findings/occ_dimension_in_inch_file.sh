#!/bin/sh
# Open CASCADE 8.0.1 writes a dimension into an inch file with the number that it has in mm: a box of 30 mm comes back
# with 30 mm, its dimension of 30 mm with 762 mm and its deviations 25.4 times as large.
# Expected: 30/25.4 in the file, as of the solid, and 30 mm at the end.
. "$(dirname "$0")/setup.sh"
packages cadquery-ocp-novtk==8.0.1.1.0
python >"$folder/out" 2>&1 <<'END' || { tail -3 "$folder/out"; exit 1; }
from occ_pmi import dimension, length_of_x, round_trip

for unit, expected in (("MM", (30.0, 0.1)), ("INCH", (762.0, 2.54))):
    dimensions, _, solid, text = round_trip(
        "box.stp", [dimension("LinearDistance", 30.0, upper=0.1, lower=0.0)], unit=unit
    )
    found = (round(dimensions[0].GetValue(), 6), round(dimensions[0].GetUpperTolValue(), 6))
    print("SEEN", unit, "solid", round(length_of_x(solid), 6), "dimension, upper deviation", found)
    assert round(length_of_x(solid), 6) == 30.0
    assert found == expected, found
END
grep SEEN "$folder/out"
