#!/bin/sh
# toleranceinterval 1.0.3: twoside.normal with pool_variance=True takes the factor for the pooled standard deviation of all rows, but multiplies it by the
# standard deviation of each row alone. Ten parts with three readings each: 3.19 times s from two degrees of freedom, which needs 9.79. The intervals
# that shall hold 95 % of the readings in 95 % of cases do so in 62 %; 30 parts with two readings each: in 49 %.
# Expected: mean of the row ± 3.19 times the pooled s, which holds (the script counts it too).
. "$(dirname "$0")/setup.sh"
packages toleranceinterval==1.0.3 numpy==2.4.6 scipy==1.17.1
python <<'END'
import numpy as np
import toleranceinterval as ti
from scipy.stats import norm

def held(lower, upper):
    """Share of the intervals that hold 95 % of readings, which are normal with standard deviation 1 µm."""
    return np.mean(norm.cdf(upper) - norm.cdf(lower) >= 0.95)

random = np.random.default_rng(1)
for parts, readings, seen in ((10, 3, 0.624), (30, 2, 0.486)):
    sets = random.normal(0, 1, (4000, parts, readings))
    mean, own = sets.mean(axis=2), sets.std(axis=2, ddof=1)
    pooled = np.sqrt(np.mean(own**2, axis=1, keepdims=True))
    factor = ti.twoside.normal_factor(readings, 0.95, 0.95, m=parts)
    intervals = np.array([ti.twoside.normal(of_parts, 0.95, 0.95, pool_variance=True) for of_parts in sets[:3]])
    assert np.allclose(intervals[..., 0], (mean - factor * own)[:3]) and np.allclose(intervals[..., 1], (mean + factor * own)[:3])
    library = held(mean - factor * own, mean + factor * own)
    right = held(mean - factor * pooled, mean + factor * pooled)
    print(f"{parts} parts with {readings} readings: factor {factor:.2f}, held {library:.1%}, with the pooled s {right:.1%}")
    # the share of 4000 sets, whose intervals have one pooled s, is known to about 0.4 %
    assert abs(library - seen) < 0.01 and abs(right - 0.95) < 0.015
END
