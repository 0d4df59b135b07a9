#!/bin/sh
# LinuxCNC 2.9 (Debian 12): its macro probe-hole leaves the diameter of the tip out. Its first lines, and so its screen, have four values, the last
# of them the diameter; it takes a fifth, which is then 0: a hole is smaller by the whole tip, by 6 mm for one of 6 mm.
# Expected: the way between the touches, 0.81 inches here, and the tip: 1.0462 inches.
# Runs in LinuxCNC's interpreter rs274 (apt-get install linuxcnc-uspace), where a touch ends where it was told to end.
. "$(dirname "$0")/setup.sh"
macro=/usr/share/linuxcnc/ncfiles/macros/lathe/probe-hole.ngc
command -v rs274 >/dev/null && test -f "$macro" || { echo "missing: apt-get install linuxcnc-uspace" >&2; exit 2; }
dpkg-query -W linuxcnc-uspace | grep -q '2\.9\.' || { echo "another version than 2.9" >&2; exit 2; }
cp "$macro" "$folder"
printf '[RS274NGC]\nSUBROUTINE_PATH=%s\n' "$folder" >"$folder/a.ini"
grep -E 'MACROCOMMAND|call|^; #' "$macro"
hole() {
    printf '%s\n' 'G20 G90 F10' "o<probe-hole> call $1" M2 >"$folder/p.ngc"
    (cd "$folder" && HOME="$folder" rs274 -i a.ini -g p.ngc 2>&1) >"$folder/out" || true
    echo "$1: $(grep MESSAGE "$folder/out")"
}
grep -q '^; MACROCOMMAND=r1 Max,Fast Feed,Slow Feed,d1 (mm)$' "$macro" || exit 1
hole '[0.4] [20] [1] [6]'
grep -q 'Dia 0.810000' "$folder/out" || exit 1
hole '[0.4] [20] [1] [0] [6]'
grep -q 'Dia 1.046220' "$folder/out" || exit 1
