#!/bin/sh
# gcode-parser 2.2.0 (npm) drops a word with an expression and keeps the rest of the line: "G1 X[#5061+10] Y2" is G1 Y2. A line that the
# operator can skip (/) is an ordinary one, and X1.5E-3 is X1.5 with a word E-3.
# Expected: an error, or the text of the word.
. "$(dirname "$0")/setup.sh"
modules gcode-parser@2.2.0
cat >"$folder/run.js" <<'END'
const { parseLine } = require("gcode-parser");
const found = ["G1 X[#5061+10] Y2", "/G1 X1", "G1 X1.5E-3"].map((line) => JSON.stringify(parseLine(line).words));
console.log(found.join("  "));
const expected = ['[["G",1],["Y",2]]', '[["G",1],["X",1]]', '[["G",1],["X",1.5],["E",-3]]'];
process.exit(JSON.stringify(found) === JSON.stringify(expected) ? 0 : 1);
END
(cd "$folder" && node run.js)
