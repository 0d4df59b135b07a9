#!/bin/sh
# pytransform3d 3.17.0: estimate_gaussian_transform_from_samples takes differences in the frame of the part and corrects the mean in the
# frame of the world: beyond 60° of rotation it runs away. The mean of ten poses that differ by some µm is 5 mm off at 90°, more than
# a metre at 180°, beside standard deviations of some µm. So does the mean of rotations, estimate_gaussian_rotation_matrix_from_samples.
# Expected: the mean, wherever the part stands; its documentation corrects in the frame in which it takes the differences.
. "$(dirname "$0")/setup.sh"
packages pytransform3d==3.17.0 scipy==1.17.1 numpy==2.4.6
python <<'END'
import numpy as np
from pytransform3d.uncertainty import estimate_gaussian_rotation_matrix_from_samples as mean_rotation
from pytransform3d.uncertainty import estimate_gaussian_transform_from_samples as mean_pose
from scipy.spatial.transform import Rotation

rng = np.random.default_rng(1)
place, turn = rng.normal(0.0, 2e-3, (10, 3)), Rotation.from_rotvec(rng.normal(0.0, 1e-5, (10, 3)))  # 2 µm, 10 µrad
off = {}
for angle in (0, 30, 90, 180):
    poses = np.tile(np.eye(4), (10, 1, 1))
    poses[:, :3, :3] = (turn * Rotation.from_euler("z", angle, degrees=True)).as_matrix()
    poses[:, :3, 3] = [100.0, 50.0, 20.0] + place
    right = Rotation.from_matrix(poses[:, :3, :3]).mean()
    mean, covariance = mean_pose(poses)
    rotation = Rotation.from_matrix(mean_rotation(poses[:, :3, :3])[0])
    first = np.linalg.inv(poses[0])  # poses relative to the first one hardly turn
    moved = poses[0] @ mean_pose(first @ poses)[0]
    off[angle] = np.linalg.norm(mean[:3, 3] - poses[:, :3, 3].mean(axis=0))
    turned = (rotation * right.inv()).magnitude()
    again = np.linalg.norm(moved[:3, 3] - poses[:, :3, 3].mean(axis=0))
    print(angle, "degrees: mean off by, in mm:", off[angle], "rad:", turned, "relative to the first pose, in mm:", again)
    print("    standard deviations it gives, in µm:", 1e3 * np.sqrt(np.diag(covariance))[3:])
    assert again < 1e-6 and np.sqrt(np.diag(covariance))[3:].max() < 0.01
    assert (turned > 1e-4) == (angle > 60)
assert off[0] < 1e-6 and off[30] < 1e-6
assert off[90] > 1.0 and off[180] > 100.0, "the mean is right now"
END
