#!/bin/sh
# The commands of docs/tutorials/part-and-drawing.md, one after the other. Type: sh run.sh
set -e
pretravel qualify sphere_touches.csv --diameter 24.9987 --tip-diameter 6 --u-diameter 0.1 -o map.json
pretravel align touches.csv --part bracket.step --map map.json -o deviations.html --points points.csv
pretravel measure points.csv --drawing drawing.toml --part bracket.step --u-machine 1 -o tolerances.html
