#!/bin/sh
# helmert-transform 1.3.0, five control points of an 80 m site, known without error, heights within 0.7 m: where the drawing is turned by 120° to 230°
# against north, the fit ends at a scale of −0.99995 with `success` True, and the scale multiplies the heights: a point 5 m above the control points is
# placed 5 m below them. The residuals (0.46 m) are those of the heights; in plan all is right. From −90° to 100° everything is right.
# Expected: a similarity has a positive scale; each turned drawing is the same site.
. "$(dirname "$0")/setup.sh"
packages helmert-transform==1.3.0 numpy==2.4.6 scipy==1.17.1
python <<'END'
import numpy as np
from helmert.core import compute_helmert_parameters, local_cartesian_to_geodetic

origin = 11.0, 46.0, 300.0
site = np.array([[0, 0, 0.0], [80, 5, 0.4], [75, 60, -0.3], [-5, 50, 0.2], [40, 30, 0.1]])
geodetic = [local_cartesian_to_geodetic(*point, *origin) for point in site]
above = np.array([30.0, 20.0, 5.0])
for angle in (-90, -60, 0, 30, 60, 90, 100, 120, 150, 180, 210, 230):
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    turned = lambda points: points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + [1000, 500, 100]
    fit = compute_helmert_parameters(geodetic, [tuple(point) for point in turned(site)], verbose=False)
    off = np.array(fit["transform"](*local_cartesian_to_geodetic(*above, *origin))) - turned(above)
    scale = fit["parameters"]["scale"]
    print(f"{angle:4d}°: scale {scale:.5f}, off {off.round(3)} m, rms {fit['statistics']['rmse']:.4f} m, success {fit['success']}")
    assert fit["success"] and np.hypot(*off[:2]) < 1e-3
    mirrored = 120 <= angle <= 230
    assert abs(scale - (-1 if mirrored else 1)) < 1e-4
    assert abs(off[2] - (-9.84 if mirrored else 0)) < 0.01
END
