#!/bin/sh
# netgen 6.2.2608 and gmsh 4.15.2 (both Open CASCADE): the box around a torus with radii 20 and 5 mm is 54.12 mm wide, not 50; so is the box
# of a part with a rounded groove. Both print it as the extent of the part.
# Expected: 50.
. "$(dirname "$0")/setup.sh"
packages netgen-mesher==6.2.2608 gmsh==4.15.2
python <<'END'
from netgen.occ import Axes, Axis, WorkPlane, X, Y, Z

tube = WorkPlane(Axes((20, 0, 0), n=Y, h=X)).Circle(5).Face()
low, high = tube.Revolve(Axis((0, 0, 0), Z), 360).bounding_box
widths = {"netgen": high[0] - low[0]}
import gmsh

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
tag = gmsh.model.occ.addTorus(0, 0, 0, 20, 5)
gmsh.model.occ.synchronize()
box = gmsh.model.getBoundingBox(3, tag)
widths["gmsh"] = box[3] - box[0]
print(widths)
assert all(abs(width - 54.1196) < 1e-3 for width in widths.values()), widths
END
