#!/bin/sh
# gscrib 1.2.0 (writes G-code along probed heights): SparseHeightMap gives 0 outside of the probed points: half a micrometre beside a surface
# at -1.2 mm it is 1.2 mm higher. With a grid that stands at 17° to the machine this happens at one of its own points, as the file has them.
# Expected: an error, or the height at the border.
. "$(dirname "$0")/setup.sh"
packages gscrib==1.2.0 scipy==1.17.1 numpy==2.4.6
python <<'END'
import numpy as np
from gscrib.heightmaps import SparseHeightMap

x, y = (c.ravel() for c in np.meshgrid(np.arange(0.0, 101.0, 10.0), np.arange(0.0, 61.0, 10.0), indexing="ij"))
height = -1.2 + 0.02 * np.sin(x / 8.0)
straight = SparseHeightMap(np.c_[x, y, height])
border = [float(straight.get_depth_at(at, 30.0)) for at in (100.0, 100.0005)]
print("at x = 100 and 100.0005 mm:", border)
assert abs(border[0] - height[-1]) < 1e-9 and border[1] == 0.0, "it does not jump now"

c, s = np.cos(np.radians(17.0)), np.sin(np.radians(17.0))
np.savetxt("heights.csv", np.c_[c * x - s * y, s * x + c * y, height], fmt="%.3f", delimiter=",")
turned = SparseHeightMap.from_path("heights.csv")
points = np.loadtxt("heights.csv", delimiter=",")
own = np.array([float(turned.get_depth_at(float(a), float(b))) for a, b, _ in points])
print("own points of", len(points), "that give 0:", points[own == 0.0].tolist())
assert 0 < np.sum(own == 0.0) < 10
assert np.abs(own - points[:, 2])[own != 0.0].max() < 1e-9
END
