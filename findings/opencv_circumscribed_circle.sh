#!/bin/sh
# OpenCV 5.0.0: minEnclosingCircle adds 1e-4 to the radius: two points 20 mm apart have the circumscribed radius 10.0001 mm.
# It takes float32 alone: points in float64 are refused, and after a rounding at 250 mm the centre is 15 nm off.
# Expected: 10.
. "$(dirname "$0")/setup.sh"
packages opencv-python-headless==5.0.0.93 numpy==2.4.6
python <<'END'
import cv2
import numpy as np

points = np.array([[0.0, 0.0], [20.0, 0.0], [10.0, 3.0]])
centre, radius = cv2.minEnclosingCircle(points.astype(np.float32))
print("centre", centre, "radius", radius)
assert centre == (10.0, 0.0) and abs(radius - 10.0001) < 1e-6, radius
try:
    cv2.minEnclosingCircle(points)
except cv2.error as error:
    print("float64:", type(error).__name__)
else:
    raise SystemExit("float64 is taken now")
END
