#!/usr/bin/env bash
# A fan in two planes; in one of its six runs a probe was connected the wrong way round. Masses, and which run is wrong.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
out=${1:-out/12_two_plane_fan}
mkdir -p "$out" && cd "$out"

python3 "$here/fan.py" make .
whirl balance runs.csv --phase lag --amplitude pp --angles with --page sheet.html --out balance.json
python3 "$here/fan.py" check .
