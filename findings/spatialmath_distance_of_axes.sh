#!/bin/sh
# spatialmath-python 1.1.18: Line3.distance of skew lines depends on how far apart the two points are that make a line (Line3.Join), and divides by the
# sine of the angle: two axes 5 mm apart, each through points 10 mm apart, are 0.005 mm apart; of unit vectors at 30° 10 mm. closest_to_line gives
# 5 mm. Plane3.contains reads the offset with the wrong sign: a plane contains its own points only if it goes through the origin.
# Expected: 5 mm, however the lines are made; True.
. "$(dirname "$0")/setup.sh"
packages spatialmath-python==1.1.18 numpy==2.4.6
python <<'END'
import numpy as np
from spatialmath import Line3, Plane3

def axes(length, degrees):
    across = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees)), 0])
    return Line3.Join([0, 0, 0], [length, 0, 0]), Line3.Join([0, 0, 5], [0, 0, 5] + length * across)

seen = {}
for length, degrees in ((1, 90), (1, 30), (10, 90), (10, 30), (100, 90)):
    a, b = axes(length, degrees)
    seen[length, degrees] = float(a.distance(b))
    assert abs(a.closest_to_line(b)[1] - 5) < 1e-9
    assert abs(seen[length, degrees] - 5 / (length**3 * np.sin(np.radians(degrees)))) < 1e-9
plane = Plane3.PointNormal([0, 0, 7], [0, 0, 1])
contains = [plane.contains([0, 0, 7]), plane.contains([0, 0, -7]), Plane3.PointNormal([0, 0, 0], [0, 0, 1]).contains([3, 4, 0])]
print("distance by length and angle:", seen, "plane z = 7 contains z = 7, z = -7; z = 0 contains z = 0:", contains)
assert contains == [False, True, True]
END
