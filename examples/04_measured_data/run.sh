#!/usr/bin/env bash
# Records that others measured. WHIRL_DATA names the folder that holds them (not part of this project).
set -euo pipefail
out=${1:-out/04_measured_data}
data=${WHIRL_DATA:-$(cd "$(dirname "$0")/../.." && pwd)/../shared/data}
if [[ ! -d "$data" ]]; then
  echo "SKIPPED: no measured data at $data (set WHIRL_DATA)"
  exit 0
fi
data=$(cd "$data" && pwd)
mkdir -p "$out" && cd "$out"

# Silverbox: input V1, output V2, 610.35 Hz. Train on the first part of the multisine, test on the rest.
silverbox=(--rate 610.3515625 --columns V1:u_V V2:y_V)
whirl identify "$data/silverbox/SNLS80mV.csv" --method second-order "${silverbox[@]}" --rows 40650:66726 --out silverbox.json
whirl validate silverbox.json "$data/silverbox/SNLS80mV.csv" "${silverbox[@]}" --rows 105712:127400

# Bently RK-4 kit: one row per revolution of a run-up through two critical speeds.
whirl transient "$data/rk4_runup/runup_bode_1037_2110rpm.csv" --modes 2
