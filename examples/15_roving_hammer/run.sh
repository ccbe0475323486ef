#!/usr/bin/env bash
# A roving hammer: eight points, four blows each, three of them double hits. Modes and shapes.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
out=${1:-out/15_roving_hammer}
mkdir -p "$out" && cd "$out"

python3 "$here/beam.py" make .
for point in 1 2 3 4 5 6 7 8; do
  whirl frf p${point}_*.csv --reference "$point:+Z" --drop-double-hits --duration-s 1.3 --out frf_$point.json
done
whirl modes frf_?.json --band-low-hz 20 --band-high-hz 500 --out modes.json --figure shapes.svg
python3 "$here/beam.py" check .
