#!/usr/bin/env bash
# Recordings that others measured: two in this tree (../data/SOURCE.md), one in the folder that WHIRL_DATA names.
set -euo pipefail
out=${1:-out/04_measured_data}
here=$(cd "$(dirname "$0")/../data" && pwd)
data=${WHIRL_DATA:-$(cd "$(dirname "$0")/../.." && pwd)/../shared/data}
mkdir -p "$out"
[[ -d "$data" ]] && data=$(cd "$data" && pwd)
cd "$out"

# One hammer impact on a laboratory specimen.
whirl frf "$here/hammer.csv.gz" --out hammer.json
whirl modes hammer.json --band-low-hz 20 --band-high-hz 3000

# Bently RK-4 kit: one row per revolution of a run-up through two critical speeds.
whirl transient "$here/rk4_runup.csv" --modes 2

if [[ ! -f "$data/silverbox/SNLS80mV.csv" ]]; then
  echo "SKIPPED: no Silverbox at $data (set WHIRL_DATA)"
  exit 0
fi

# Silverbox: input V1, output V2, 610.35 Hz. Train on the first part of the multisine, test on the rest.
silverbox=(--rate 610.3515625 --columns V1:u_V V2:y_V)
whirl identify "$data/silverbox/SNLS80mV.csv" --method second-order "${silverbox[@]}" --rows 40650:66726 --out silverbox.json
whirl validate silverbox.json "$data/silverbox/SNLS80mV.csv" "${silverbox[@]}" --rows 105712:127400
