#!/bin/sh
# compas 2.15.1: axis and angle of a rotation (Frame.axis_angle_vector, Rotation.axis_and_angle; poses of UR robots) are 0 below 0.29° about x, y or z
# and below 0.50° about (1, 1, 1), and 180° as near to that: differences of the matrix below 0.01 are zero. 0.49° are 0.86 mm at 100 mm. Quaternions and
# Euler angles of the same frame are right.
# Expected: the angle, as scipy has it.
. "$(dirname "$0")/setup.sh"
packages compas==2.15.1 numpy==2.4.6 scipy==1.17.1
python <<'END'
import numpy as np
from compas.geometry import Frame
from scipy.spatial.transform import Rotation

reach = 100.0

def off(axis, degrees):
    """Distance between a point at 100 mm turned as stated and as the vector, the quaternion and the angles of the frame say, in mm."""
    across = np.cross(axis, [1.0, 0.0, 0.0])
    point = reach * across / np.linalg.norm(across)
    true = Rotation.from_rotvec(np.radians(degrees) * axis)
    matrix = true.as_matrix()
    frame = Frame([0, 0, 0], matrix[:, 0], matrix[:, 1])
    w, x, y, z = frame.quaternion
    told = (
        Rotation.from_rotvec(list(frame.axis_angle_vector)),
        Rotation.from_quat([x, y, z, w]),
        Rotation.from_euler("xyz", frame.euler_angles()),
        Rotation.from_rotvec(true.as_rotvec()),
    )
    return [np.linalg.norm(other.apply(point) - true.apply(point)) for other in told]

for axis, limit in ((np.array([0.0, 0.0, 1.0]), 0.2865), (np.ones(3) / np.sqrt(3), 0.4962)):
    for degrees in (limit - 0.001, limit + 0.001, 180.0 - limit - 0.001, 180.0 - limit + 0.001):
        vector, *others = off(axis, degrees)
        lost = 2 * reach * np.sin(np.radians(min(degrees, 180.0 - degrees)) / 2)
        print(f"{degrees:.4f}° about {axis.round(2)}: {vector:.4f} mm; quaternion, angles, scipy: {max(others):.0e} mm")
        near = min(degrees, 180.0 - degrees) < limit
        # Near 180° the axis comes from rounded terms too: 6 µm.
        assert abs(vector - (lost if near else 0.0)) < 0.01 and max(others) < 1e-9
END
