#!/bin/sh
# robodk 6.0.2 (module robomath, which runs without a robot): Staubli_2_Pose turns the degrees in the list that it is given into radians, so that
# a second call with the same list is another pose; quaternion_2_pose changes its list too. Nachi_2_Pose reads the angles in the opposite order of
# Pose_2_Nachi: there and back, 20°, 30°, 40° are 40°, 30°, 20°.
# Expected: the list unchanged; the same pose there and back, as of KUKA, Fanuc, Motoman.
. "$(dirname "$0")/setup.sh"
packages robodk==6.0.2
python <<'END'
from robodk import robomath

def largest(a, b):
    return max(abs(a[i, j] - b[i, j]) for i in range(3) for j in range(3))

tool = [0.0, 0.0, 100.0, 20.0, 30.0, 40.0]
first, second = robomath.Staubli_2_Pose(tool), robomath.Staubli_2_Pose(tool)
print("Stäubli, the same list twice:", round(largest(first, second), 3), "list now:", [round(value, 4) for value in tool])
assert largest(first, second) > 0.5 and tool[3] < 0.01
for name in ("KUKA", "Fanuc", "Motoman", "Nachi"):
    there = getattr(robomath, f"{name}_2_Pose")([0.0, 0.0, 100.0, 20.0, 30.0, 40.0])
    angles = getattr(robomath, f"Pose_2_{name}")(there)[3:]
    print(name, [round(angle, 6) for angle in angles])
    expected = [40, 30, 20] if name == "Nachi" else [20, 30, 40]
    assert max(abs(a - b) for a, b in zip(angles, expected)) < 1e-9
END
