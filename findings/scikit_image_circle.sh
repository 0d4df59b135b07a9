#!/bin/sh
# scikit-image 0.26.0: CircleModel, "estimated using total least squares", minimises distances of squares (d² - r²), not distances: on an arc
# of 20° with 2 µm of noise the radius of 10 mm differs by up to 24 µm from that of least squares in 40 sets, and is smaller on average.
# Expected: the circle of least squares.
. "$(dirname "$0")/setup.sh"
packages scikit-image==0.26.0 scipy==1.17.1 numpy==2.4.6
python <<'END'
import numpy as np
from scipy.optimize import least_squares
from skimage.measure import CircleModel

angle = np.radians(np.linspace(-10.0, 10.0, 25))
pairs = []
for seed in range(40):
    radius = 10.0 + np.random.default_rng(seed).normal(0.0, 0.002, 25)
    points = np.c_[radius * np.cos(angle), radius * np.sin(angle)]
    fit = least_squares(
        lambda q: np.hypot(*(points - q[:2]).T) - q[2], [0, 0, 10], xtol=1e-15, ftol=1e-15, gtol=1e-15
    )
    pairs.append((CircleModel.from_estimate(points).radius, fit.x[2]))
difference = np.subtract(*np.array(pairs).T)
print("differences: mean", difference.mean(), "largest", np.abs(difference).max())
assert np.abs(difference).max() > 0.02 and difference.mean() < -0.01
END
