#!/bin/sh
# The commands of docs/tutorials/stylus.md, one after the other. Type: sh run.sh
set -e
pretravel probes
pretravel probes omp40-2 > short.toml
pretravel probes omp40-2-100mm-carbide > carbide.toml
pretravel predict short.toml --azimuth 0:350:10 --polar 90
pretravel predict carbide.toml --azimuth 0:350:10 --polar 90
pretravel compare short.toml carbide.toml -o designs.csv --plot designs.png
pretravel studies
pretravel studies stylus-length > study.toml
pretravel wishes
pretravel wishes stylus-50mm > wish.toml
