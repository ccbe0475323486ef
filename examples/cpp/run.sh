#!/usr/bin/env bash
# The C++ examples on records of the simulated rig, built by CMakeLists.txt beside this file.
set -euo pipefail
out=${1:-out/cpp}
hammer=$(cd "$(dirname "$0")/../data" && pwd)/hammer.csv.gz
mkdir -p "$out" && cd "$out"

whirl rig record --added-mass-g 5 --snr-db 20 --out rundown.csv
whirl rig record --added-mass-g 5 --run-up --seed 2 --snr-db 20 --out runup.csv

example_hammer_modes "$hammer" | tee modes.txt
grep -q "^695.74 Hz" modes.txt
example_check_record rundown.csv
example_identify_and_validate rundown.csv runup.csv
example_design_and_run model.json
example_own_system
