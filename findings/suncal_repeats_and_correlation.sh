#!/bin/sh
# suncal 1.7.1 (Sandia's uncertainty calculator): beside repeated readings its Monte Carlo counts the instrument twice: the standard
# uncertainty of 5 readings with an instrument of 2 µm is 2.12 µm by the GUM and 2.92 µm by its Monte Carlo.
# Its degrees of freedom leave a correlation out: of a - b with r = 0.9 they are 0.08, of two inputs with 4 each.
# Expected: the same u by both, and not less than 4 degrees of freedom.
. "$(dirname "$0")/setup.sh"
packages suncal==1.7.1 numpy==2.4.6 scipy==1.17.1
python <<'END'
import suncal

readings = [20.001, 20.002, 20.000, 20.003, 19.999]
model = suncal.Model("f = a")
model.var("a").measure(readings).typeb(std=0.002)
by_gum = float(model.calculate_gum().uncertainty["f"])
by_trials = float(model.monte_carlo(samples=400_000).uncertainty["f"])
print("GUM", by_gum, "Monte Carlo", by_trials)
assert abs(by_gum - (0.002**2 + 2.5e-6 / 5) ** 0.5) < 1e-9
assert abs(by_trials - (by_gum**2 + 0.002**2) ** 0.5) < 2e-5
model = suncal.Model("f = a - b")
model.var("a").measure(20.0).typeb(std=0.001, degf=4)
model.var("b").measure(10.0).typeb(std=0.001, degf=4)
model.variables.correlate("a", "b", 0.9)
degrees = float(model.calculate_gum().degf["f"])
print("degrees of freedom", degrees)
assert abs(degrees - 0.08) < 1e-6
END
