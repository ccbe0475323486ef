#!/usr/bin/env bash
# A rotor with two critical speeds: from one run-up to its motion at both with 10 % more unbalance. The rotor of the drawing is
# fitted: `identify` is for one critical speed.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
out=${1:-out/14_two_criticals}
mkdir -p "$out" && cd "$out"

# The drawing: bearings are guesses, the unbalance is unknown, only where it may be is known.
whirl rotor new --template two-disc --out drawing.toml
cat >> drawing.toml <<'TOML'

[[unbalance]]
position_mm = 1000
size_gmm = 0

[fit]
material_damping = false

[fit.tolerance]
probe_gain_percent = 2
TOML

# The machine in the hall, as it is and with 10 % more unbalance.
machine() {
  sed -e 's/stiffness_x_N_m = 1e6/stiffness_x_N_m = 1.2e6/' -e 's/damping_Ns_m = 100$/damping_Ns_m = 200/' \
    -e "s/size_gmm = 100$/size_gmm = $1/" -e "s/size_gmm = 0$/size_gmm = $2/" drawing.toml
}
machine 100 70 > machine.toml
machine 110 77 > heavier.toml
whirl rotor run machine.toml --from-rpm 200 --to-rpm 3500 --seconds 30 --rate-hz 500 --out clean.csv
python3 "$here/machine.py" make .

# Bearings and unbalance from the run-up; then the fitted rotor with 10 % more unbalance.
whirl rotor fit drawing.toml up.csv --out fitted.toml
awk '/^size_gmm/ {$3 *= 1.1} {print}' fitted.toml > more.toml
whirl rotor response more.toml --from-rpm 200 --to-rpm 3500 --points 2000 --out foretold.csv
for rotor in machine heavier; do
  whirl rotor response $rotor.toml --from-rpm 200 --to-rpm 3500 --points 2000 --out $rotor.csv > $rotor.txt
done
python3 "$here/machine.py" check .
