#!/bin/sh
# build123d 0.13.0: export_step(part, unit=Unit.IN) makes 30 mm to 30 inches: read again, the box has 762 mm.
# Expected: another unit in the file, and the same part.
. "$(dirname "$0")/setup.sh"
packages build123d==0.13.0 cadquery-ocp-novtk==8.0.1.1.0
python >"$folder/out" 2>&1 <<'END' || { tail -3 "$folder/out"; exit 1; }
import build123d

found = {}
for unit in (build123d.Unit.MM, build123d.Unit.IN):
    build123d.export_step(build123d.Box(30, 20, 10), "box.step", unit=unit)
    found[unit.name] = round(build123d.import_step("box.step").bounding_box().size.X, 6)
print("SEEN", found)
assert found == {"MM": 30.0, "IN": 762.0}, found
END
grep SEEN "$folder/out"
