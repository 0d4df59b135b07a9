#!/bin/sh
# cascadio 0.1.1 (what trimesh reads STEP with) makes glTF, whose unit is the metre: a box of 30 mm has the coordinate 0.03,
# from a file in mm and from one in inches alike. trimesh 5.2.0 reads 0.03 and
# says so in `units` alone.
# Expected: 30, as every other reader of the same file gives.
. "$(dirname "$0")/setup.sh"
packages cascadio==0.1.1 trimesh==5.2.0 numpy==2.4.6 cadquery-ocp-novtk==8.0.1.1.0
python >"$folder/out" 2>&1 <<'END' || { tail -3 "$folder/out"; exit 1; }
import cascadio
import trimesh
from occ_pmi import round_trip

for unit in ("MM", "INCH"):
    round_trip("box.stp", unit=unit)
    cascadio.step_to_glb("box.stp", "box.glb", 0.1)
    scene = trimesh.load("box.glb")
    print("SEEN", unit, [round(float(v), 6) for v in scene.extents], scene.units)
    assert scene.units == "meters"
    assert sorted(round(float(v), 6) for v in scene.extents) == [0.01, 0.02, 0.03]
END
grep SEEN "$folder/out"
