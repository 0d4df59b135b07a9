#!/bin/sh
# stackcore 0.3.3 (tolerance stacks by Monte Carlo) computes each metric as the kind of the last one: with an angle and a distance in one stack,
# the angle is the distance, 50.1 for 0°; with a distance and an angle, the distance is -2864.8 (50 taken for radians). Each alone is right.
# Expected: both as alone: a part that is 0.1 mm too high shifts the plane by 0.1 mm and tilts nothing.
. "$(dirname "$0")/setup.sh"
packages stackcore==0.3.3 numpy==1.26.4 numba==0.68.1 scipy==1.17.1 matplotlib==3.11.2 tqdm==4.70.1
python <<'END'
import contextlib
import io

import numpy as np
from stackcore.stack import Stack

plane = np.array([[0.0, 0, 0], [10, 0, 0], [0, 10, 0]])
up = np.tile([0.0, 0, 1], (3, 1))
part = {"plane": plane + [0, 0, 5], "tolerances": [{"type": "displacement", "axis": up, "tol": (0.1, 0.1)}]}

def mean(*kinds):
    stack = Stack(plane + [0, 0, 50], plane, [part], [{"type": kind} for kind in kinds], "", False)
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        stack.monte(20)
    return [round(float(np.mean(values)), 4) for values in stack.delta_metrics]

alone = [mean("Angular"), mean("Linear")]
both = [mean("Angular", "Linear"), mean("Linear", "Angular")]
print("alone:", *alone, "angle and distance:", both[0], "distance and angle:", both[1])
assert alone == [[0.0], [0.1]] and both == [[50.1, 0.1], [-2864.789, 0.0]]
END
