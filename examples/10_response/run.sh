#!/usr/bin/env bash
# Response of the identified rotor: every steady state over speed with its folds, then run-ups at two rates past them.
set -euo pipefail
out=${1:-out/10_response}
mkdir -p "$out" && cd "$out"

whirl rig record --added-mass-g 5 --snr-db 20 --out rundown.csv
whirl identify rundown.csv --out model.json --quiet

# Steady answers with the band of the model's covariance; dotted beyond what the record covered.
whirl response model.json --from-rpm 300 --to-rpm 1900 --data rundown.csv --out response.json --figure response.svg

# The same rotor with a third of the unbalance.
whirl response model.json --from-rpm 300 --to-rpm 1900 --unbalance 0.33 --data rundown.csv --figure response_small.svg

# How fast to run up so that the radius stays within 3 mm.
whirl runup model.json --from-rpm 300 --to-rpm 1900 --limit-mm 3 --out plan.json --figure runup.svg

# Slowly and fast through the critical speed, up and down.
whirl simulate model.json --from-rpm 300 --to-rpm 1900 --seconds 30 --out slow_up.csv
whirl simulate model.json --from-rpm 300 --to-rpm 1900 --seconds 3 --out fast_up.csv
whirl simulate model.json --from-rpm 1900 --to-rpm 300 --seconds 30 --out slow_down.csv

# Largest radius of slow sweeps over the unbalance: from where on does the rotor jump?
whirl response model.json --from-rpm 300 --to-rpm 1900 --peaks-to 1.5 --isolas --peak-figure peaks.svg
