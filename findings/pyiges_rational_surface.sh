#!/bin/sh
# pyiges 0.3.4 gives geomdl a polynomial surface of a rational one (to_geomdl, to_vtk): the weights go to BSpline.Surface, which does not use them.
# A bore of 20 mm diameter that Open CASCADE wrote as an exact NURBS face lies 10 mm from its axis at the knots and 12.5 mm between them. Its
# edges, which become NURBS.Curve, lie at 10 mm.
# Expected: 10 mm everywhere.
. "$(dirname "$0")/setup.sh"
packages pyiges==0.3.4 geomdl==5.4.0 pyvista==0.49.1 vtk==9.6.2 cadquery-ocp==8.0.1.1.0 numpy==2.4.6
python <<'END'
import contextlib
import io

import numpy as np
import pyiges
from geomdl import NURBS
from OCP.BRepBuilderAPI import BRepBuilderAPI_NurbsConvert
from OCP.BRepPrimAPI import BRepPrimAPI_MakeCylinder
from OCP.IGESControl import IGESControl_Writer

shape = BRepBuilderAPI_NurbsConvert(BRepPrimAPI_MakeCylinder(10, 20).Shape(), True).Shape()
writer = IGESControl_Writer("MM", 0)
writer.AddShape(shape)
writer.ComputeModel()
with contextlib.redirect_stdout(io.StringIO()):
    assert writer.Write("bore.igs")
    iges = pyiges.read("bore.igs")

def radii(made):
    made.delta = 0.02
    points = np.array(made.evalpts)
    return np.hypot(points[:, 0], points[:, 1])

(face,) = (entity for entity in iges.bspline_surfaces() if len(set(entity.weights)) > 1)
edges = [entity for entity in iges.bsplines() if len(set(entity.W)) > 1]
seen = radii(face.to_geomdl())
exact = NURBS.Surface()
exact.degree_u, exact.degree_v = face.m2, face.m1
homogeneous = np.c_[face._cp * face.weights[:, None], face.weights]
exact.set_ctrlpts(homogeneous.tolist(), 2, len(homogeneous) // 2)
exact.knotvector_u, exact.knotvector_v = list(face.knot2), list(face.knot1)
print(f"face: {seen.min():.4f} to {seen.max():.4f} mm;", end=" ")
print(f"with its weights {radii(exact).min():.4f} to {radii(exact).max():.4f} mm;", end=" ")
print(f"edges {min(radii(edge.to_geomdl()).min() for edge in edges):.4f} mm")
assert abs(seen.min() - 10) < 1e-6 and abs(seen.max() - 12.5) < 0.01
assert np.allclose(radii(exact), 10, rtol=0, atol=1e-6)
assert edges and all(np.allclose(radii(edge.to_geomdl()), 10, rtol=0, atol=1e-6) for edge in edges)
END
