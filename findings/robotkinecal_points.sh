#!/bin/sh
# robotkinecal 0.1.0 (axes of a robot from measured poses or points of its tool) counts six equations for each observation, also where it is a point, as
# a laser tracker gives it. "joints_uncertainty" of 12 points and 27 parameters has the residual variance of 45 degrees of freedom for 9: it is five
# times too small. It is a variance, mm² and rad² in one norm; its root is √5 times too small. Axes and residuals are right.
# Expected: 3 · 12 − 27 = 9 degrees of freedom: the squares of the residuals over σ² add up to 9 on average, as they do.
. "$(dirname "$0")/setup.sh"
packages robotkinecal==0.1.0 roboticstoolbox-python==1.4.4 spatialmath-python==1.1.18 numpy==1.26.4 scipy==1.17.1
python <<'END'
import numpy as np
from roboticstoolbox import ET, Link, Robot
from robotkinecal.calibration import SerialRobotKineCal

def robot():
    quarter = np.pi / 2
    steps = (
        ET.tz(400.0), ET.Rx(quarter), ET.tx(500.0),
        ET.Ry(quarter) * ET.tz(100.0), ET.Rx(quarter) * ET.tx(50.0), ET.Ry(quarter) * ET.tz(80.0),
    )
    links = []
    for number, step in enumerate(steps):
        links.append(Link(step * ET.Rz(), name=f"link{number}", parent=links[-1] if links else None))
    return Robot([*links, Link(ET.tx(30.0) * ET.tz(20.0), name="tool", parent=links[-1])])

rng = np.random.default_rng(7)
sigma, points, parameters, sets = 0.02, 12, 27, 15
squares, ratios = [], []
for _ in range(sets):
    calibration = SerialRobotKineCal(robot(), "tool")
    joints = list(rng.uniform(-1.2, 1.2, (points, 6)))
    seen = [calibration.forward_kinematics(7, angles).t + rng.normal(0, sigma, 3) for angles in joints]
    calibration.set_observations(joints, seen)
    last = calibration.solve(max_iterations=8).iteration_results[-1]
    design = last.A_all
    assert np.linalg.matrix_rank(design) == parameters
    residual = last.twist_errors - design @ last.twist_corrections
    squares.append(float((residual**2).sum()))
    of_design = np.diag(np.linalg.inv(design.T @ design))[:-3].reshape(-1, 4)
    right = np.linalg.norm(of_design, axis=1) * squares[-1] / (3 * points - parameters)
    ratios.append(last.get_statistics()["joints_uncertainty"] / right)
mean = np.mean(squares) / sigma**2
print(f"squares of residuals over σ²: {mean:.2f} on average of {sets} sets; variance over the right one: {np.mean(ratios):.4f}")
assert abs(mean - 9) < 4 * (2 * 9 / sets) ** 0.5
assert np.allclose(ratios, 9 / 45, rtol=1e-6)
END
