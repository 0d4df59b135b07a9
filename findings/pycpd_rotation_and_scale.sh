#!/bin/sh
# pycpd 2.0.0: the R of RigidRegistration multiplies points as rows from the right, y @ R + t: it is the inverse of the rotation of its paper
# (s R y + t), which scipy's align_vectors gives: in a 4 × 4 matrix the part turns to the other side. "Rigid" always fits a size: a part that
# is 0.1 mm too long over 100 mm is registered within nanometres, with s = 1.001, and nothing switches it off.
# Expected: R as in the paper that it names; deviations of ± 50 µm at the ends.
. "$(dirname "$0")/setup.sh"
packages pycpd==2.0.0 scipy==1.17.1 numpy==2.4.6
python 2>/dev/null <<'END'
import inspect

import numpy as np
from pycpd import RigidRegistration
from scipy.spatial.transform import Rotation

rng = np.random.default_rng(1)
nominal = np.c_[np.linspace(-50.0, 50.0, 40), rng.uniform(-10.0, 10.0, (40, 2))]
rotation = Rotation.from_euler("z", 5.0, degrees=True).as_matrix()
part = 1.001 * nominal @ rotation.T + [0.1, 0.2, 0.3]
fitted, (scale, found, move) = RigidRegistration(X=part, Y=nominal, max_iterations=1000, tolerance=1e-12).register()
kabsch = Rotation.align_vectors(part - part.mean(axis=0), nominal - nominal.mean(axis=0))[0].as_matrix()
as_matrix = scale * nominal @ found.T + move  # as one puts R into a 4 × 4 matrix
print("scale", scale, "largest distance in µm", 1e3 * np.linalg.norm(fitted - part, axis=1).max())
print("R against align_vectors:", np.abs(found - kabsch).max(), "transposed:", np.abs(found.T - kabsch).max())
print("largest distance with R in a 4 × 4 matrix:", np.linalg.norm(as_matrix - part, axis=1).max(), "mm")
rigid = (nominal - nominal.mean(axis=0)) @ kabsch.T + part.mean(axis=0)
print("without scale, µm:", 1e3 * np.linalg.norm(rigid - part, axis=1).max())
assert np.abs(kabsch - rotation).max() < 1e-12
assert np.abs(found.T - kabsch).max() < 1e-9 and np.abs(found - kabsch).max() > 0.1, "R is that of the paper now"
assert abs(scale - 1.001) < 1e-9 and np.linalg.norm(fitted - part, axis=1).max() < 1e-6
assert np.linalg.norm(rigid - part, axis=1).max() > 0.049
assert "scale" not in inspect.signature(RigidRegistration.__init__).parameters
END
