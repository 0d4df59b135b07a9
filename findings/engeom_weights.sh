#!/bin/sh
# engeom 0.5.0: the weights of Plane3.from_fit multiply the squares of the distances, those of Sphere3.from_fit the distances, although the
# documentation of both speaks of the residual of each point. 1/u is right for the sphere, 1/u² for the plane.
# Expected: one rule.
. "$(dirname "$0")/setup.sh"
packages engeom==0.5.0 scipy==1.17.1 numpy==2.4.6
python <<'END'
import numpy as np
from engeom.geom3 import Plane3, Sphere3
from scipy.optimize import least_squares

rng = np.random.default_rng(5)
weight = rng.uniform(0.2, 2.0, 12)
exact = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}

across, height = rng.uniform(-20.0, 20.0, (12, 2)), rng.normal(0.0, 0.01, 12)
fitted = Plane3.from_fit(np.c_[across, height], weight).normal
fitted = np.array([fitted.x, fitted.y, fitted.z]) * np.sign(fitted.z)


def plane(factor):
    distance = lambda q: (height - q[0] - across @ q[1:]) / np.sqrt(1.0 + q[1:] @ q[1:])
    q = least_squares(lambda q: factor * distance(q), np.zeros(3), **exact).x
    normal = np.r_[-q[1:], 1.0]
    return np.abs(fitted - normal / np.linalg.norm(normal)).max()


direction = rng.normal(size=(12, 3))
direction /= np.linalg.norm(direction, axis=1, keepdims=True)
points = direction * (10.0 + rng.normal(0.0, 0.01, 12))[:, None]
radius = Sphere3.from_fit(points, weight).r


def sphere(factor):
    distance = lambda q: np.linalg.norm(points - q[:3], axis=1) - q[3]
    return abs(radius - least_squares(lambda q: factor * distance(q), [0.0, 0.0, 0.0, 10.0], **exact).x[3])


print("plane: distances times w", plane(weight), "times root of w", plane(np.sqrt(weight)))
print("sphere: distances times w", sphere(weight), "times root of w", sphere(np.sqrt(weight)))
assert plane(np.sqrt(weight)) < 1e-12 and plane(weight) > 1e-5
assert sphere(weight) < 1e-8 and sphere(np.sqrt(weight)) > 1e-4
END
