#!/bin/sh
# gcode-toolpath 3.0.0 (npm; pictures of programs in senders) takes G92 into account and leaves out G10 L2, G10 L20, G55 and G28: after a
# probing cycle that sets the work zero with G10 L20, as most do, its picture is where the machine is not.
# Expected: X1 after "G0 X5, G10 L20 P1 X0" at 6, as after G92 X0.
. "$(dirname "$0")/setup.sh"
modules gcode-toolpath@3.0.0
cat >"$folder/run.js" <<'END'
const made = require("gcode-toolpath");
const Toolpath = made.default || made;
const ends = (program) => {
  const seen = [];
  new Toolpath({ addLine: (modal, from, to) => seen.push(to.x), addArcCurve: () => {} }).loadFromStringSync(program);
  return seen;
};
const found = {
  g92: ends("G0 X5\nG92 X0\nG0 X1"),
  g10: ends("G0 X5\nG10 L20 P1 X0\nG0 X1"),
  l2: ends("G10 L2 P1 X100\nG54\nG0 X1"),
  g28: ends("G0 X5\nG28 X0"),
};
console.log(JSON.stringify(found));
process.exit(JSON.stringify(found) === '{"g92":[5,6],"g10":[5,1],"l2":[1],"g28":[5]}' ? 0 : 1);
END
(cd "$folder" && node run.js)
