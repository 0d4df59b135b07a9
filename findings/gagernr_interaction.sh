#!/bin/sh
# GageRnR 0.8.0 (as GaugeRnR 0.6.0) divides the interaction of operator and part by the number of parts, not by that of repeats: with 10
# parts and 3 repeats its standard deviation is √(3/10) of the right one, 2.84 µm for 5.19 µm, and the R&R 3.50 for 5.58 µm.
# Expected: (MS of the interaction − MS of repeats)/repeats, as AIAG's manual and every textbook of analysis of variance.
. "$(dirname "$0")/setup.sh"
packages GageRnR==0.8.0 numpy==1.26.4 scipy==1.17.1
python <<'END'
import numpy as np
from GageRnR import GageRnR

rng = np.random.default_rng(3)
operators, parts, repeats = 3, 10, 3
values = (
    20
    + rng.normal(0, 0.02, (1, parts, 1))
    + rng.normal(0, 0.002, (operators, 1, 1))
    + rng.normal(0, 0.004, (operators, parts, 1))
    + rng.normal(0, 0.002, (operators, parts, repeats))
)
cells = values.mean(2)
rest = cells - cells.mean(0) - cells.mean(1, keepdims=True) + cells.mean()
between = repeats * (rest**2).sum() / ((operators - 1) * (parts - 1))
within = values.var(2, ddof=1).mean()
right = np.sqrt((between - within) / repeats)

study = GageRnR(values)
study.calculate()
variance = next(by for name, by in study.result.items() if name.name == "Var")
seen = {str(getattr(part, "name", part)): 1000 * np.sqrt(value) for part, value in variance.items()}
print(f"interaction: {seen['OPERATOR_BY_PART']:.3f} µm for {1000 * right:.3f} µm;", "R&R:", round(seen["GageRnR"], 3))
assert abs(seen["MEASUREMENT"] / 1000 - np.sqrt(within)) < 1e-9
assert abs(seen["OPERATOR_BY_PART"] / (1000 * right) - np.sqrt(repeats / parts)) < 1e-9
END
