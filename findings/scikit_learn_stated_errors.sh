#!/bin/sh
# scikit-learn 1.9.1: alpha of GaussianProcessRegressor, "the variance of additional Gaussian measurement noise", is taken relative to the
# scatter of the values with normalize_y=True: errors of 1 µm on a map that varies by 7 µm (both in mm) are taken for 7 nm, and u of the curve
# is 0.005 µm for 0.54 µm. The curve follows the errors of the touches more closely: it is 0.38 µm off for 0.26 µm (rms).
# Expected: the same curve and u with normalize_y as without it, for one and the same kernel.
. "$(dirname "$0")/setup.sh"
packages scikit-learn==1.9.1 scipy==1.17.1 numpy==2.4.6
python <<'END'
import numpy as np
from sklearn.gaussian_process import GaussianProcessRegressor
from sklearn.gaussian_process.kernels import RBF, ConstantKernel

u, amplitude, length = 0.001, 0.010, 20.0  # mm
rng = np.random.default_rng(1)
x = np.linspace(0.0, 100.0, 21)
shape = 0.010 * np.sin(x / 15.0)
y = shape + rng.normal(0.0, u, 21)
at = np.array([52.5])


def kernel(a, b):
    return amplitude**2 * np.exp(-0.5 * ((a[:, None] - b[None, :]) / length) ** 2)


gain = kernel(at, x) @ np.linalg.inv(kernel(x, x) + u**2 * np.eye(21))
closed = np.sqrt(kernel(at, at) - gain @ kernel(x, at))[0, 0]
found = {}
for name, normalize, scale, alpha in (
    ("without", False, 1.0, u**2),
    ("normalize_y", True, y.std(), u**2),
    ("normalize_y and alpha / y.std()²", True, y.std(), (u / y.std()) ** 2),
):
    process = ConstantKernel((amplitude / scale) ** 2) * RBF(length)
    fit = GaussianProcessRegressor(process, alpha=alpha, normalize_y=normalize, optimizer=None).fit(x[:, None], y)
    deviation = fit.predict(at[:, None], return_std=True)[1][0]
    off = np.sqrt(np.mean((fit.predict(x[:, None]) - shape) ** 2))
    found[name] = deviation, off
    print(name, "u in µm:", 1e3 * deviation, "rms error of the curve:", 1e3 * off)
print("closed form:", 1e3 * closed, "µm; standard deviation of y:", 1e3 * y.std(), "µm")
assert abs(found["without"][0] / closed - 1.0) < 1e-6
assert abs(found["normalize_y and alpha / y.std()²"][0] / closed - 1.0) < 1e-6
assert found["normalize_y"][0] < 0.02 * closed, "alpha has the unit of y² now"
assert found["normalize_y"][1] > 50.0 * found["normalize_y"][0]
END
