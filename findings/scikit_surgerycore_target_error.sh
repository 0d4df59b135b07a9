#!/bin/sh
# scikit-surgerycore 0.8.3: compute_tre_from_fle, the error of a point of a part that was aligned on datum points, changes when the same part
# lies elsewhere: 8.3, 11.8 and 11.0 µm for one part at three places. It takes the eigenvectors for points of the axes, and rows for columns.
# Expected: 11.75 µm everywhere, as Fitzpatrick's formula (which it names) and 20,000 simulated alignments give.
. "$(dirname "$0")/setup.sh"
packages scikit-surgerycore==0.8.3 scipy==1.17.1 numpy==2.4.6
python <<'END'
import numpy as np
from sksurgerycore.algorithms.errors import compute_tre_from_fle

datums = np.array([[0.0, 0, 0], [200, 0, 0], [0, 60, 0], [180, 70, 20], [100, 20, 5]])
target = np.array([[400.0, 50, 30]])
u = 0.005  # mm, of each coordinate of a datum point


def formula(points, target):
    """Fitzpatrick, West and Maurer 1998, equation 46: squares of distances from the principal axes."""
    centre = points.mean(axis=0)
    axes = np.linalg.svd(points - centre)[2]
    of_points, of_target = ((p - centre) @ axes.T for p in (points, target[0]))
    distances = lambda p: np.sum(p**2, axis=-1, keepdims=True) - p**2
    return 3 * u**2 / len(points) * (1 + np.mean(distances(of_target) / distances(of_points).mean(axis=0)))


def simulated(points, target, n):
    rng = np.random.default_rng(1)
    centre = points.mean(axis=0)
    touched = points + rng.normal(0.0, u, (n, *points.shape))
    means = touched.mean(axis=1)
    left, _, right = np.linalg.svd(np.einsum("pi,npj->nij", points - centre, touched - means[:, None]))
    proper = np.ones((n, 3))
    proper[:, 2] = np.linalg.det(left @ right)
    rotation = np.einsum("nij,nj,njk->nik", left, proper, right)
    return np.mean(np.sum(((target[0] - centre) @ rotation + means - target[0]) ** 2, axis=1))


right = 1e3 * np.sqrt(formula(datums, target))
found = []
for shift in (np.zeros(3), -datums.mean(axis=0), np.array([500.0, 300, 100])):
    found.append(1e3 * np.sqrt(compute_tre_from_fle(datums + shift, 3 * u**2, target + shift)))
    print("zero moved by", -shift, "scikit-surgerycore", found[-1], "µm; formula", right, "µm")
    assert abs(1e3 * np.sqrt(formula(datums + shift, target + shift)) / right - 1.0) < 1e-9
many = 1e3 * np.sqrt(simulated(datums, target, 20_000))
print("20,000 alignments:", many, "µm")
assert abs(many / right - 1.0) < 0.02  # its own scatter is 0.4 %
assert np.allclose(found, [8.330, 11.762, 11.004], atol=0.01), "it gives something else now"
END
