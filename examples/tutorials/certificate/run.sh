#!/bin/sh
# The commands of docs/tutorials/certificate.md, one after the other. Type: sh run.sh
set -e
pretravel rig rig -o rig.csv --plot rig.png
pretravel rig rig --budget budget.csv -o rig.json
pretravel laboratory > lab.toml
pretravel rig rig --budget budget.csv --lab lab.toml -o certificate.html
