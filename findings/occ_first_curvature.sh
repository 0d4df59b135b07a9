#!/bin/sh
# Open CASCADE 8.0.1: the first curvature that is asked of a point (BRepLProp_SLProps) is 0; asked again, it is right. On a cylinder of 8 mm
# radius MinCurvature gives 0.0 and then -0.125, MaxCurvature before it 0.0.
# Expected: -0.125 at once.
. "$(dirname "$0")/setup.sh"
packages cadquery-ocp-novtk==8.0.1.1.0
python <<'END'
from OCP.BRepAdaptor import BRepAdaptor_Surface
from OCP.BRepLProp import BRepLProp_SLProps
from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
from OCP.GeomAbs import GeomAbs_SurfaceType
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopoDS import TopoDS

explorer = TopExp_Explorer(
    BRepPrimAPI_MakeCylinder(8.0, 10.0).Shape(), TopAbs_ShapeEnum.TopAbs_FACE
)
found = None
while explorer.More():
    surface = BRepAdaptor_Surface(TopoDS.Face(explorer.Current()))
    if surface.GetType() == GeomAbs_SurfaceType.GeomAbs_Cylinder:
        properties = BRepLProp_SLProps(surface, 1.0, 5.0, 2, 1e-9)
        found = [properties.MinCurvature() for _ in range(2)]
    explorer.Next()
print("first and second:", found)
assert found == [0.0, -0.125], found
END
