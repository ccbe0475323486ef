#!/usr/bin/env bash
# From kinetic and potential energy to equations, candidate terms and ties; and back from a fit to physical parameters.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
out=${1:-out/05_derive}
mkdir -p "$out" && cd "$out"

for system in duffing pendulum two_mass gyroscopic paper_eq5 paper_eq24; do
  whirl derive "$here/$system.toml" --out "library_$system.toml"
  whirl derive "$here/$system.toml" --latex > "$system.tex"
done

# A rotor whose bearings are not equal: its record gives K1, the anisotropy, C and m e once the mass is weighed.
whirl rig record --added-mass-g 5 --out rundown.csv
whirl identify rundown.csv --out model.json
whirl derive "$here/anisotropic.toml" --out library.toml --model model.json
