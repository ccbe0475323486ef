#!/usr/bin/env bash
# A designed controller leaves whirl: C99 with its self-test, an FMU, a Python module; the identified rotor as FMU and equations.
set -euo pipefail
out=${1:-out/06_export}
mkdir -p "$out" && cd "$out"

whirl rig record --added-mass-g 5 --snr-db 20 --out rundown.csv
whirl identify rundown.csv --out model.json
whirl design model.json --mass-kg 1.5 --law tsmc --evaluations 20 --out controller.json

# One .c/.h pair for a microcontroller; --float for single precision.
whirl export c controller.json --prefix drive --out drive
make -C drive check

# The same controller, and the rotor as its plant, for Simulink, OpenModelica, Dymola and other FMI tools.
whirl export fmu controller.json --prefix drive --fmi 2 --out .
whirl export fmu model.json --prefix rotor --mass-kg 1.5 --fmi 3 --out .

whirl export python model.json --prefix rotor --out python
whirl export latex model.json --prefix rotor --out .
cat rotor.tex
