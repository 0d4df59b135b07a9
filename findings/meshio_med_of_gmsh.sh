#!/bin/sh
# meshio 5.3.5 reads tetrahedra and hexahedra from a MED file of gmsh 4.15.2 inside out: a box of 6000 mm³ has -6000 mm³, of which the same
# mesh through .msh has +6000. MED (Salome, Code_Aster) counts the corners of an element the other way round; gmsh turns them, meshio does not,
# nor when it writes: gmsh reads -6000 mm³ from a MED file of meshio.
# Expected: one volume.
. "$(dirname "$0")/setup.sh"
packages gmsh==4.15.2 meshio==5.3.5 h5py==3.16.0 numpy==2.4.6
python <<'END'
import gmsh
import meshio
import numpy as np

def volume(mesh):
    corners = mesh.points[np.vstack([block.data for block in mesh.cells if block.type == "tetra"])]
    a, b, c = (corners[:, k] - corners[:, 0] for k in (1, 2, 3))
    return float(np.einsum("ij,ij->i", np.cross(a, b), c).sum() / 6)

def sizes_in_gmsh():
    _, tags, nodes = gmsh.model.mesh.getElements(3)
    at = dict(zip(*(lambda n, x, _: (n, x.reshape(-1, 3)))(*gmsh.model.mesh.getNodes())))
    corners = np.array([at[node] for node in nodes[0]]).reshape(-1, 4, 3)
    a, b, c = (corners[:, k] - corners[:, 0] for k in (1, 2, 3))
    return float(np.einsum("ij,ij->i", np.cross(a, b), c).sum() / 6)

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
box = gmsh.model.occ.addBox(0, 0, 0, 30, 20, 10)
gmsh.model.occ.synchronize()
gmsh.model.addPhysicalGroup(3, [box], name="part")
gmsh.option.setNumber("Mesh.MeshSizeMin", 10)
gmsh.model.mesh.generate(3)
for name in ("a.msh", "a.med"):
    gmsh.write(name)
msh, med = meshio.read("a.msh"), meshio.read("a.med")
tetrahedra = [("tetra", block.data) for block in msh.cells if block.type == "tetra"]
meshio.write("b.med", meshio.Mesh(msh.points, tetrahedra))
gmsh.open("a.med")
own = sizes_in_gmsh()
gmsh.open("b.med")
back = sizes_in_gmsh()
print(f"mm³: .msh {volume(msh):.1f}, .med {volume(med):.1f}; gmsh reads its own .med {own:.1f}, that of meshio {back:.1f}")
assert np.allclose([volume(msh), volume(med), own, back], [6000, -6000, 6000, -6000])
END
