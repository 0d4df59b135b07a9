#!/bin/sh
# gmsh 4.15.2: getPrincipalCurvatures gives -1/8 for a hole and for a shaft of 8 mm radius, getCurvature +1/8 for both; the normals of the two
# point to opposite sides, as they should. The sign says nothing of the side where the material is.
# Expected: opposite signs.
. "$(dirname "$0")/setup.sh"
packages gmsh==4.15.2
python <<'END'
import gmsh

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
found = {}
for name in ("hole", "shaft"):
    gmsh.clear()
    shaft = gmsh.model.occ.addCylinder(0, 0, -1, 0, 0, 12, 8)
    if name == "hole":
        block = gmsh.model.occ.addBox(-20, -20, 0, 40, 40, 10)
        gmsh.model.occ.cut([(3, block)], [(3, shaft)])
    gmsh.model.occ.synchronize()
    wall = next(s for d, s in gmsh.model.getEntities(2) if gmsh.model.getType(d, s) == "Cylinder")
    place = [1.0, 5.0]
    smallest = float(gmsh.model.getPrincipalCurvatures(wall, place)[1][0])
    found[name] = (smallest, float(gmsh.model.getCurvature(2, wall, place)[0]),
                   round(float(gmsh.model.getNormal(wall, place)[0]), 3))
print(found)
assert found == {"hole": (-0.125, 0.125, -0.54), "shaft": (-0.125, 0.125, 0.54)}, found
END
