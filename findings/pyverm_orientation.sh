#!/bin/sh
# pyverm 0.3.0 (surveying: total stations, laser trackers): station_abriss and station_helmert take the plain mean of azimuth minus reading of the
# targets, without their full turns. Four targets around the station, exact readings: where the true orientation is 100 gon the station has 0, for
# 350 gon 50, a right angle off; each target that it surveys again is 20 m away from its place. With 10 gon it is right: there no reading passes zero.
# Expected: the orientation that the readings were made with.
. "$(dirname "$0")/setup.sh"
packages pyverm==0.3.0
python <<'END'
import math

import pyverm

STATION = (1000.0, 2000.0, 0.0)
TARGETS = [(1010.0, 2010.0), (1010.0, 1990.0), (990.0, 1990.0), (990.0, 2010.0)]

def observation(target, orientation):
    """Reading of the circle in gon, 0 to 400, and distance: y is the first coordinate, azimuths go from x to y."""
    away = (target[0] - STATION[0], target[1] - STATION[1])
    reading = (math.atan2(*away) * 200 / math.pi - orientation) % 400
    return pyverm.ObservationPolar(
        reduced_targetpoint=target, reduced_horizontal_angle=reading, reduced_distance=math.hypot(*away)
    )

for orientation, seen, off in ((10, 10, 0), (100, 0, 20), (350, 50, 20)):
    observations = [observation(target, orientation) for target in TARGETS]
    for station in (pyverm.station_abriss(STATION, observations), pyverm.station_helmert(observations)):
        surveyed = [station.survey(one) for one in observations]
        away = [math.dist(point[:2], target) for point, target in zip(surveyed, TARGETS)]
        print(f"orientation {orientation} gon: {station.orientation:.6g} gon, targets {min(away):.6g} to {max(away):.6g} m off")
        assert abs(station.orientation - seen) < 1e-9 and max(abs(distance - off) for distance in away) < 1e-9
END
