#!/bin/sh
# build123d-drafting-helpers 0.15.5 on build123d 0.13.0: Dimension(tolerance=(lower, upper)) draws the limits in the opposite order: 25 +0.2 −0.1 is on
# paper as 25 +0.1 −0.2, while its label says +0.2 −0.1. build123d takes the upper one first. FeatureControlFrame without a Draft rounds to one digit: a
# position of 0.05 is drawn as 0.1, one of 0.04 as 0.0; with a Draft as made, 0.015 as 0.01.
# Expected: +0.2 −0.1, and tolerances as they are.
. "$(dirname "$0")/setup.sh"
packages build123d-drafting-helpers==0.15.5 build123d==0.13.0 cadquery-ocp-novtk==8.0.1.1.0
python <<'END'
from build123d import Draft
from build123d_drafting import Dimension, FeatureControlFrame, draft_preset

def dimension(**settings):
    return Dimension((0, 0, 0), (25, 0, 0), "above", 10, draft_preset(), **settings)

def ink(drawn):
    """Centre and area of each face that is drawn."""
    return sorted((round(x.center().X, 6), round(x.center().Y, 6), round(x.area, 6)) for x in drawn.faces())

both = dimension(tolerance=(0.1, 0.2))
right, reversed_ = (dimension(label=f"25.00 +{upper} -{lower}mm") for lower, upper in (("0.10", "0.20"), ("0.20", "0.10")))
print("label:", both.label, "drawn as stated:", ink(both) == ink(right), "reversed:", ink(both) == ink(reversed_))
assert both.label == "25.00 +0.20 -0.10"
assert ink(both) == ink(reversed_) != ink(right)

frames = {tolerance: FeatureControlFrame("position", tolerance, ["A"]).label for tolerance in (0.04, 0.05, 0.15)}
made = FeatureControlFrame("position", 0.015, ["A"], Draft()).label
print("positions:", frames, "0.015:", made)
assert frames == {0.04: "0.0", 0.05: "0.1", 0.15: "0.1"} and made == "0.01"
END
