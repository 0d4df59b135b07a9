#!/bin/sh
# qualistics 0.1.0, gauge_rr: "repeatability" divides the squares within the cells by n - 1 for all readings, not by n - cells: of two readings by
# three operators of each part it is √(30/59) of the right one, 0.71. And if every operator has parts of his own, as many as the others
# (destructive tests), the empty cells of the table are zeros: R&R is 9.5 mm for some µm on parts of 20 mm.
# Expected: the pooled standard deviation of the cells; a nested study, of which the function speaks.
. "$(dirname "$0")/setup.sh"
packages qualistics==0.1.0 numpy==2.4.6 pandas==3.1.1 scipy==1.17.1 matplotlib==3.11.2
python <<'END'
import numpy as np
import pandas as pd
from qualistics.gauge import gauge_rr

rng = np.random.default_rng(1)

def study(parts_of):
    sizes = 20_000 + rng.normal(0, 20, 100)
    rows = [(part, name, sizes[part] + rng.normal(0, 2)) for name in range(3) for part in parts_of(name) for _ in range(2)]
    table = pd.DataFrame(rows, columns=["Part", "Operator", "Measurement"])
    table["Randomised Order"] = range(len(table))
    report = gauge_rr(table)
    root = {row.Source.strip(): float(row.Variance) ** 0.5 for row in report.itertuples() if row.Variance}
    within = table.groupby(["Part", "Operator"]).Measurement.var(ddof=1).mean() ** 0.5
    return root["Repeatability (Instrument)"], root["Gauge R&R"], within

crossed = study(lambda name: range(10))
nested = study(lambda name: range(10 * name, 10 * name + 5))
print(f"all parts: repeatability {crossed[0]:.3f} for {crossed[2]:.3f} µm;", end=" ")
print(f"own parts: R&R {nested[1]:.0f} µm, of which repeatability {nested[2]:.2f} µm")
assert abs(crossed[0] / crossed[2] - (30 / 59) ** 0.5) < 1e-3
assert nested[1] > 9000 and nested[2] < 4
END
