#!/bin/sh
# LinuxCNC 2.9 (Debian 12) under G7, the diameter mode of lathes: G38.3 X5 goes to the radius 2.5, and #5061 is the radius, so that
# "G1 X#5061" goes to half of it. A probing move with a rotary word is taken, and the message for a probing move under G93
# is "Cannot probe with zero feed rate" whatever the F.
# Expected: #5061 in diameter, as X is programmed; a message that names G93; a refusal of the rotary axis.
# Runs LinuxCNC's interpreter rs274, which the package linuxcnc-uspace brings (apt-get install linuxcnc-uspace).
. "$(dirname "$0")/setup.sh"
command -v rs274 >/dev/null || { echo "rs274 is missing: apt-get install linuxcnc-uspace" >&2; exit 2; }
dpkg-query -W linuxcnc-uspace | grep -q '2\.9\.' || { echo "another version than 2.9" >&2; exit 2; }
said() {
    printf '%b' "$1" >"$folder/p.ngc"
    (cd "$folder" && HOME="$folder" rs274 -g p.ngc 2>&1) >"$folder/out" || true
}
said 'G21 G7 G90 F100\nG38.3 X5\n(debug,x #5061)\nM2\n'
grep -E 'STRAIGHT_PROBE|MESSAGE' "$folder/out"
grep -q 'STRAIGHT_PROBE(2.5000, 0.0000' "$folder/out" && grep -q 'MESSAGE("x 2.500000")' "$folder/out" || exit 1
said 'G21 G90 F100\nG38.2 X5 A10\nM2\n'
grep STRAIGHT_PROBE "$folder/out"
grep -q 'STRAIGHT_PROBE(5.0000, 0.0000, 0.0000, 10.0000' "$folder/out" || exit 1
said 'G21 G93\nG38.2 X5 F10\nM2\n'
grep -i probe "$folder/out"
grep -q 'Cannot probe with zero feed rate' "$folder/out" || exit 1
