#!/usr/bin/env bash
# The portable program goes on as PREFIX/libexec/whirl/x86-64-v3/whirl: where that is there, and the processor can run it.
# Usage: faster_build.sh SOURCE_DIR
set -euo pipefail
[[ $(uname -m) == x86_64 ]] || { echo "SKIPPED: for x86-64"; exit 0; }
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p "$work/bin" "$work/libexec/whirl/x86-64-v3"
cat >"$work/main.cpp" <<'CPP'
#include <cstdio>

#include "processor.hpp"
int main(int, char** argv) {
  whirl::app::go_on_as_the_faster_build(argv);
  std::puts("portable");
}
CPP
g++ -std=c++20 -static -I"$1/apps/whirl" "$work/main.cpp" "$1/apps/whirl/processor.cpp" -o "$work/bin/whirl"
cp "$work/bin/whirl" "$work/bin/another"
expect() { # what it prints, command...
  local printed; printed=$("${@:2}")
  [[ $printed == "$1" ]] || { echo "${*:2}: printed '$printed' instead of '$1'"; exit 1; }
}
expect portable "$work/bin/whirl" info "a b.csv"
printf '#!/bin/sh\necho "faster: $# $2"\n' >"$work/libexec/whirl/x86-64-v3/whirl"
chmod +x "$work/libexec/whirl/x86-64-v3/whirl"
expect portable "$work/bin/another" info "a b.csv"
if grep -qw avx2 /proc/cpuinfo && grep -qw fma /proc/cpuinfo && grep -qw bmi2 /proc/cpuinfo; then
  expect "faster: 2 a b.csv" "$work/bin/whirl" info "a b.csv"
fi
if command -v qemu-x86_64 >/dev/null; then
  # /proc/self/exe is the program in QEMU too; a Nehalem of 2008 has no AVX2.
  expect portable qemu-x86_64 -cpu Nehalem "$work/bin/whirl" info "a b.csv"
fi
