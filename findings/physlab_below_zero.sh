#!/bin/sh
# physlab 1.0.8: the power of a number below zero has 10 % of the result as its uncertainty, without a word: the distance of a point at (−30, 40) mm,
# ±0.002 each, is 50 ± 0.90, at (30, 40) 50 ± 0.002. Where one factor is nominally 0, the product has none: (0 ± 0.002)·(10 ± 0.002) is 0 ± 0, so is the
# quotient, a slope. The code takes a tenth of the value wherever its formula, made of relative uncertainties, gives infinity or no number.
# Expected: 2 |x| u of x², so 0.002 wherever the point lies; 0.02 and 0.0002.
. "$(dirname "$0")/setup.sh"
packages physlab==1.0.8 numpy==2.4.6 matplotlib==3.11.2
python <<'END'
from physlab import phys

u = 0.002
for x in (30, -30):
    distance = (phys(x, u) ** 2 + phys(40, u) ** 2) ** 0.5
    print(f"({x}, 40): {distance.value:.4f} ± {distance.sigma:.4f}")
    assert abs(distance.value - 50) < 1e-12
    assert abs(distance.sigma - (u if x > 0 else 0.9)) < 1e-5
for power in (2, 3):
    seen = phys(-10, u) ** power
    print(f"(-10 ± {u})**{power}: {seen.value} ± {seen.sigma}, expected {power * 10 ** (power - 1) * u:g}")
    assert abs(seen.sigma / abs(seen.value) - 0.1) < 1e-12
product, slope = phys(0, u) * phys(10, u), phys(0, u) / phys(10, u)
print("product", product.sigma, "slope", slope.sigma)
assert product.sigma == slope.sigma == 0
assert abs((phys(1e-9, u) * phys(10, u)).sigma - 0.02) < 1e-6
END
