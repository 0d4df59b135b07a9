#!/bin/sh
# simpleicp 2.0.15, alignment of two planes of 144 points that are 0.3 µm apart, with a scatter of 2 µm; a height is known, 0 ± 0.167 µm, as well as the
# points know it. With weights 1/u, which multiply the differences as its text says, the height is right, -0.15 µm; its uncertainty takes 1/u
# for 1/u²: 0.161 for 0.118 µm, and 0.109 for 0.010 µm where the known height is ± 0.01 µm. distance_weights=None, "automatic", multiplies by 1/u²: with
# numbers in mm the height is -0.300 µm, as if none were known, in µm it is -0.060 µm. Of the distances all but the last are returned.
# Expected: the weighted mean and its u, in either unit.
. "$(dirname "$0")/setup.sh"
packages simpleicp==2.0.15 pandas==2.3.3 lmfit==1.3.4 numpy==2.4.6 scipy==1.17.1
python <<'END'
import contextlib
import io

import numpy as np
from simpleicp import PointCloud, SimpleICP

X, Y = (part.ravel() for part in np.meshgrid(np.arange(12.0), np.arange(12.0)))
SIGNS = np.where((X + Y) % 2, 1.0, -1.0)
APART, SCATTER = 0.3, 2.0

def aligned(unit, weight, u_known):
    """The height that aligns the planes and its u in µm; other movements are fixed. `unit` is that of the numbers, in µm."""
    heights = (0 * X, (APART + SCATTER * SIGNS) / unit)
    clouds = [PointCloud(np.column_stack((1000 * X / unit, 1000 * Y / unit, z)), columns=["x", "y", "z"]) for z in heights]
    alignment = SimpleICP()
    alignment.add_point_clouds(*clouds)
    weights = (np.inf,) * 5 + (unit / u_known,)
    with contextlib.redirect_stdout(io.StringIO()):
        _, _, movement, distances = alignment.run(
            correspondences=len(X), min_planarity=0, distance_weights=weight, rbp_observation_weights=weights
        )
    assert len(distances) == len(X) - 1
    return movement.tz.estimated_value * unit, movement.tz.estimated_uncertainty * unit

points = SCATTER / np.sqrt(len(X))
seen = {points: (0.1606, {"mm": -0.3, "µm": -0.06}), 0.01: (0.1090, {"mm": -0.29967, "µm": -0.00027})}
for u_known, (u_seen, automatic_seen) in seen.items():
    share = u_known**2 / (u_known**2 + points**2)
    right, u_right = -APART * share, u_known * np.sqrt(1 - share)
    print(f"known height ± {u_known:.3f} µm: right is {right:.5f} ± {u_right:.4f} µm")
    for name, unit in (("mm", 1000.0), ("µm", 1.0)):
        value, u = aligned(unit, unit / SCATTER, u_known)
        automatic, _ = aligned(unit, None, u_known)
        print(f"  in {name}: 1/u gives {value:.5f} ± {u:.4f} µm, automatic {automatic:.5f} µm")
        assert abs(value - right) < 1e-6 and abs(u - u_seen) < 1e-3 and u > 1.3 * u_right
        assert abs(automatic - automatic_seen[name]) < 1e-5
END
