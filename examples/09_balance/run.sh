#!/usr/bin/env bash
# Balancing a rotor of three planes from a table of runs: nine runs at two speeds and slow roll, one of them written down wrongly.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
out=${1:-out/09_balance}
mkdir -p "$out" && cd "$out"

# Phases are lags, amplitudes peak-to-peak, mass angles against the rotation; 24 holes of each plane, pieces of half a gram.
whirl balance "$here/runs.csv" --phase lag --amplitude pp --angles against --slow-roll-rpm 400 \
  --holes 24 --piece-gram 0.5 --page sheet.html --out balance.json

# The same with the residual unbalance of each plane against G 2.5 and what the bench may get wrong.
whirl balance "$here/runs.csv" --phase lag --amplitude pp --angles against --slow-roll-rpm 400 --drop-dependent \
  --mass-kg 400 --radius-mm 150 --grade 2.5 --mass-error-gram 0.05 --angle-error-deg 2 --page budget.html

# The smallest largest reading instead, at most 6 g on a plane.
whirl balance "$here/runs.csv" --phase lag --amplitude pp --angles against --slow-roll-rpm 400 \
  --criterion min-max --limit-gram 6 --out minmax.json

# A year later, the same machine: the earlier job's influence coefficients, a little changed, and one run as found.
head -4 "$here/runs.csv" > again.csv
whirl balance again.csv --phase lag --amplitude pp --angles against --slow-roll-rpm 400 --prior balance.json \
  --prior-common 0.1 --prior-each 0.03 --noise-um 0.4 --page again.html

# Led through a job from the first run on: the program says the next run, the readings are typed in.
rm -f fan.toml
whirl balance --session fan.toml --planes A,B --probes DE,NDE --speeds-rpm 1500 --phase lag --amplitude pp \
  --angles against --trial-gram 10 --target-um 8 --probe-deg 45,45
whirl balance --session fan.toml --readings "48.43@7.2 46.28@60.2"
whirl balance --session fan.toml --readings "72.53@29.1 41.84@45.1"
whirl balance --session fan.toml --readings "50.45@359.0 64.57@54.7" --masses "0 7.606@322.2"
whirl balance --session fan.toml --readings "1.27@146.3 3.45@268.3" --masses "11.69@114.5 23.52@169.1" --page fan.html
