#!/bin/sh
# cylinder_fitting 1.1.4 returns as "fit error" the sum of (d² - r²)² over the points, in mm⁴: 0.08 for points that lie within a few µm of
# a cylinder of 10 mm radius. Its axis and radius of exact points are right.
# Expected: a length, or the sum of (d - r)², which is 0.0002 mm² here.
. "$(dirname "$0")/setup.sh"
packages cylinder_fitting==1.1.4 scipy==1.17.1 numpy==2.4.6 scikit-image==0.26.0
python <<'END'
import numpy as np
import cylinder_fitting

rng = np.random.default_rng(1)
angle, height = rng.uniform(0, 2 * np.pi, 60), rng.uniform(0, 40, 60)
radius = 10.0 + rng.normal(0.0, 0.002, 60)
points = np.c_[radius * np.cos(angle), radius * np.sin(angle), height]
axis, point, found, error = cylinder_fitting.fit(points)
distance = np.linalg.norm(np.cross(points - point, axis), axis=1)
print("radius", found, "error", error, "mm²:", np.sum((distance - found) ** 2))
assert abs(found - 10.0) < 0.002
assert abs(error / np.sum((distance**2 - found**2) ** 2) - 1.0) < 1e-6
END
