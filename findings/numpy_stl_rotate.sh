#!/bin/sh
# numpy-stl 4.1.1: rotate(axis, angle) and rotate_using_matrix() turn a mesh clockwise, looking against the axis: (10, 0, 0) goes by 90° about z to (0,
# −10, 0). transform() of the same library turns it counter-clockwise with the same matrix, also with the one that rotation_matrix(axis, angle) returns.
# Expected: (0, 10, 0), as the right hand has it.
. "$(dirname "$0")/setup.sh"
packages numpy-stl==4.1.1 numpy==2.4.6
python <<'END'
import numpy as np
from stl.mesh import Mesh

corners = np.array([[10.0, 0, 0], [0, 5, 0], [0, 0, 2]])
angle = np.radians(30)
cosine, sine = np.cos(angle), np.sin(angle)
right = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])

def turned(act):
    data = np.zeros(1, dtype=Mesh.dtype)
    data["vectors"][0] = corners
    mesh = Mesh(data)
    act(mesh)
    return mesh.vectors[0]

def placed(rotation):
    pose = np.eye(4)
    pose[:3, :3] = rotation
    return turned(lambda mesh: mesh.transform(pose))

rotated = turned(lambda mesh: mesh.rotate([0, 0, 1], angle))
print("30° about z:", (corners @ right.T)[0], "rotate:", rotated[0], "transform:", placed(right)[0])
# The corners are kept in single precision.
assert np.allclose(placed(right), corners @ right.T, atol=1e-5)
assert np.allclose(rotated, corners @ right, atol=1e-5)
assert np.allclose(turned(lambda mesh: mesh.rotate_using_matrix(right)), rotated, atol=1e-5)
assert np.allclose(placed(Mesh.rotation_matrix([0, 0, 1], angle)), corners @ right.T, atol=1e-5)
END
