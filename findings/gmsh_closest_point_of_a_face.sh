#!/bin/sh
# gmsh 4.15.2, getClosestPoint of a face: the point on its plane or cylinder without edges, which need not lie on the face: 0 mm for a touch that is 5 mm beyond
# an edge, or in the middle of a hole. Of an edge the closest point is at its end. isInside says which.
# Expected: a point of the face.
. "$(dirname "$0")/setup.sh"
packages gmsh==4.15.2 numpy==2.4.6
python <<'END'
import gmsh
import numpy as np

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
occ = gmsh.model.occ
occ.cut([(3, occ.addBox(0, 0, 0, 30, 20, 10))], [(3, occ.addCylinder(15, 10, 0, 0, 0, 10, 4))])
occ.synchronize()

def only(dimension, box):
    (entity,) = gmsh.model.getEntitiesInBoundingBox(*np.subtract(box[:3], 1e-3), *np.add(box[3:], 1e-3), dimension)
    return entity[1]

top = only(2, (0, 0, 10, 30, 20, 10))
edge = only(1, (30, 0, 10, 30, 20, 10))
bore = next(tag for _, tag in gmsh.model.getEntities(2) if gmsh.model.getType(2, tag) == "Cylinder")

def distance(dimension, tag, touch):
    nearest, at = gmsh.model.getClosestPoint(dimension, tag, touch)
    return round(float(np.linalg.norm(nearest - touch)), 6), gmsh.model.isInside(dimension, tag, at, parametric=True)

seen = {
    "5 mm beyond the edge": distance(2, top, [35, 10, 10]),
    "in the hole, 4 mm": distance(2, top, [15, 10, 10]),
    "5 mm above the bore": distance(2, bore, [19, 10, 15]),
    "5 mm beyond the end of an edge": distance(1, edge, [30, 25, 10]),
}
print("mm, points on the face:", seen)
assert [value for value, _ in seen.values()] == [0, 0, 0, 5], seen
assert [inside for _, inside in seen.values()][:3] == [0, 0, 0], seen
END
