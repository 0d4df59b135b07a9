#!/bin/sh
# cylfit 0.1.0: fit_cylinder of 60 exact points on a bore of 20 mm diameter and 20 mm height finds a radius of 8.45 mm across the bore, and
# says so in "converged" alone; of 60 mm height it finds 10 mm. A search that begins along the greatest extension of the points.
# Expected: 10 mm, or an error.
. "$(dirname "$0")/setup.sh"
packages cylfit==0.1.0 scipy==1.17.1 numpy==2.4.6
python <<'END'
import cylfit
import numpy as np

found = {}
for height in (20.0, 60.0):
    rng = np.random.default_rng(1)
    angle, along = rng.uniform(0, 2 * np.pi, 60), rng.uniform(0, height, 60)
    points = np.c_[10 * np.cos(angle), 10 * np.sin(angle), along]
    model = cylfit.fit_cylinder(points)
    found[height] = (round(float(model.radius), 3), bool(model.converged))
print(found)
assert abs(found[20.0][0] - 10.0) > 1.0 and not found[20.0][1], found
assert found[60.0][0] == 10.0, found
END
