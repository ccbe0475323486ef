#!/bin/sh
# Every fault at every write of every command that writes a file: the table of docs/reliability.md.
# Usage: tools/fault_table.sh BUILD_DIR
set -e
WHIRL_FAULTS=all exec "${1:?the build folder}/bin/whirl_cli_test" --gtest_filter='OutputE2e.*'
