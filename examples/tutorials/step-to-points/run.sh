#!/bin/sh
# The commands of docs/tutorials/step-to-points.md, one after the other. Type: sh run.sh
set -e
pretravel faces part.step --plot faces.png
pretravel plan part.step --spacing 8 -o plan.csv --plot plan.png
pretravel qualify touches.csv --diameter 24.9987 --tip-diameter 6 --u-diameter 0.1 -o map.json
pretravel simulate map.json --surface part.step --targets plan.csv --noise 0.3 --seed 1 -o part.csv
pretravel compensate part.csv --map map.json --nominal part.step -o points.csv --plot points.png
