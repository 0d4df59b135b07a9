#!/bin/sh
# metrolopy 1.1.1, ArcSinDist, for a temperature that swings by ±1 K (u is a/√2, as in GUM H.1.3.4): stated by centre and half width, u is 0.354 K,
# the half; its simulation has 0.707. Stated by its limits u is right, and the simulation has twice the width, from -2 to 2. The other distributions are
# right.
# Expected: 0.707 K in all four.
. "$(dirname "$0")/setup.sh"
packages lazy-loader==0.5 numpy==2.4.6 scipy==1.17.1
PIP_NO_DEPS=1 packages metrolopy==1.1.1
python <<'END'
import numpy as np
import metrolopy as uc

def both(distribution):
    """The standard uncertainty, and the standard deviation of 100 000 simulated values."""
    value = uc.gummy(distribution)
    uc.gummy.simulate([value], n=100_000)
    return value.u, value.simdata.std()

found = {
    "centre and half width": both(uc.ArcSinDist(center=0, half_width=1)),
    "limits": both(uc.ArcSinDist(lower_limit=-1, upper_limit=1)),
    "uniform": both(uc.UniformDist(center=0, half_width=1)),
    "triangular": both(uc.TriangularDist(mode=0, half_width=1)),
}
right = {"uniform": 1 / np.sqrt(3), "triangular": 1 / np.sqrt(6)}
for name, (u, simulated) in found.items():
    print(f"{name}: u {u:.4f}, simulated {simulated:.4f}, closed form {right.get(name, 1 / np.sqrt(2)):.4f}")
root = np.sqrt(0.5)
# the standard deviation of 100 000 values is known to about 0.2 %
assert np.allclose(found["centre and half width"], [root / 2, root], rtol=0.01)
assert np.allclose(found["limits"], [root, 2 * root], rtol=0.01)
assert all(np.allclose(found[name], value, rtol=0.01) for name, value in right.items())
END
