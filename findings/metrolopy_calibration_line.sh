#!/bin/sh
# metrolopy 1.1.1, a straight line through twelve points (PolyFit, deg=1) with stated uncertainties: one number for all, `uy=0.002`, is left out, and
# offset and slope have u as if it were 1: 500 times too large; as an array or as values with u it is right. Values x with u: its text says that the
# solver is then "odr", it is "ols", and u(x) is left out: 55 % of u for 2 µm in y and 3 µm in x, 10 % for 1 and 10 µm. With solver="odr" u is
# larger by √2, also where u(x) is tiny.
# Expected: the covariance of least squares with u² = u(y)² + slope² u(x)², here slope 1.
. "$(dirname "$0")/setup.sh"
packages lazy-loader==0.5 odrpack==0.7.0 numpy==2.4.6 scipy==1.17.1
PIP_NO_DEPS=1 packages metrolopy==1.1.1
python <<'END'
import numpy as np
import metrolopy as uc

PLACES = np.arange(12.0)
DESIGN = np.vander(PLACES, 2, increasing=True)
FACTORS = np.sqrt(np.diag(np.linalg.inv(DESIGN.T @ DESIGN)))
random = np.random.default_rng(1)

def fit(u_y, u_x=0.0, stated="values", **how):
    """How large u of offset and slope are, relative to the closed form; the solver."""
    y = PLACES + random.normal(0, u_y, 12)
    x = PLACES + random.normal(0, u_x, 12) if u_x else PLACES
    if u_x:
        x = [uc.gummy(value, u_x) for value in x]
    if stated == "values":
        y = [uc.gummy(value, u_y) for value in y]
    else:
        how["uy"] = u_y if stated == "one number" else np.full(12, u_y)
    line = uc.PolyFit(x, y, deg=1, **how)
    ratios = [parameter.u / (factor * np.hypot(u_y, u_x)) for parameter, factor in zip(line.p, FACTORS)]
    print(f"u(y) {u_y}, u(x) {u_x}, {stated}, {line.solver}: u of offset and slope are", np.round(ratios, 3), "of the closed form")
    # 0.3 %: the closed form has the slope 1 and the true x
    assert abs(ratios[0] / ratios[1] - 1) < 0.003
    return ratios[1], line.solver

def near(found, ratio, solver):
    return abs(found[0] / ratio - 1) < 0.003 and found[1] == solver

assert near(fit(0.002, stated="array"), 1, "ols") and near(fit(0.002), 1, "ols")
assert near(fit(0.002, stated="one number"), 500, "ols")
assert near(fit(0.002, 0.003), 2 / np.sqrt(13), "ols") and near(fit(0.001, 0.01), 1 / np.sqrt(101), "ols")
for u_y, u_x in ((0.002, 0.003), (0.003, 0.0001)):
    assert near(fit(u_y, u_x, solver="odr"), np.sqrt(2), "odr")
END
