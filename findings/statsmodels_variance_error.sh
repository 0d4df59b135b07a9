#!/bin/sh
# statsmodels 0.15.0: the standard error of a variance component (MixedLM, bse_re and the column Std.Err. of the summary) is
# multiplied by the root of the residual variance, not by it, and so has the unit of a length: the same eight operators in µm and in mm have
# a variance of 7.4 µm² ± 2.5 and of 7.4e-6 mm² ± 0.0025. params and its bse are divided by the residual variance.
# Expected: ± 4.6 µm² and ± 4.6e-6 mm²; by the mean squares of this balanced design it is 4.3 µm².
. "$(dirname "$0")/setup.sh"
packages statsmodels==0.15.0 scipy==1.17.1 numpy==2.4.6 pandas==2.3.3
python <<'END'
import warnings

import numpy as np
import pandas as pd
import statsmodels.formula.api as smf

rng = np.random.default_rng(1)
operator = np.repeat(np.arange(8), 6)
reading = rng.normal(0.0, 4.0, 8)[operator] + rng.normal(0.0, 2.0, 48)  # µm from the nominal size

groups = reading.reshape(8, 6)
between, within = 6 * groups.mean(axis=1).var(ddof=1), groups.var(axis=1, ddof=1).mean()
variance = (between - within) / 6
error = np.sqrt(2 * (between**2 / 7 + within**2 / 40)) / 6
print("mean squares, in µm²: variance of operators", variance, "standard error", error, "residual", within)
for unit, factor in (("µm", 1.0), ("mm", 1e-3)):
    table = pd.DataFrame({"y": factor * reading, "operator": operator})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # in mm: "may be on the boundary", at the same ratio
        fit = smf.mixedlm("y ~ 1", table, groups="operator").fit(reml=True)
    ratio = fit.bse["operator Var"]
    print(unit, "variance", fit.cov_re.iloc[0, 0], "bse_re", fit.bse_re.iloc[0], "ratio", fit.params["operator Var"], "±", ratio)
    print(fit.summary().tables[1].loc["operator Var", ["Coef.", "Std.Err."]].to_list())
    assert abs(fit.cov_re.iloc[0, 0] / (factor**2 * variance) - 1.0) < 1e-3
    assert abs(fit.params["operator Var"] / (variance / within) - 1.0) < 1e-3
    assert abs(fit.bse_re.iloc[0] / (ratio * np.sqrt(within) * factor) - 1.0) < 1e-3, "its unit is another now"
    assert 0.9 < ratio * within / error < 1.2, "the ratio times the residual variance is right"
END
