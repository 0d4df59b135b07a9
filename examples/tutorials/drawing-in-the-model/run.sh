#!/bin/sh
# The commands of docs/tutorials/drawing-in-the-model.md, one after the other. Type: sh run.sh
set -e
pretravel qualify sphere_touches.csv --diameter 24.9987 --tip-diameter 6 --u-diameter 0.1 -o map.json
pretravel drawing bracket.step -o drawing.toml
pretravel align touches.csv --part bracket.step --map map.json --points points.csv
pretravel measure points.csv --drawing drawing.toml --part bracket.step --u-machine 1 -o tolerances.html || [ $? -eq 3 ]
