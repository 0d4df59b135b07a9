#!/bin/sh
# METAS UncLib 3.0.3 for Python: ufloatfromsamples multiplies s/√n by t(95 %, n − 1)/1.96 and states infinite degrees of freedom (mode
# ExpandInputCovariance, the one it starts with): five readings 1.42 times, two readings 6.5 times. The mode Dof gives s/√n and n − 1.
# Expected: s/√n with n − 1 degrees of freedom (GUM 4.2.3). Needs Debian's packages mono-runtime and mono-devel.
. "$(dirname "$0")/setup.sh"
command -v mono >/dev/null || { echo "needs mono: apt-get install mono-devel" >&2; exit 2; }
packages metas-unclib==3.0.3 pythonnet==3.2.1 scipy==1.17.1 numpy==2.4.6
PYTHONNET_RUNTIME=mono python 2>"$folder/warnings" <<'END' || { cat "$folder/warnings" >&2; exit 1; }
import numpy as np
from metas_unclib import FromSamplesModeType, get_idof, get_stdunc, ufloatfromsamples, use_linprop
from scipy import stats

readings = np.array([10.0012, 10.0007, 10.0016, 10.0009, 10.0011])
use_linprop()
for n in (2, 3, 5):
    mean = ufloatfromsamples(readings[:n])
    ratio = get_stdunc(mean) / (readings[:n].std(ddof=1) / np.sqrt(n))
    expected = stats.t.ppf(0.975, n - 1) / stats.norm.ppf(0.975)
    print(n, "readings: u is", ratio, "times s/√n; inverse degrees of freedom", get_idof(mean))
    assert abs(ratio - expected) < 1e-6 and get_idof(mean) == 0.0
use_linprop(fromsamplesmode=FromSamplesModeType.Dof)
mean = ufloatfromsamples(readings)
print("mode Dof:", get_stdunc(mean) / (readings.std(ddof=1) / np.sqrt(5)), get_idof(mean))
assert abs(get_stdunc(mean) / (readings.std(ddof=1) / np.sqrt(5)) - 1.0) < 1e-9 and abs(get_idof(mean) - 0.25) < 1e-12
END
