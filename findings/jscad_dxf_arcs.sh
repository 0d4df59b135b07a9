#!/bin/sh
# @jscad/dxf-deserializer 2.3.30 draws an arc of 10° with 100 mm radius as a single point, one of 30° as its chord, and a mirrored arc (extrusion
# 0, 0, -1, as CAD writes after mirroring) on the wrong side of the zero. Its circles have 16 corners and no word about it.
# Expected: points along the arc, 17.45 mm; x from -60 to -50, as the package dxf 5.3.1 reads the same file.
. "$(dirname "$0")/setup.sh"
modules @jscad/dxf-deserializer@2.3.30 dxf@5.3.1
cat >"$folder/a.js" <<'END'
const assert = require("assert");
const { deserialize } = require("@jscad/dxf-deserializer");
const { Helper } = require("dxf");

const arc = (x, radius, from, to, up) =>
  ["0 SECTION 2 ENTITIES 0 ARC 5 A 100 AcDbEntity 8 0 100 AcDbCircle 10", x, "20 0 30 0 40", radius,
   "210 0 220 0 230", up, "100 AcDbArc 50", from, "51", to, "0 ENDSEC 0 EOF"].join(" ").split(" ").join("\n") + "\n";
const jscad = (text) => deserialize({ output: "geometry" }, text)[0].points;
const other = (text) => new Helper(text).toPolylines().bbox;

const short = jscad(arc(0, 100, 0, 10, 1));
const longer = jscad(arc(0, 25, 0, 30, 1));
const mirrored = arc(50, 10, 0, 90, -1);
const x = jscad(mirrored).map((point) => point[0]);
console.log("points of 10°:", short.length, "of 30°:", longer.length);
console.log("mirrored: x", Math.min(...x), "to", Math.max(...x), "dxf:", other(mirrored).min.x, "to", other(mirrored).max.x);
assert.deepStrictEqual([short.length, longer.length], [1, 2]);
assert.ok(Math.abs(Math.min(...x) - 50) < 1e-9 && Math.abs(Math.max(...x) - 60) < 1e-9);
assert.ok(Math.abs(other(mirrored).min.x + 60) < 1e-9 && Math.abs(other(mirrored).max.x + 50) < 1e-9);
END
(cd "$folder" && node a.js)
