#!/bin/sh
# p2g 0.3.10 (probing programs for a Haas, written in Python) leaves out the parentheses of a second term of the same rank: a - (b - c) is a - b - c on
# the control, a - (b + c) is a - b + c, a / (b * c) is a / b * c. A slot, right - (left - tip), is wrong by twice the tip. The comment behind the line
# shows the expression as it was written.
# Expected: the parentheses, as around a first term and around a sum in a product.
. "$(dirname "$0")/setup.sh"
packages p2g==0.3.10 docopt==0.6.2 typeguard==3.0.2
cat >"$folder/slot.py" <<'END'
import p2g
def slot():
    right = p2g.Var(20.0)
    left = p2g.Var(4.0)
    tip = p2g.Var(6.0)
    width = p2g.Var(right - (left - tip))
    shift = p2g.Var(right - (left + tip))
    scale = p2g.Var(right / (left * tip))
    first = p2g.Var((right - left) - tip)
    area = p2g.Var(right * (left + tip))
END
"$folder/venv/bin/p2g" "$folder/slot.py" - >"$folder/slot.nc" || exit 2
python <<'END'
import re

value, code = {}, []
for number, term in re.findall(r"^ *#(\d+)= *([^(\n]*)", open("slot.nc").read(), re.MULTILINE):
    code.append(term.strip())
    term = term.replace("[", "(").replace("]", ")")
    # +, -, * and / bind here as on the control: from left to right, * and / first.
    value[number] = eval(re.sub(r"#(\d+)", lambda found: f"({value[found[1]]})", term))
right, left, tip, width, shift, scale, first, area = value.values()
for name, seen, meant in (
    ("width", width, right - (left - tip)),
    ("shift", shift, right - (left + tip)),
    ("scale", scale, right / (left * tip)),
    ("first", first, right - left - tip),
    ("area", area, right * (left + tip)),
):
    print(f"{name}: {seen:g} for {meant:g}")
print(code[3:])
assert (right, left, tip) == (20, 4, 6)
assert (width, shift, scale) == (20 - 4 - 6, 20 - 4 + 6, 20 / 4 * 6)
assert (first, area) == (10, 200)
END
