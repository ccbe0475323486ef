#!/usr/bin/env bash
# The file of a European logger (semicolons, decimal commas, date stamps, German headings) to a report that is signed.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
out=${1:-out/16_logger_to_report}
mkdir -p "$out" && cd "$out"

python3 "$here/logger.py" make .

# What the file holds, and its columns under the names that whirl knows.
whirl info messung.csv
columns=("Weg X [µm]:x_um" "Weg Y [µm]:y_um" "Schwinggeschwindigkeit [mm/s]:DE_vel_mm_s" "Drehmarke [V]:key_V")
whirl info messung.csv --columns "${columns[@]}" --json > info.json
cat > pump.toml <<'END'
[machine]
name = "Pumpe 7"
service_rpm = 1488
iso_20816 = "2-rigid"
[measurement]
date = "26.11.2026"
analyst = "A. Weber"
END
whirl report messung.csv --columns "${columns[@]}" --about pump.toml --out report.html
python3 "$here/logger.py" check .
