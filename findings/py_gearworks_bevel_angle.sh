#!/bin/sh
# py-gearworks 0.0.24, cone_angle_from_teeth, pitch cones of two bevel gears whose axes are not at 90°: two equal gears at 60° have cones of 54.1° and 65.9°;
# of 20 and 40 teeth 45.5° and 74.5°. The sum is 180° less the angle of the axes, and the sines are not as the teeth, so it is neither that
# angle nor its supplement that it means. Two equal gears at 120° are nan. At 89° they are 0.4° from the right ones of 91°, 0.8° and 1.2° from those of 89°.
# Expected: sin γ2 / sin γ1 = z2 / z1 and γ1 + γ2 = Σ, so tan γ1 = sin Σ / (z2/z1 + cos Σ), as at 90°: 26.565° and 63.435°.
. "$(dirname "$0")/setup.sh"
packages py-gearworks==0.0.24 build123d==0.13.0 numpy==2.4.6 scipy==1.17.1
python <<'END'
import numpy as np
from py_gearworks import cone_angle_from_teeth

def right(first, second, axes):
    one = np.arctan2(np.sin(axes), second / first + np.cos(axes))
    assert np.isclose(np.sin(axes - one) / np.sin(one), second / first)
    return np.degrees([one, axes - one])

def seen(first, second, axes):
    return np.degrees(cone_angle_from_teeth(first, second, axes)) / 2

for first, second, degrees in ((20, 40, 90), (20, 40, 89), (20, 20, 60), (20, 40, 60)):
    axes = np.radians(degrees)
    print(
        f"{first} and {second} teeth at {degrees}°: {seen(first, second, axes).round(2)}°, right {right(first, second, axes).round(2)}°,"
        f" of the supplement {right(first, second, np.pi - axes).round(2)}°"
    )
assert np.allclose(seen(20, 40, np.pi / 2), right(20, 40, np.pi / 2))
for first, second, expected in ((20, 20, (54.095, 65.905)), (20, 40, (45.501, 74.499))):
    cones = seen(first, second, np.pi / 3)
    assert np.allclose(cones, expected, rtol=0, atol=1e-3)
    sines = np.sin(np.radians(cones))
    assert np.isclose(cones.sum(), 120) and abs(sines[1] / sines[0] / (second / first) - 1) > 0.1
with np.errstate(invalid="ignore"):
    assert np.isnan(seen(20, 20, 2 * np.pi / 3)).all()
END
