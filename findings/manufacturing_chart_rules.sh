#!/bin/sh
# manufacturing 1.6.0 (control charts; the newest for Python 3.11): control_zone_a, "2 out of 3 are in zone A or beyond", needs 3 of 3, and never
# looks at the newest reading; control_zone_mixture, "8 consecutive points with none in zone C", is never true (above the upper and below the
# lower limit). Of radii of a reference sphere that moved by 1.5 s, it notices 36 % in 25 readings by zone A.
# Expected: both rules as their documentation says, 95 % by zone A. control_zone_b is right.
. "$(dirname "$0")/setup.sh"
packages manufacturing==1.6.0 scipy==1.17.1 numpy==2.4.6 pandas==2.3.3
python 2>"$folder/warnings" <<'END' || { cat "$folder/warnings" >&2; exit 1; }
import numpy as np
import pandas as pd
from manufacturing.analysis import control_zone_a, control_zone_b, control_zone_mixture

limits = {"upper_control_limit": 3.0, "lower_control_limit": -3.0}  # µm from the radius; s is 1 µm


def alarms(rule, readings):
    return len(rule(pd.Series(readings), **limits)) > 0


def of(readings, beyond, needed, length):
    """At least `needed` of `length` readings in a row are beyond, on one side."""
    windows = np.lib.stride_tricks.sliding_window_view(np.asarray(readings), length)
    return any(np.any(np.sum(side * windows > beyond, axis=1) >= needed) for side in (1, -1))


two_of_three = [0.1, -0.3, 2.5, 0.2, 2.6, 0.1, -0.2, 0.3]
three_inside = [0.1, -0.3, 2.5, 2.2, 2.6, 0.1, -0.2, 0.3]
three_newest = [0.1, -0.3, 0.1, -0.2, 0.3, 2.5, 2.2, 2.6]
print("zone A: 2 of 3", alarms(control_zone_a, two_of_three), "3 of 3", alarms(control_zone_a, three_inside), end=" ")
print("the newest 3", alarms(control_zone_a, three_newest), "by the rule", [of(r, 2.0, 2, 3) for r in (two_of_three, three_inside, three_newest)])
assert all(of(r, 2.0, 2, 3) for r in (two_of_three, three_inside, three_newest))
assert not alarms(control_zone_a, two_of_three) and alarms(control_zone_a, three_inside)
assert not alarms(control_zone_a, three_newest)
mixture = [1.5, -1.6, 1.4, -1.3, 1.7, -1.5, 1.2, -1.4, 1.6, -1.5, 1.3, -1.2]
print("mixture of 12:", alarms(control_zone_mixture, mixture), "smallest distance from the middle", np.abs(mixture).min())
assert not alarms(control_zone_mixture, mixture)

rng = np.random.default_rng(1)
series = rng.normal(1.5, 1.0, (1000, 25))
zone_a = np.mean([alarms(control_zone_a, readings) for readings in series])
zone_b = np.array([alarms(control_zone_b, readings) for readings in series])
rule_a = np.mean([of(readings, 2.0, 2, 3) for readings in series])
rule_b = np.array([of(readings, 1.0, 4, 5) for readings in series])
as_written = np.mean([of(readings[:-1], 2.0, 3, 3) for readings in series])
print("moved by 1.5 s: zone A", zone_a, "by the rule", rule_a, "by 3 of 3 without the newest", as_written)
print("zone B", zone_b.mean(), "by the rule", rule_b.mean())
assert zone_a == as_written and abs(zone_a - 0.36) < 0.05 and abs(rule_a - 0.95) < 0.03
assert np.array_equal(zone_b, rule_b)
END
