#!/bin/sh
# dxf-parser 1.1.2 gives the angle of an arc from 350° to 20° as -330°: it subtracts, and an arc in DXF always runs
# counter-clockwise. The length of its path has the wrong sign and is eleven times as large; arcs that do not pass 0° are right.
# Expected: 30°.
. "$(dirname "$0")/setup.sh"
modules dxf-parser@1.1.2 dxf-writer@1.18.4
cat >"$folder/a.js" <<'END'
const assert = require("assert");
const made = require("dxf-parser");
const DxfParser = made.default || made;
const Writer = require("dxf-writer");

function degrees(from, to) {
  const drawing = new Writer();
  drawing.drawArc(0, 0, 10, from, to);
  const arc = new DxfParser().parseSync(drawing.toDxfString()).entities[0];
  return Math.round((arc.angleLength * 180e6) / Math.PI) / 1e6;
}

console.log("from 10° to 40°:", degrees(10, 40), "from 350° to 20°:", degrees(350, 20), "from 270° to 0°:", degrees(270, 0));
assert.deepStrictEqual([degrees(10, 40), degrees(350, 20), degrees(270, 0)], [30, -330, -270]);
END
(cd "$folder" && node a.js)
