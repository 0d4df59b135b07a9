#!/bin/sh
# euler 1.0.3, angles of a rotation matrix: a middle angle below 29″ (z, x, z) or within 29″ of 90° (x, y, z) is taken as 0 or 90°: the tolerance 1e-8 is on
# the cosine or sine. A part tilted by 25″ that comes back level is 12 µm off at 100 mm. The parameter tol of angles() is not used.
# Expected: the tilt, as beyond 29″ and as in scipy.
. "$(dirname "$0")/setup.sh"
packages euler==1.0.3 numpy==2.4.6 scipy==1.17.1
python <<'END'
import euler
import numpy as np
from scipy.spatial.transform import Rotation

reach, second = 100.0, np.pi / 648000

def lost(order, middle, **settings):
    """How far a point at 100 mm is off after the angles of the matrix, in mm; and those of scipy."""
    make = getattr(euler, "matrix_" + order)
    matrix = make(0.5, middle, 0.3)
    again = make(*euler.angles(order, matrix, **settings))
    same = Rotation.from_matrix(matrix).as_euler(order.upper())
    return [reach * np.linalg.norm(other - matrix, 2) for other in (again, make(*same))]

for order, zero in (("zxz", 0.0), ("zyz", 0.0), ("xyz", np.pi / 2), ("zyx", np.pi / 2)):
    near = lost(order, abs(zero - 25 * second))
    beyond = lost(order, abs(zero - 30 * second))
    stated = lost(order, abs(zero - 25 * second), tol=1e-14)
    print(f"{order} 25″: {near[0]:.6f} mm, scipy {near[1]:.0e}; 30″: {beyond[0]:.0e} mm")
    assert abs(near[0] - reach * 25 * second) < 1e-4 and near[0] == stated[0]
    assert beyond[0] < 1e-4 and max(near[1], beyond[1]) < 1e-6
END
