#!/usr/bin/env bash
# Equations of motion from one run-down, checked on a run-up that was not used.
set -euo pipefail
out=${1:-out/01_identify}
mkdir -p "$out" && cd "$out"

# The simulated rig replaces the laboratory: displacement of the disk by two lasers, angle by an encoder, 5 g screw in the disk.
whirl rig record --added-mass-g 5 --snr-db 20 --out rundown.csv
whirl rig record --added-mass-g 5 --run-up --seed 2 --snr-db 20 --out runup.csv
whirl info rundown.csv

whirl identify rundown.csv --out model.json
whirl validate model.json runup.csv --out validation.json
