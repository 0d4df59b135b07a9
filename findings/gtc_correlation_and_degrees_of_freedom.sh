#!/bin/sh
# GTC 1.5.1 refuses a correlation between two inputs with finite degrees of freedom unless both were made in one call, which
# gives them the same number: a mean of 5 touches and a certificate with 20 degrees of freedom cannot be correlated.
# Expected: a result whose degrees of freedom are not stated.
. "$(dirname "$0")/setup.sh"
packages GTC==1.5.1
python <<'END'
import GTC

touches = GTC.ureal(20.0, 0.001, 4, independent=False)
certificate = GTC.ureal(20.0, 0.002, 20, independent=False)
try:
    GTC.set_correlation(0.5, touches, certificate)
except RuntimeError as error:
    print("finite, two calls:", str(error)[:45])
else:
    raise SystemExit("the correlation is taken now")
one, two = GTC.multiple_ureal([20.0, 20.0], [0.001, 0.002], 4)
GTC.set_correlation(0.5, one, two)
print("one call: df", GTC.dof(one + two))
assert abs(GTC.dof(one + two) - 4.0) < 1e-9
one, two = (GTC.ureal(20.0, u, independent=False) for u in (0.001, 0.002))
GTC.set_correlation(0.5, one, two)
print("infinite: u", GTC.uncertainty(one + two))
assert abs(GTC.uncertainty(one + two) - 0.001 * 7**0.5) < 1e-12
END
