#!/bin/sh
# isofits 1.0: a shaft f6 of 120 to 180 mm has −43/−48 µm, for −43/−68: 5 µm wide for 25. A hole E7 of 315 to 400 mm is 60 µm wide for 57, K6 of 6 to 10
# mm 8 for 9. All other fits of its table are as wide as H or h of the same grade; pressfit 0.1.0 has the same shafts, f6 as in ISO 286.
# Expected: one width for all letters of a grade in a range of sizes (ISO 286-1).
. "$(dirname "$0")/setup.sh"
packages isofits==1.0 pressfit==0.1.0
python <<'END'
import re

from data import hole_data, shaft_data
from isofits import isotol
from pressfit import fit

sizes = [int(size) for size in hole_data["inc."]]
checked, odd, other = 0, {}, {}
for body, table, zero in (("hole", hole_data, "H"), ("shaft", shaft_data, "h")):
    for name in [name for name in table if name not in ("over", "inc.")]:
        letter, grade = re.fullmatch(r"([A-Za-z]+)(\d+)", name).groups()
        for size in sizes:
            upper, lower = isotol(body, size, name, "both")
            if zero + grade in table:
                checked += 1
                top, bottom = isotol(body, size, zero + grade, "both")
                if upper - lower != top - bottom:
                    odd.setdefault(name, []).append((size, upper - lower, top - bottom))
            if body == "shaft" and letter in "defghkmnp" and 5 <= int(grade) <= 11:
                shaft = fit(f"{size} H7/{name}")
                if (upper, lower) != (shaft.shaft_es_um, shaft.shaft_ei_um):
                    other.setdefault(name, []).append((size, lower, shaft.shaft_ei_um))
print("of", checked, "as wide as H or h, but", odd, "other than pressfit:", other)
assert odd == {
    "E7": [(355, 60, 57), (400, 60, 57)],
    "K6": [(10, 8, 9)],
    "f6": [(140, 5, 25), (160, 5, 25), (180, 5, 25)],
}
assert other == {"f6": [(140, -48, -68), (160, -48, -68), (180, -48, -68)]}
END
