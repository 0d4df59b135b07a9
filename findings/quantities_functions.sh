#!/bin/sh
# quantities 0.16.4, UncertainQuantity: operators propagate an uncertainty, functions of numpy set it to 0, without a word. The distance of two bores by
# np.hypot, an angle by np.arctan2 or np.sin, np.sqrt, abs, np.add of two values and np.concatenate of two sets have u = 0 (of the last the unit goes,
# too); x**-1 has a negative one. np.sum, np.mean and rescale are right.
# Expected: √((x u(x))² + (y u(y))²)/d for a distance d, as (x**2 + y**2)**0.5 gives here, or an error.
. "$(dirname "$0")/setup.sh"
packages quantities==0.16.4 numpy==2.4.6
python <<'END'
import numpy as np
import quantities as pq

def known(value, u, unit="mm"):
    return pq.UncertainQuantity(value, unit, u)

x, y = known(30.0, 0.003), known(40.0, 0.004)
right = np.hypot(30 * 0.003, 40 * 0.004) / 50
seen = {
    "(x**2 + y**2)**0.5": (x**2 + y**2) ** 0.5,
    "np.hypot(x, y)": np.hypot(x, y),
    "np.arctan2(y, x)": np.arctan2(y, x),
    "np.sin(angle)": np.sin(known(0.5, 0.01, "rad")),
    "np.sqrt(x*x)": np.sqrt(x * x),
    "abs(-x)": abs(-x),
    "x + y": x + y,
    "np.add(x, y)": np.add(x, y),
    "x**-1": x**-1,
}
u = {name: float(found.uncertainty.magnitude) for name, found in seen.items()}
print("distance 50 mm, right u:", right, "mm;", {name: round(value, 7) for name, value in u.items()})
joined = np.concatenate([known([1.0, 2.0], [0.1, 0.2]), known([3.0], [0.1])])
print("joined:", joined.units, joined.uncertainty)
assert abs(u.pop("(x**2 + y**2)**0.5") - right) < 1e-12
assert abs(u.pop("x + y") - 0.005) < 1e-12
assert abs(u.pop("x**-1") + 0.003 / 30**2) < 1e-12
assert set(u.values()) == {0.0} and len(u) == 6
assert joined.units == pq.dimensionless and not joined.uncertainty.magnitude.any()
total = np.sum(known([1.0, 2.0], [0.3, 0.4]))
assert abs(total.uncertainty.magnitude - 0.5) < 1e-12
END
