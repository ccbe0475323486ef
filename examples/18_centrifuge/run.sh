#!/usr/bin/env bash
# A laboratory centrifuge: limits over speed from its drawing, a spin-up that says which bucket is too heavy, a run-up plan.
set -euo pipefail
out=${1:-out/18_centrifuge}
mkdir -p "$out" && cd "$out"

# The drawing, with what is known of mounts and sensors.
whirl rotor new --template centrifuge --out centrifuge.toml
whirl rotor criticals centrifuge.toml --to-rpm 10000

# Limits of its sensors over speed.
whirl centrifuge limits centrifuge.toml --to-rpm 2000 --out limits.csv

# A spin-up with 6 g too much in bucket 2. It stands for the record of the machine in the laboratory.
sed -e 's/mass_gram = 10/mass_gram = 6/' -e 's/^radius_mm = 90$/radius_mm = 90\nangle_deg = 90/' centrifuge.toml |
  sed '/^\[centrifuge\]/,$d' > loaded.toml
whirl rotor run loaded.toml --from-rpm 40 --to-rpm 170 --seconds 60 --noise-db 30 --out spinup.csv
whirl centrifuge check centrifuge.toml spinup.csv

# The acceleration that each critical speed needs, and whether the drive has it.
whirl centrifuge runup centrifuge.toml --to-rpm 3000 --limit-um 150 --torque-nm 10
