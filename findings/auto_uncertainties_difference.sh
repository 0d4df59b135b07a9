#!/bin/sh
# auto_uncertainties 1.1.0 ("automatic" as its name is) forgets where a value comes from: x - x has the uncertainty √2 u(x), and
# x/x that of two independent values. A distance of two bores from one datum has the error of the datum twice.
# Expected: 0, as GTC, METAS UncLib, metrolopy, mcerp and uncertainties give.
. "$(dirname "$0")/setup.sh"
packages auto-uncertainties==1.1.0 uncertainties==3.2.3 numpy==2.4.6
python <<'END'
from auto_uncertainties import Uncertainty
from uncertainties import ufloat

x, y = Uncertainty(10.0, 0.003), ufloat(10.0, 0.003)
print("x - x:", x - x, "uncertainties:", y - y, "; x / x:", x / x)
assert abs((x - x).error - 0.003 * 2**0.5) < 1e-12 and (y - y).std_dev == 0.0
assert abs((x / x).error - 0.0003 * 2**0.5) < 1e-12
END
