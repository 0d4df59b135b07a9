#!/bin/sh
# Open3D 0.20.0: write_point_cloud with write_ascii=True writes a PLY file with six digits, though its header says "double": a point at
# 1234.56789 mm comes back 2.1 µm off. PCD, XYZ and PTS files of the same points have all digits; so has binary PLY.
# Expected: the digits of a double, or of a float at the least (0.06 µm here).
. "$(dirname "$0")/setup.sh"
packages open3d==0.20.0 numpy==2.4.6
python <<'END'
import numpy as np
import open3d

points = np.array([[1234.56789, -512.34567, 98.765432], [1.23456789, 2.0, 3.0]])
cloud = open3d.geometry.PointCloud(open3d.utility.Vector3dVector(points))

def error(name, ascii):
    open3d.io.write_point_cloud(name, cloud, write_ascii=ascii)
    return 1000 * np.abs(np.asarray(open3d.io.read_point_cloud(name).points) - points).max()

seen = {name: error(name, True) for name in ("a.ply", "a.pcd", "a.xyz", "a.pts")}
seen["binary ply"] = error("b.ply", False)
print("largest error in µm:", {name: round(float(value), 4) for name, value in seen.items()})
with open("a.ply") as file:
    text = file.read()
assert "property double x" in text and "1234.57 -512.346 98.7654" in text
assert abs(seen.pop("a.ply") - 2.11) < 0.01
assert max(seen.values()) < 1e-6
END
