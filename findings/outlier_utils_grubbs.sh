#!/bin/sh
# outlier-utils 0.0.5: Grubbs' test divides by the standard deviation with n, and compares with the table for n - 1: of five good readings
# it rejects one or more in 31 % of sets at alpha = 0.05 (10.5 % of ten), repeats the test on those that remain, and keeps 4.34 on average.
# Expected: 5 %, as scikit-posthocs 0.17.1 with the same table. A touch that is rejected wrongly makes the repeatability look better.
. "$(dirname "$0")/setup.sh"
packages outlier-utils==0.0.5 scikit-posthocs==0.17.1 scipy==1.17.1 numpy==2.4.6 pandas==2.3.3
python <<'END'
import numpy as np
from outliers import smirnov_grubbs
from scikit_posthocs import outliers_grubbs
from scipy import stats

rng = np.random.default_rng(1)
for n, expected in ((5, 0.31), (10, 0.105)):
    t2 = stats.t.isf(0.05 / (2 * n), n - 2) ** 2
    limit = (n - 1) / np.sqrt(n) * np.sqrt(t2 / (n - 2 + t2))
    sets = rng.normal(10.0, 0.002, (4000, n))
    kept = np.array([len(smirnov_grubbs.test(readings, alpha=0.05)) for readings in sets])
    other = np.array([len(outliers_grubbs(readings, alpha=0.05)) for readings in sets])
    largest = np.abs(sets - sets.mean(axis=1, keepdims=True)).max(axis=1)
    by_n, by_n_less_1 = (largest / sets.std(axis=1, ddof=ddof) > limit for ddof in (0, 1))
    print(n, "readings: rejects in", np.mean(kept < n), "keeps", kept.mean(), "lowest", kept.min())
    print("  scikit-posthocs", np.mean(other < n), "by n", by_n.mean(), "by n - 1", by_n_less_1.mean())
    assert np.array_equal(kept < n, by_n), "it divides by something else now"
    assert np.array_equal(other < n, by_n_less_1)
    assert abs(np.mean(kept < n) - expected) < 0.015 and abs(np.mean(other < n) - 0.05) < 0.015
END
