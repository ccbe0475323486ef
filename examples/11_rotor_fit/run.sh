#!/usr/bin/env bash
# A flexible rotor from its drawing and two run-ups: bearings, unbalance and the motion where no probe is.
set -euo pipefail
out=${1:-out/11_rotor_fit}
mkdir -p "$out" && cd "$out"

# The drawing. Bearings are guesses; the unbalance is unknown, only where it may be is known.
whirl rotor new --template two-disc --out drawing.toml
cat >> drawing.toml <<'TOML'

[[unbalance]]
position_mm = 1000
size_gmm = 0

[fit]
material_damping = false

[fit.tolerance]
probe_gain_percent = 5

[[trial]]
run = "trial"
position_mm = 1000
mass_gram = 2
radius_mm = 40
angle_deg = 90
TOML

# The machine: other bearings, and unbalance at both discs. It represents the one in the hall.
sed -e 's/stiffness_x_N_m = 1e6/stiffness_x_N_m = 1.3e6/' -e 's/damping_Ns_m = 100/damping_Ns_m = 180/' \
  -e 's/size_gmm = 0/size_gmm = 60/' drawing.toml > machine.toml
cp machine.toml with_trial.toml
printf '\n[[unbalance]]\nposition_mm = 1000\nsize_gmm = 80\nangle_deg = 90\n' >> with_trial.toml
whirl rotor run machine.toml --from-rpm 200 --to-rpm 3500 --seconds 40 --out up.csv
whirl rotor run with_trial.toml --from-rpm 200 --to-rpm 3500 --seconds 40 --out trial.csv

# Fit, motion at the right disc and forces of the bearings, each with its interval.
whirl rotor fit drawing.toml up.csv trial.csv --at-mm 1000 --motion motion.csv --out fitted.toml

# The fitted rotor is a rotor file like any other.
whirl rotor criticals fitted.toml --to-rpm 4000
whirl rotor response fitted.toml --to-rpm 3500 --figure response.svg
