#!/bin/sh
# dual-quaternions 0.4.0: a / b of two poses turns as a * b.inverse() but shifts otherwise, for a turn of b is divided away on the wrong side.
# A part at 30° about Z, a table at 20°: the part on the table is 25.4 mm off; with the table 20° about X 0.9 mm off, and no unit dual
# quaternion any more. A table that is shifted and not turned is right.
# Expected: a * b.inverse().
. "$(dirname "$0")/setup.sh"
packages dual-quaternions==0.4.0 numpy==2.4.6 pyquaternion==0.9.9
python <<'END'
import numpy as np
from dual_quaternions import DualQuaternion

def pose(axis, degrees, shift):
    angle = np.radians(degrees)
    skew = np.cross(np.eye(3), axis)
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew
    matrix[:3, 3] = shift
    return matrix

def off(a, b):
    quotient = DualQuaternion.from_homogeneous_matrix(a) / DualQuaternion.from_homogeneous_matrix(b)
    by_inverse = DualQuaternion.from_homogeneous_matrix(a) * DualQuaternion.from_homogeneous_matrix(b).inverse()
    right = a @ np.linalg.inv(b)
    assert np.allclose(by_inverse.homogeneous_matrix(), right) and by_inverse.is_normalized
    seen = quotient.homogeneous_matrix()
    assert np.allclose(seen[:3, :3], right[:3, :3])
    return float(np.linalg.norm(seen[:3, 3] - right[:3, 3])), bool(quotient.is_normalized)

part = pose([0, 0, 1], 30, [100, 20, 5])
cases = {
    "table at 20° about X": off(part, pose([1, 0, 0], 20, [30, -10, 2])),
    "table at 20° about Z": off(part, pose([0, 0, 1], 20, [30, -10, 2])),
    "table shifted": off(part, pose([0, 0, 1], 0, [30, -10, 2])),
}
print({name: f"{distance:.3f} mm off, unit: {unit}" for name, (distance, unit) in cases.items()})
expected = [(0.9130, False), (25.3541, True), (0.0, True)]
assert all(abs(a[0] - b[0]) < 1e-3 and a[1] == b[1] for a, b in zip(cases.values(), expected)), cases
END
