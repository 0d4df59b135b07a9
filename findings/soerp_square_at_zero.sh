#!/bin/sh
# soerp 1.0.1 (uncertainty to second order): x**2 has half its second derivative where x is nominally 0, and only there: the mean of x² is
# half of u², its variance a quarter. x*x is right. Position errors are deviations from 0: of a hole with 10 µm in x and in y, the mean of
# (2r)² = 4 (x² + y²) is 400 µm² for 800 µm².
# Expected: 800 µm², as x*x gives, and x**2 at 1e-9.
. "$(dirname "$0")/setup.sh"
packages soerp==1.0.1 scipy==1.17.1 numpy==2.4.6
python <<'END'
from soerp import N

u = 0.010
for nominal in (0.0, 1e-9, 3.0):
    x = N(nominal, u)
    power, product = x**2, x * x
    mean, variance = nominal**2 + u**2, 2 * u**4 + 4 * nominal**2 * u**2  # of a square of a normal variable
    print(nominal, "x**2:", power.mean, power.var, "x*x:", product.mean, product.var, "exact:", mean, variance)
    assert abs(product.mean / mean - 1.0) < 1e-9 and abs(product.var / variance - 1.0) < 1e-9
    factor = 0.5 if nominal == 0.0 else 1.0
    assert abs(power.mean / mean / factor - 1.0) < 1e-9 and abs(power.var / variance / factor**2 - 1.0) < 1e-9
x, y = N(0.0, u), N(0.0, u)
print("hole, (2r)² in µm²:", 1e6 * (4 * (x**2 + y**2)).mean, "with products:", 1e6 * (4 * (x * x + y * y)).mean)
assert abs(1e6 * (4 * (x**2 + y**2)).mean - 400.0) < 1e-6 and abs(1e6 * (4 * (x * x + y * y)).mean - 800.0) < 1e-6
END
