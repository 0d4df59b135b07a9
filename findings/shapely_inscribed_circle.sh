#!/bin/sh
# shapely 2.2.0 (GEOS): maximum_inscribed_circle stops within a thousandth of the polygon by default: for a bore of 20 mm with
# lobes of 3 µm its radius is 1.6 µm too small, its centre 3 µm off. minimum_bounding_circle is a polygon of 32 sides that does
# not cover the points: its area is that of a radius 32 µm smaller.
# Expected: the inscribed and circumscribed circles, which a tolerance of 1e-6 and minimum_bounding_radius give.
. "$(dirname "$0")/setup.sh"
packages shapely==2.2.0 numpy==2.4.6
python <<'END'
import numpy as np
import shapely

angle = np.linspace(0.0, 2.0 * np.pi, 360, endpoint=False)
radius = 10.0 + 0.003 * np.cos(3.0 * angle)
bore = shapely.Polygon(np.c_[100.0 + radius * np.cos(angle), 50.0 + radius * np.sin(angle)])
default = shapely.maximum_inscribed_circle(bore)
fine = shapely.maximum_inscribed_circle(bore, tolerance=1e-6)
print("inscribed:", default.length, "at", default.coords[0], "fine:", fine.length)
assert 0.001 < fine.length - default.length < 0.01
assert abs(default.coords[0][0] - 100.0) > 0.002
around = shapely.minimum_bounding_circle(bore)
by_area = float(np.sqrt(around.area / np.pi))
print("circumscribed:", shapely.minimum_bounding_radius(bore), "by its area:", by_area)
assert abs(shapely.minimum_bounding_radius(bore) - 10.003) < 1e-6
assert 0.03 < 10.003 - by_area < 0.035 and not around.covers(bore)
END
