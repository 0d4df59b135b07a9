#!/bin/sh
# gaugefit 0.1.0 (measures edges in pictures): `line_circle`, "0 if they touch", is right for a circle on one side of the line; on the other it is
# minus the diameter: −20 for a circle of 10 px radius that touches the line, and −25 for a gap of 5. `circle_circle` gives the offset of the centres,
# 0.03, twice, the second time as deviation of concentricity, and −29.97 as least distance of two circles with radii 10 and 20.
# Expected: 0, 5; 0.06, the diameter of the zone (ISO 1101); 9.97, the thinnest wall.
. "$(dirname "$0")/setup.sh"
packages gaugefit==0.1.0 numpy==2.4.6
export HOME="$folder"
python <<'END'
from gaugefit.metrology import circle_circle, line_circle
from gaugefit.shapes import Circle, Line

edge = Line.from_two_points((0, 0), (100, 0))
other_way = Line.from_two_points((100, 0), (0, 0))
seen = {}
for name, height in {"touches": 10, "gap of 5": 15}.items():
    seen[name] = [line_circle(line, Circle((40, side * height), 10)) for line in (edge, other_way) for side in (1, -1)]
print("line and circle, above and below:", seen)
assert seen == {"touches": [0, -20, 0, -20], "gap of 5": [5, -25, 5, -25]}

apart, concentricity, least = circle_circle(Circle((0, 0), 10), Circle((0.03, 0), 20))
print("centres:", apart, "concentricity:", concentricity, "least distance:", least)
assert apart == concentricity == 0.03
assert abs(least + 29.97) < 1e-12
END
