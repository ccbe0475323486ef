#!/bin/sh
# Fuzzing of every parser with libFuzzer under the address and undefined-behaviour sanitizers (clang, Debian: apt install clang).
# Usage: tools/fuzz.sh [MINUTES [BUILD_DIR [SEED]]]
#   MINUTES: of the whole, shared by all targets; 10 when not stated, 480 for a night. WHIRL_FUZZ_JOBS: targets at a time (2).
#   Limits of one input: 5 s, 1 GiB for at most 1 MiB. Corpora grow in BUILD_DIR/corpus; a failing input stays in BUILD_DIR.
# Prints runs, seed and result by target; exit code 1 when one failed. `tools/fuzz.sh pack [BUILD_DIR]` makes whirl-fuzz.tar.gz:
# programs, their libraries, the corpora and this script, to be run on a machine that has none of them.
set -e
here=$(cd "$(dirname "$0")/.." && pwd)
if [ "$1" = pack ]; then pack=1; minutes=10; else pack=; minutes=${1:-10}; fi
build=${2:-$here/build-fuzz}
seed=${3:-1}
if [ -f "$here/tests/fuzz/CMakeLists.txt" ] && [ ! -f "$here/packed" ]; then
  cmake -S "$here" -B "$build" -G Ninja -DCMAKE_CXX_COMPILER=clang++ -DCMAKE_C_COMPILER=clang -DWHIRL_FUZZ=ON -DWHIRL_TESTS=ON \
    -DWHIRL_PYTHON=OFF -DCMAKE_BUILD_TYPE=RelWithDebInfo -DCMAKE_CXX_FLAGS_RELWITHDEBINFO="-O1 -g1" \
    -DCMAKE_CXX_FLAGS="-fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=all" >/dev/null
  targets=$(cd "$here/tests/fuzz" && ls fuzz_*.cpp | sed 's/\.cpp$//')
  ninja -C "$build" $targets | tail -1
  corpora=$here/tests/fuzz/corpus
  run=
else # unpacked: programs, lib and corpus stand beside
  targets=$(cd "$here/bin" && ls fuzz_*)
  build=$here corpora=$here/seeds
  run="$here/lib/ld-linux-x86-64.so.2 --library-path $here/lib"
fi
if [ -n "$pack" ]; then
  to=$build/whirl-fuzz
  rm -rf "$to"
  mkdir -p "$to/bin" "$to/lib" "$to/tools"
  for t in $targets; do
    cp "$build/bin/$t" "$to/bin/"
    ldd "$build/bin/$t" | awk '/=> \//{print $3} /ld-linux/{print $1}' | xargs -I{} cp -Lu {} "$to/lib/"
  done
  cp -r "$corpora" "$to/seeds"
  cp "$0" "$to/tools/fuzz.sh"
  touch "$to/packed"
  tar -C "$build" -czf "$build/whirl-fuzz.tar.gz" whirl-fuzz
  echo "$build/whirl-fuzz.tar.gz: unpack, then whirl-fuzz/tools/fuzz.sh MINUTES"
  exit 0
fi
jobs=${WHIRL_FUZZ_JOBS:-2}
seconds=$((minutes * 60 * jobs / $(echo "$targets" | wc -l)))
cd "$build"
export ASAN_OPTIONS=allocator_may_return_null=1:detect_leaks=0
echo "$targets" | xargs -P "$jobs" -I{} sh -c '
  t=$1; mkdir -p corpus/${t#fuzz_}
  if nice $2 bin/$t -max_total_time=$3 -seed=$4 -timeout=5 -rss_limit_mb=1024 -max_len=65536 -print_final_stats=1 \
      -artifact_prefix=failed-$t- corpus/${t#fuzz_} $5/${t#fuzz_} >$t.log 2>&1; then r=clean; else r=FAILED; fi
  echo "$t $(sed -n "s/^stat::number_of_executed_units: *//p" $t.log) runs, seed $4, peak $(sed -n "s/^stat::peak_rss_mb: *//p" $t.log) MB: $r"
' sh {} "$run" "$seconds" "$seed" "$corpora" | tee results.txt
awk '{n += $2} END {printf "%d runs in all\n", n}' results.txt
! grep -q FAILED results.txt
