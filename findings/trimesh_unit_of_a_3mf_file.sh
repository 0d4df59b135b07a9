#!/bin/sh
# trimesh 5.2.0 writes unit="millimeter" into every 3MF file, with the numbers of the mesh: a box of 1 × 2 × 3 inches (mesh.units "inches") is
# 1 × 2 × 3 mm for its next reader. A 3MF file in inches, read and written again, becomes 25.4 times smaller.
# Expected: unit="inch", or the numbers in mm.
. "$(dirname "$0")/setup.sh"
packages trimesh==5.2.0 networkx==3.6.1 lxml==6.1.3 numpy==2.4.6
python <<'END'
import re
import zipfile

import trimesh

def model(name):
    with zipfile.ZipFile(name) as file:
        return file.read(next(part for part in file.namelist() if part.endswith(".model"))).decode()

def unit(name):
    return re.search(r'unit="(\w+)"', model(name)).group(1)

box = trimesh.creation.box((1, 2, 3))
box.units = "inches"
box.export("a.3mf")
with zipfile.ZipFile("a.3mf") as file, zipfile.ZipFile("b.3mf", "w") as inches:
    for part in file.namelist():
        inches.writestr(part, file.read(part).replace(b'unit="millimeter"', b'unit="inch"'))
scene = trimesh.load("b.3mf")
scene.export("c.3mf")
print("written from inches:", unit("a.3mf"), "read:", scene.units, scene.extents, "written again:", unit("c.3mf"))
again = trimesh.load("c.3mf")
assert unit("a.3mf") == "millimeter" and 'x="-0.5"' in model("a.3mf")
assert scene.units == "inch" and again.units == "millimeter" and abs(again.extents - scene.extents).max() < 1e-9
END
