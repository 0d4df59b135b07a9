#!/bin/sh
# trimesh 5.2.0: registration.procrustes may mirror, and where the points lie in one plane it does so about half the time: of 200 placements
# of four datum points with 2 µm of noise 93 come back mirrored, with the same remaining distances; a point 30 mm above them is 60 mm off.
# Expected: a placement that a part can have; with reflection=False it is right.
. "$(dirname "$0")/setup.sh"
packages trimesh==5.2.0 scipy==1.17.1 numpy==2.4.6
python <<'END'
import numpy as np
from scipy.spatial.transform import Rotation
from trimesh.registration import procrustes

rng = np.random.default_rng(1)
datum = np.array([[0.0, 0.0, 0.0], [100.0, 0.0, 0.0], [100.0, 60.0, 0.0], [0.0, 60.0, 0.0]])
above = np.array([50.0, 30.0, 30.0, 1.0])
mirrored, wrong, worst, cost = 0, [], 0.0, []
for k in range(200):
    rotation = Rotation.random(random_state=k)
    touched = rotation.apply(datum) + [10.0, 20.0, 30.0] + rng.normal(0.0, 0.002, datum.shape)
    right = rotation.apply(above[:3]) + [10.0, 20.0, 30.0]
    matrix, _, squares = procrustes(datum, touched, scale=False)
    rigid, _, rigid_squares = procrustes(datum, touched, scale=False, reflection=False)
    worst = max(worst, np.linalg.norm((rigid @ above)[:3] - right))
    cost.append(abs(squares - rigid_squares))
    assert np.linalg.det(rigid[:3, :3]) > 0.0
    if np.linalg.det(matrix[:3, :3]) < 0.0:
        mirrored += 1
        wrong.append(np.linalg.norm((matrix @ above)[:3] - right))
print("mirrored:", mirrored, "of 200; the point above is off by, in mm:", min(wrong), "to", max(wrong))
print("without reflection, in mm:", worst, "difference of the costs, in mm²:", max(cost))
assert 60 < mirrored < 140, "it mirrors less now"
assert min(wrong) > 59.9 and worst < 0.02
END
