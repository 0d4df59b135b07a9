#!/bin/sh
# gcodeparser 0.3.0 reads a word with an expression as True, which is 1 in every sum: G1 X[#5061+10] moves to X True. A modal line
# ("X5" after "G1 X1") is left out, as are the words after a comment in brackets. Nothing of this is an error.
# Expected: X[#5061+10] refused, or as text; X5 as G1 X5; "G1 X1 (c) Y2" with Y2.
. "$(dirname "$0")/setup.sh"
packages gcodeparser==0.3.0
python <<'END'
import warnings

warnings.simplefilter("ignore")
from gcodeparser import GcodeParser

found = {
    text: [(line.command, line.params) for line in GcodeParser(text).lines]
    for text in ("G1 X[#5061+10]", "G1 X1\nX5", "G1 X1 (c) Y2")
}
print(found)
assert found == {
    "G1 X[#5061+10]": [(("G", 1), {"X": True})],
    "G1 X1\nX5": [(("G", 1), {"X": 1})],
    "G1 X1 (c) Y2": [(("G", 1), {"X": 1})],
}, found
END
