#!/usr/bin/env bash
# An overhung rotor on springs, from its drawing and two run-ups to a controller: fit, design, the passages of its critical speeds, C.
set -euo pipefail
out=${1:-out/19_rotor_control}
mkdir -p "$out" && cd "$out"

# The machine in the laboratory, and a drawing of it: springs 20 % off, their damping by a factor of 2, unbalance not known.
whirl rotor new --template active-centrifuge --out machine.toml
sed -e 's/stiffness_N_m = 3e5/stiffness_N_m = 3.6e5/' -e 's/damping_Ns_m = 20/damping_Ns_m = 40/' \
  -e 's/^size_gmm = .*/size_gmm = 0/' machine.toml > drawing.toml
cat >> drawing.toml <<'EOF'

[fit]
supports = ["lower springs", "upper springs"]
axes_alike = true
material_damping = false
[fit.tolerance]
probe_gain_percent = 5
[[trial]]
run = "trial"
position_mm = 380
mass_gram = 1
radius_mm = 60
EOF

# Two run-ups, the second with a trial mass.
sed 's/^size_gmm = 60$/size_gmm = 120/' machine.toml > with_trial.toml
whirl rotor run machine.toml --from-rpm 300 --to-rpm 10000 --seconds 60 --noise-db 30 --out up.csv
whirl rotor run with_trial.toml --from-rpm 300 --to-rpm 10000 --seconds 60 --noise-db 30 --seed 2 --out trial.csv
whirl rotor fit drawing.toml up.csv trial.csv --out fitted.toml

# A controller of the fitted rotor, and what it does on the machine.
whirl rotor control fitted.toml --from-rpm 300 --to-rpm 10000 --out controller.json
whirl export c controller.json
whirl export fmu controller.json
whirl rotor run machine.toml --controller controller.json --from-rpm 300 --to-rpm 10000 --seconds 60 --out passage.csv
