#!/usr/bin/env bash
# From a controller to a running machine, over the wires of a real one: the rig is a process of its own that speaks the lasers'
# protocol on pseudo-terminals. Lockstep makes the result independent of the speed of this machine; leave it out for real time.
set -euo pipefail
out=${1:-out/08_realtime}
mkdir -p "$out" && cd "$out"
rm -f io.toml run.h5

whirl rig record --added-mass-g 5 --snr-db 20 --out rundown.csv
whirl identify rundown.csv --out model.json
whirl design model.json --mass-kg 1.5 --law tsmc --evaluations 20 --out controller.json

# A short run-down through the critical speed.
cat > rig.toml <<'TOML'
[profile]
start_rpm = 1200
ramp_s = 3
dwell_end_s = 0.5
[rotor]
added_mass_g = 5
TOML
whirl rig serve --rig rig.toml --lockstep --io io.toml > served.txt &
trap 'kill $! 2>/dev/null || true' EXIT
until [ -e io.toml ]; do sleep 0.1; done

# Are the channels fit for control, and how long is the loop? On a real rig begin with a small force.
whirl io test --io io.toml --seconds 1 --excite-N 0.2 || echo "see above; on a busy machine its own clock is the first to fail"

# The loop itself; every cycle is recorded, also when the program is killed.
whirl run controller.json --io io.toml --record run.h5
wait $!
trap - EXIT
cat served.txt

# The recording through the same controller: the forces are the recorded ones. Through another estimator: what would it do?
whirl replay run.h5 --out replay.csv
whirl replay run.h5 --estimator eso
