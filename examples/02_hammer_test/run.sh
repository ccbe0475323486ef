#!/usr/bin/env bash
# Natural frequencies from hammer impacts, stiffness from a static stiffness test.
set -euo pipefail
out=${1:-out/02_hammer_test}
mkdir -p "$out" && cd "$out"

whirl rig hammer --out blow_
whirl frf blow_*.csv --pre-trigger-ms 40 --window-end-percent 1 --out frf.json
whirl modes frf.json --band-low-hz 5 --band-high-hz 400 --out modes.json

whirl rig stiffness --out pull_x.csv
whirl stiffness pull_x.csv --out stiffness.json
