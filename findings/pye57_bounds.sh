#!/bin/sh
# pye57 0.4.19, `write_scan_raw` of a scan with a pose: its `cartesianBounds` are two corners of the box, turned and shifted. Turned by 180° about z,
# a part of 100 mm is written as −100 mm wide (xMinimum 1.0, xMaximum 0.9), by 45° as −71 mm. The points themselves are right, but single floats:
# 0.24 mm off at 5 km, though the array was double, and comes back as double.
# Expected: the bounds of the points in the scan's own system (ASTM E2807), 0 to 0.1 m, wherever it stands.
. "$(dirname "$0")/setup.sh"
packages pye57==0.4.19 pyquaternion==0.9.9 numpy==2.4.6
python <<'END'
import numpy as np
import pye57
from pyquaternion import Quaternion

corners = np.array([[x, y, z] for x in (0, 0.1) for y in (0, 0.2) for z in (0, 0.3)])


def scan(points, angle=0.0, place=(0.0, 0.0, 0.0)):
    """Bounds along x, and the points as they come back."""
    turn = Quaternion(axis=(0, 0, 1), degrees=angle)
    file = pye57.E57("scan.e57", "w")
    fields = dict(zip(("cartesianX", "cartesianY", "cartesianZ"), points.T.copy()))
    file.write_scan_raw(fields, rotation=turn.elements, translation=np.array(place))
    file.close()
    file = pye57.E57("scan.e57")
    header, data = file.get_header(0), file.read_scan(0, ignore_missing_fields=True)
    return header.xMinimum, header.xMaximum, np.c_[data["cartesianX"], data["cartesianY"], data["cartesianZ"]]


for angle, width in ((0, 0.1), (45, -0.0707107), (180, -0.1)):
    low, high, back = scan(corners, angle, (1, 2, 3))
    turned = corners @ Quaternion(axis=(0, 0, 1), degrees=angle).rotation_matrix.T + [1, 2, 3]
    print(f"{angle}°: x from {low:.3f} to {high:.3f} m; the points: {back[:, 0].min():.3f} to {back[:, 0].max():.3f} m")
    assert np.allclose(back, turned, atol=1e-6)
    assert abs(high - low - width) < 1e-6

grid = np.linspace(0, 0.1, 1001)[:, None] * [1, 2, 3] + [4123, 5123, 300]
back = scan(grid)[2]
off = np.abs(back - grid).max()
print(f"at 5 km: {1000 * off:.3f} mm off, {back.dtype}")
assert back.dtype == np.float64 and 2.0e-4 < off < 2.5e-4
END
