#!/usr/bin/env bash
# A rotor with four degrees of freedom: its whirl frequencies over speed, then a controller that knows two of them.
set -euo pipefail
rig=$(cd "$(dirname "$0")" && pwd)/rig.toml
out=${1:-out/07_gyroscopic}
mkdir -p "$out" && cd "$out"

whirl rig campbell --rig "$rig" --out campbell.csv
whirl rig record --rig "$rig" --out rundown.csv
whirl rig stiffness --rig "$rig" --out pull_x.csv
whirl identify rundown.csv --out model.json
whirl stiffness pull_x.csv --out stiffness.json

# The identified model whirls in the plane; the controller designed from it is run on the rotor that tilts.
whirl design model.json --stiffness stiffness.json --hardware "$rig" --law pd --estimator kfe --evaluations 40 --out controller.json
whirl run controller.json --rig "$rig" --log run.csv
