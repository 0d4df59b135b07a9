#!/bin/sh
# gcodeparser 0.3.0 reads G38.2 Z-10 F100 as (G, 38) without its target and feed: the decimal of the word ends the line. So it does
# with G54.1 P3 and G59.2. gcode-toolpath 3.0.0 leaves out a probing move as a whole.
# Expected: Z -10, F 100.
. "$(dirname "$0")/setup.sh"
packages gcodeparser==0.3.0
python <<'END'
import warnings

warnings.simplefilter("ignore")
from gcodeparser import GcodeParser

found = [(line.command, line.params) for line in GcodeParser("G38.2 Z-10 F100\nG54.1 P3").lines]
print(found)
assert found == [(("G", 38), {}), (("G", 54), {})], found
END
