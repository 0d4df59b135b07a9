#!/bin/sh
# lmfit 1.3.4: eval_uncertainty(sigma=1) multiplies the standard uncertainty of a fitted curve by Student's t (84 %, n − p): 1.32 times for four
# points on a line, 1.84 for three; also with scale_covar=False, where u is stated and has no such degrees of freedom. uvars of the same
# result (with uncertainties 3.2.3) gives the standard uncertainty.
# Expected: one number for both ways, the root of J C Jᵀ.
. "$(dirname "$0")/setup.sh"
packages lmfit==1.3.4 uncertainties==3.2.3 scipy==1.17.1 numpy==2.4.6
python <<'END'
import numpy as np
from lmfit import Model
from scipy import stats

u = 0.002
for x, residual in (([0.0, 1.0, 2.0], [1.0, -2.0, 1.0]), ([0.0, 1.0, 2.0, 3.0], [1.0, -1.0, -1.0, 1.0])):
    x = np.array(x)
    y = 10.0 + 0.01 * x + u * np.array(residual)
    jacobian = np.c_[x, np.ones(len(x))]
    stated = u * np.sqrt(np.array([10.0, 1.0]) @ np.linalg.inv(jacobian.T @ jacobian) @ [10.0, 1.0])
    t = stats.t.ppf(stats.norm.cdf(1.0), len(x) - 2)
    fit = Model(lambda x, a, b: a * x + b).fit(y, x=x, a=0.0, b=10.0, weights=1 / u, scale_covar=False)
    band = fit.eval_uncertainty(x=np.array([10.0]), sigma=1)[0]
    other = (fit.uvars["a"] * 10.0 + fit.uvars["b"]).std_dev
    print(len(x), "points, at x = 10, in µm: band", 1e3 * band, "uvars", 1e3 * other, "J C Jᵀ", 1e3 * stated, "ratio", band / stated)
    assert abs(other / stated - 1.0) < 1e-4
    assert abs(band / stated / t - 1.0) < 1e-3, "t is left out now"
END
