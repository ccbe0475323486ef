#!/usr/bin/env bash
# From a run-down to a controller in single-precision C for a microcontroller that samples at 2 kHz, and what a step costs there.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
out=${1:-out/17_microcontroller}
rm -f "$out/cost.json"
mkdir -p "$out" && cd "$out"

# The rig and its data sheets, sampled at 2 kHz; a run-down of 5 s.
whirl rig parameters > default.toml
sed -e 's/^rate_hz = 1000.0/rate_hz = 2000.0/' -e 's/^ramp_s = .*/ramp_s = 5.0/' default.toml > rig.toml
python3 "$here/drive.py" make .
whirl rig record --rig rig.toml --added-mass-g 5 --out rundown.csv

whirl identify rundown.csv --out model.json --quiet
whirl design model.json --mass-kg 1.5 --hardware rig.toml --law pd --estimator kfe --evaluations 10 --out controller.json
whirl run controller.json --rig rig.toml --added-mass-g 5 --json > run.json

# C99 with its self-test; instructions of a step in an emulator where the tools for it are installed.
whirl export c controller.json --float --prefix drive --out drive
make -C drive check
if command -v arm-none-eabi-gcc > /dev/null && command -v qemu-system-arm > /dev/null; then
  whirl export c controller.json --float --target cortex-m4f --prefix drive --out drive_m4 --json > cost.json
else
  echo "SKIPPED the cost of a step: gcc-arm-none-eabi and qemu-system-arm are not installed"
fi
python3 "$here/drive.py" check .
