#!/bin/sh
# scinum 2.2.2, a number with two uncertainties, +0.2 and −0.1: −x, 5 − x, −2 x and 1/x keep them in this order. With x between 9.9 and 10.2, −x is said
# to be between −10.1 and −9.8, and the gap 20 − x between 9.9 and 10.2 for 9.8 to 10.1.
# Expected: they change places where the result falls while x rises.
. "$(dirname "$0")/setup.sh"
packages scinum==2.2.2 numpy==2.4.6
python <<'END'
from scinum import DOWN, UP, Number, ops

x = Number(10.0, (0.2, 0.1))
rising = {"x + 5": x + 5, "2 x": 2 * x, "exp(x/10)": ops.exp(x / 10)}
falling = {"-x": -x, "20 - x": 20 - x, "-2 x": -2 * x, "1/x": 1 / x, "exp(-x/10)": ops.exp(-x / 10), "cos(x/10)": ops.cos(x / 10)}
for name, number in {**rising, **falling}.items():
    up, down = number.get_uncertainty()
    print(f"{name}: {number.get(DOWN):.4f} to {number.get(UP):.4f}")
    assert abs(up / down - 2) < 1e-9, name
assert abs((20 - x).get(UP) - 10.2) < 1e-9 and abs((20 - x).get(DOWN) - 9.9) < 1e-9
END
