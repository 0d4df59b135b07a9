#!/bin/sh
# geomdl 5.4.0 divides the knots of a curve by their range (0..25 becomes 0..1) where it is not told otherwise: derivatives
# with respect to the parameter are 25 times those of the CAD file, second ones 625 times, and the parameter of a point is another.
# Expected: the knots that were set.
. "$(dirname "$0")/setup.sh"
packages geomdl==5.4.0 numpy==2.4.6
python <<'END'
from geomdl import BSpline

slopes = {}
for normal in (None, False):
    curve = BSpline.Curve() if normal is None else BSpline.Curve(normalize_kv=False)
    curve.degree = 2
    curve.ctrlpts = [[0, 0, 0], [10, 0, 0], [20, 5, 0], [30, 5, 0]]
    curve.knotvector = [0, 0, 0, 12.5, 25, 25, 25]
    slopes[normal] = curve.derivatives(0.5 if normal is None else 12.5, 1)[1]
print(slopes)
assert [round(v, 9) for v in slopes[None]] == [20.0, 10.0, 0.0], slopes
assert [round(v, 9) for v in slopes[False]] == [0.8, 0.4, 0.0], slopes
END
