#!/usr/bin/env bash
# A controller designed from records alone, then run on the rig.
set -euo pipefail
out=${1:-out/03_design_and_run}
mkdir -p "$out" && cd "$out"

whirl rig record --added-mass-g 5 --snr-db 20 --out rundown.csv
whirl rig stiffness --out pull_x.csv
whirl identify rundown.csv --out model.json
whirl stiffness pull_x.csv --out stiffness.json

# The mass is K1 of the static stiffness test over K1/m of the run-down. 40 evaluations keep the example short; the default is 160.
whirl design model.json --stiffness stiffness.json --law tsmc --evaluations 40 --out controller.json
whirl run controller.json --added-mass-g 5 --log run.csv
