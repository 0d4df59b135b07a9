#!/bin/sh
# The commands of docs/tutorials/first-qualification.md, one after the other. Type: sh run.sh
set -e
pretravel convert touches.csv
pretravel qualify touches.csv --diameter 24.9987 --tip-diameter 6 --u-diameter 0.1 -o map.json --plot map.png
pretravel compensate part.csv --map map.json -o points.csv
pretravel compare map.json --part part.csv
pretravel convert shop.csv
