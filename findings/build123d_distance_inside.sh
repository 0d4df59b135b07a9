#!/bin/sh
# build123d 0.13.0: distance_to of a point is the distance from the skin for a Part (Box, Sphere, what Boolean operations return), but 0 for all points inside
# the Solid of the same part: touches that say "too small" have no deviation, those that say "too large" have theirs. Neither has a sign.
# Expected: one distance for one part.
. "$(dirname "$0")/setup.sh"
packages build123d==0.13.0 cadquery-ocp-novtk==8.0.1.1.0
python <<'END'
from build123d import Box, Cylinder, Vertex

part = Box(20, 20, 20) - Cylinder(5, 20)
touches = {"too large": (10.01, 6, 6), "too small": (9.99, 6, 6), "bore too large": (5.01, 0, 0), "bore too small": (4.99, 0, 0)}
seen = {}
for name, place in touches.items():
    touch = Vertex(*place)
    shapes = (part, part.solid(), part.shell())
    seen[name] = [round(1000 * shape.distance_to(touch), 6) for shape in shapes]
    assert abs(min(face.distance_to(touch) for face in part.faces()) - 0.01) < 1e-9
print("µm from part, solid, shell:", seen)
assert seen["too large"] == seen["bore too small"] == [10, 10, 10], seen
assert seen["too small"] == seen["bore too large"] == [10, 0, 10], seen
END
