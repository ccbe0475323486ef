#!/usr/bin/env bash
# Installs a build tree into a prefix outside of it, builds a project that knows only find_package(whirl), and runs that on
# a record of the installed program. Usage: run.sh BUILD_DIR
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
build=$(cd "$1" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cmake --install "$build" --prefix "$work/prefix" >"$work/install.log"
cp "$here/CMakeLists.txt" "$here/main.cpp" "$work/"
cmake -S "$work" -B "$work/build" -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH="$work/prefix"
cmake --build "$work/build"
cd "$work"
"$work/prefix/bin/whirl" rig record --out rundown.csv
"$work/build/consumer" rundown.csv
test -s controller.json
PKG_CONFIG_PATH=$(dirname "$(find "$work/prefix" -name whirl.pc)") pkg-config --exists --print-errors whirl
