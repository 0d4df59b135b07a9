#!/bin/sh
# error-propagation 0.0.4: a number before an uncertain value is taken as if it stood behind: 10 − x is x − 10, 1/x is x. measurement-stats 0.3.0 has
# the quotient so, the difference right. Two uncertain values are right in both.
# Expected: 10 − x is 0.012 for x = 9.988, and 1/x is 0.10012.
. "$(dirname "$0")/setup.sh"
packages error-propagation==0.0.4 measurement-stats==0.3.0 numpy==2.4.6 scipy==1.17.1 pandas==3.1.1
python <<'END'
from error_propagation import Complex
from measurement_stats import ValueUncertainty

x, nominal = Complex(9.988, 0.002), Complex(10.0, 0.0)
print("10 − x:", 10 - x, "as two uncertain values:", nominal - x, "1/x:", 1 / x)
assert abs((10 - x).value + 0.012) < 1e-9 and abs((nominal - x).value - 0.012) < 1e-9
assert (1 / x).value == x.value and abs((Complex(1, 0) / x).value - 1 / 9.988) < 1e-12

y = ValueUncertainty(9.988, 0.002)
print("measurement-stats: 10 − y:", (10 - y).raw, "1/y:", (1 / y).raw)
assert abs((10 - y).raw - 0.012) < 1e-9
assert (1 / y).raw == y.raw and abs((ValueUncertainty(1, 1e-9) / y).raw - 1 / 9.988) < 1e-12
END
