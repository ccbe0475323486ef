#!/usr/bin/env bash
# Balancing a rotor of three planes from a table of runs: nine runs at two speeds and slow roll, one of them written down wrongly.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
out=${1:-out/09_balance}
mkdir -p "$out" && cd "$out"

# Phases are lags, amplitudes peak-to-peak, mass angles against the rotation; 24 holes of each plane, pieces of half a gram.
whirl balance "$here/runs.csv" --phase lag --amplitude pp --angles against --slow-roll-rpm 400 \
  --holes 24 --piece-gram 0.5 --html sheet.html --out balance.json

# The smallest largest reading instead, at most 6 g on a plane.
whirl balance "$here/runs.csv" --phase lag --amplitude pp --angles against --slow-roll-rpm 400 \
  --criterion min-max --limit-gram 6 --out minmax.json
