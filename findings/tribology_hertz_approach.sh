#!/bin/sh
# tribology 0.5.16: dhertz (approach of two bodies) wants E* of Johnson, but eeff of the same module returns 2 E*, as ahertz wants it. A ruby ball of
# 6 mm on steel under 1 N: 0.128 µm for 0.203 µm, 2^(-2/3) of it; a²/R from the contact radius of ahertz is right. In a bore of 7 mm: 0.032 for
# 0.140 µm, for the half axes of the ellipse are wrong too. Installed without its dependencies, as it pins numpy of 2019.
# Expected: one modulus, and the approach (9 F²/(16 R E*²))^(1/3) of Hertz.
. "$(dirname "$0")/setup.sh"
packages numpy==2.4.6 scipy==1.17.1 numexpr==2.14.2 matplotlib==3.11.2 opencv-python-headless==5.0.0.93
PIP_NO_DEPS=1 packages tribology==0.5.16
python <<'END'
import numpy as np
import tribology
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

ruby, steel, radius, force = (400e3, 0.23), (210e3, 0.30), 3.0, 1.0
stiffness = 1 / sum((1 - poisson**2) / young for young, poisson in (ruby, steel))
theirs = tribology.eeff(*ruby, *steel)

def right(other):
    """Approach of a ball and a cylinder of radius other (negative: a bore), Hertz by elliptic integrals."""
    small, large = sorted((1 / radius, 1 / radius + 1 / other))
    if small == large:
        return (9 * force**2 / (16 * radius * stiffness**2)) ** (1 / 3)
    def ratio(m):
        return (ellipe(m) / (1 - m) - ellipk(m)) / (ellipk(m) - ellipe(m)) - large / small
    m = brentq(ratio, 1e-9, 1 - 1e-9)
    flat = np.sqrt(1 - m)
    size = 4 / (np.pi * m) * flat**1.5 * np.sqrt((ellipe(m) / flat**2 - ellipk(m)) * (ellipk(m) - ellipe(m)))
    mean = (0.75 * force / stiffness / np.sqrt(small * large) * size) ** (1 / 3)
    return 1.5 * force / (np.pi * mean**2) / stiffness * mean * np.sqrt(flat) * ellipk(m)

bodies = (radius, radius, np.inf, np.inf)
contact = tribology.ahertz(*tribology.reff(*bodies), theirs, force)[0]
plane = tribology.dhertz(theirs, *bodies, force)
bore = tribology.dhertz(theirs, radius, radius, np.inf, -3.5, force)
print(f"modulus/E*: {theirs / stiffness:.3f}; plane: {1000 * plane:.4f} for {1000 * right(np.inf):.4f} µm,", end=" ")
print(f"a²/R {1000 * contact**2 / radius:.4f}; bore: {1000 * bore:.4f} for {1000 * right(-3.5):.4f} µm")
assert abs(theirs / stiffness - 2) < 1e-12
assert abs(contact**2 / radius / right(np.inf) - 1) < 1e-9
assert abs(plane / right(np.inf) - 2 ** (-2 / 3)) < 1e-9
assert abs(bore / right(-3.5) - 0.227) < 0.001
END
