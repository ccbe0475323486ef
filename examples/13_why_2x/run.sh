#!/usr/bin/env bash
# Why is there vibration at 2X? Two motors on a supply of 50 Hz: the shaft of one is misaligned, the field of the other is uneven.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
out=${1:-out/13_why_2x}
mkdir -p "$out" && cd "$out"

python3 "$here/motor.py" make .
for motor in misaligned electric; do
  whirl info $motor.csv
  whirl info $motor.csv --json > $motor.json
done
whirl report misaligned.csv electric.csv --service-rpm 2958 --out why.html
python3 "$here/motor.py" check .
