#!/bin/sh
# LinuxCNC 2.9 (Debian 12), its macros probe_front_edge_angle and the three for other edges: they set the work zero along the edge to the
# position in the old work system, as if it were one of the machine (G10 L2): 8 inches off where the old zero was at X8. Run again, with the
# axes turned by what the first run found, they find 0° and set the rotation to 0: the correction is gone.
# Expected: the zero at X10 of the machine, where the first touch was, and a rotation that stays 3°.
# Runs the macro in LinuxCNC's interpreter rs274 (apt-get install linuxcnc-uspace), which has no part: probe_y_plus, which the macro calls for a
# touch, is replaced by one that gives the height of an edge through X10 Y4 of the machine, turned by 3°.
. "$(dirname "$0")/setup.sh"
macro=/usr/share/linuxcnc/ncfiles/probe/basic_probe/macros/probe_front_edge_angle.ngc
command -v rs274 >/dev/null && test -f "$macro" || { echo "missing: apt-get install linuxcnc-uspace" >&2; exit 2; }
dpkg-query -W linuxcnc-uspace | grep -q '2\.9\.' || { echo "another version than 2.9" >&2; exit 2; }
for edge in front back; do grep -q 'G10 L2 P#5220 X\[#<x_start_position>\] Y' "${macro%front*}${edge}_edge_angle.ngc" || exit 1; done
for edge in left right; do grep -q 'G10 L2 P#5220 .*] Y\[#<y_start_position>\]' "${macro%front*}${edge}_edge_angle.ngc" || exit 1; done
cp "$macro" "$folder"
cat >"$folder/probe_y_plus.ngc" <<'END'
o<probe_y_plus> sub
  #<x> = [[10 - #5221] * COS[#5230] + [4 - #5222] * SIN[#5230]]
  #<y> = [[4 - #5222] * COS[#5230] - [10 - #5221] * SIN[#5230]]
o<probe_y_plus> endsub [#<y> + TAN[3 - #5230] * [#5420 - #<x>]]
M2
END
printf '[RS274NGC]\nSUBROUTINE_PATH=%s\n' "$folder" >"$folder/a.ini"
cat >"$folder/p.ngc" <<'END'
G20 G90 G10 L2 P1 X8 Y4 Z0 R0
G54 G0 X2 Y0
(tool 0, search 1, clearances 0.1, step 0.5, feeds 1 and 20, edge 4, mode 0: set the zero, 1: and the rotation)
o<probe_front_edge_angle> call [0] [1] [1] [0.1] [0.1] [0.5] [0] [1] [20] [0] [0] [0] [0] [4] [0] [1]
(debug,first X#5221 Y#5222 R#5230)
G0 X1 Y0
o<probe_front_edge_angle> call [0] [1] [1] [0.1] [0.1] [0.5] [0] [1] [20] [0] [0] [0] [0] [4] [0] [1]
(debug,second R#5230)
M2
END
(cd "$folder" && HOME="$folder" rs274 -i a.ini -g p.ngc 2>&1) >"$folder/out" || true
grep MESSAGE "$folder/out"
grep -q 'MESSAGE("first X2.000000 Y4.000000 R3.000000")' "$folder/out" || exit 1
grep -Eq 'MESSAGE\("second R-?0.000000"\)' "$folder/out" || exit 1
