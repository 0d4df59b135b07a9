#!/bin/sh
# scikit-spatial 10.0.0: the length of Cylinder.best_fit is twice the way from its lowest point to the mean of the points. Where the touches are not
# evenly spread along the axis, the bore ends where no touch is, or before the last one. The centre of gravity of its ends, from which a distance
# to another feature is taken, moves by half of that. Radius and axis are right. Of a quarter of a bore, 6 mm high, it finds a radius of 2.4 mm for 10 mm
# without an error: its only start for the axis is the line through the points.
# Expected: 30 mm for touches at heights from 0 to 30 mm: its text says that the vector has the length of the cylinder.
. "$(dirname "$0")/setup.sh"
packages scikit-spatial==10.0.0 numpy==2.4.6 scipy==1.17.1
python <<'END'
import numpy as np
from skspatial.objects import Cylinder

def bore(heights, part=1.0, radius=10.0, count=8):
    angles = 2 * np.pi * part * np.arange(count) / count
    return [(radius * np.cos(a), radius * np.sin(a), z) for z in heights for a in angles]

seen = {}
for heights in ((0, 10, 20, 30), (0, 2, 4, 30), (0, 26, 28, 30)):
    cylinder = Cylinder.best_fit(bore(heights))
    assert abs(cylinder.radius - 10) < 1e-6 and abs(abs(cylinder.vector.unit()[2]) - 1) < 1e-9
    seen[heights] = float(cylinder.length())
    assert abs(seen[heights] - 2 * np.mean(heights)) < 1e-6
quarter = float(Cylinder.best_fit(bore((0, 2, 4, 6), part=0.25)).radius)
print("touches from 0 to 30 mm:", {heights: round(length, 3) for heights, length in seen.items()})
print(f"a quarter of a bore of radius 10 mm, exact points: {quarter:.3f} mm")
assert [round(length, 6) for length in seen.values()] == [30.0, 18.0, 42.0]
assert quarter < 3
END
