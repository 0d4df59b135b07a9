#!/bin/sh
# pybotics 3.1.2 (robot calibration), `vector_2_matrix` with FIXED_XYZ (the W, P, R of FANUC) and the eleven other FIXED conventions: the
# first angle turns about the last axis. W = 30° alone turns about z; a tip of 100 mm at 30°, 20°, 10° is 47 mm off. The EULER ones are right.
# FIXED_XYZ is the same object as EULER_ZYX, so it takes its three angles in that order.
# Expected: Rz(R) Ry(P) Rx(W), as scipy's extrinsic "xyz".
. "$(dirname "$0")/setup.sh"
packages pybotics==3.1.2 numpy==1.26.4 scipy==1.17.1
python <<'END'
import numpy as np
from pybotics.geometry import OrientationConvention, vector_2_matrix
from scipy.spatial.transform import Rotation

angles = np.radians([30, 20, 10])
tip = np.array([0, 0, -100])
off = {}
for name, convention in OrientationConvention.__members__.items():
    kind, axes = name.split("_")
    axes = axes.lower() if kind == "FIXED" else axes
    matrix = vector_2_matrix(np.r_[0, 0, 0, angles], convention)[:3, :3]
    off[name] = np.linalg.norm(matrix @ tip - Rotation.from_euler(axes, angles).apply(tip))
    backwards = Rotation.from_euler(axes, angles[::-1]).as_matrix()
    assert np.allclose(matrix, backwards if kind == "FIXED" else Rotation.from_euler(axes, angles).as_matrix()), name
print({name: round(float(value), 3) for name, value in off.items()})
assert abs(off["FIXED_XYZ"] - 47.237) < 1e-3
only_w = vector_2_matrix(np.r_[0, 0, 0, np.radians([30, 0, 0])], OrientationConvention.FIXED_XYZ)[:3, :3]
turned = np.degrees(Rotation.from_matrix(only_w).as_rotvec())
print("W = 30° turns by", turned.round(3), "about x, y, z")
assert np.allclose(turned, [0, 0, 30])
assert OrientationConvention.FIXED_XYZ is OrientationConvention.EULER_ZYX
END
