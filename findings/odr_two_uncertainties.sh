#!/bin/sh
# scipy.odr 1.17.1 and odrpack 0.7.0 return two uncertainties of a parameter that differ: sd_beta is multiplied by the scatter of
# the residuals, cov_beta is not. With stated errors ten times as large, sd_beta stays and the root of cov_beta is tenfold.
# Expected: sd_beta is the root of the diagonal of cov_beta.
. "$(dirname "$0")/setup.sh"
packages scipy==1.17.1 odrpack==0.7.0 numpy==2.4.6
python <<'END'
import warnings

warnings.simplefilter("ignore")  # scipy.odr is deprecated
import numpy as np
import odrpack
from scipy import odr

x = np.linspace(0.0, 10.0, 11)
y = 2.0 * x + 1.0 + 0.002 * np.array([1, -1, 2, -2, 1, 0, -1, 2, -2, 1, -1])
found = []
for u in (0.002, 0.02):
    line = odr.Model(lambda b, x: b[0] * x + b[1])
    result = odr.ODR(odr.RealData(x, y, sx=1e-9, sy=u), line, beta0=[2.0, 1.0]).run()
    other = odrpack.odr_fit(
        lambda x, b: b[0] * x + b[1], x, y, np.array([2.0, 1.0]), weight_x=1e18, weight_y=1 / u**2
    )
    found.append([(r.sd_beta[0], r.cov_beta[0, 0] ** 0.5) for r in (result, other)])
    print("u of y", u, "scipy.odr, odrpack:", found[-1])
for before, after in zip(*found):
    assert abs(after[0] / before[0] - 1.0) < 1e-3, "sd_beta changes now"
    assert abs(after[1] / before[1] - 10.0) < 1e-2, "cov_beta is scaled now"
END
