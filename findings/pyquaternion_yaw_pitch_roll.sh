#!/bin/sh
# pyquaternion 0.9.9: yaw_pitch_roll names the order z-y'-x'' (and, lower down, the product of x-y'-z''), and gives the angles of x-y'-z'': a part turned by 30°
# about z, then 20° about y', then 10° about x'' comes back as 28.5°, 22.2° and -1.1°, 17 mm off at 100 mm. One angle alone is right.
# Expected: 30°, 20°, 10°.
. "$(dirname "$0")/setup.sh"
packages pyquaternion==0.9.9 numpy==2.4.6
python <<'END'
import numpy as np
from pyquaternion import Quaternion

def about(axis, degrees):
    return Quaternion(axis=np.eye(3)["xyz".index(axis)], degrees=degrees)

def z_y_x(yaw, pitch, roll):
    return about("z", yaw) * about("y", pitch) * about("x", roll)

def read(turned):
    return np.degrees(turned.yaw_pitch_roll)

turned = z_y_x(30, 20, 10)
(nx, _, _), (ny, _, _), (nz, sine, cosine) = turned.rotation_matrix
by_hand = np.degrees([np.arctan2(ny, nx), -np.arcsin(nz), np.arctan2(sine, cosine)])
seen = read(turned)
corner = np.array([60.0, 80.0, 0.0])
off = np.linalg.norm(z_y_x(*seen).rotate(corner) - turned.rotate(corner))
print("read:", seen.round(3), "from the matrix:", by_hand.round(3), f"a corner at 100 mm is {off:.1f} mm off")
print("turned about x first:", read(about("x", 10) * about("y", 20) * about("z", 30)).round(3))
assert np.allclose(by_hand, [30, 20, 10]) and np.allclose(seen, [28.452, 22.242, -1.116], atol=1e-3) and off > 17
assert np.allclose(read(about("x", 10) * about("y", 20) * about("z", 30)), [30, 20, 10])
assert all(np.allclose(read(z_y_x(*np.eye(3)[k] * 25)), np.eye(3)[k] * 25) for k in range(3))
END
