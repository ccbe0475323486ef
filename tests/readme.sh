#!/usr/bin/env bash
# Runs the commands of README's "Five minutes" in an empty folder, as a reader would. Usage: readme.sh README.md FOLDER
set -euo pipefail
readme=$(realpath "$1")
rm -rf "$2" && mkdir -p "$2" && cd "$2"
commands=$(awk '/^## /{inside = ($0 == "## Five minutes")} inside && /^    whirl /' "$readme" | sed 's/  *#.*//')
[[ $(wc -l <<<"$commands") -ge 9 ]] || { echo "README shows too few commands" >&2; exit 1; }
while read -r command; do
  echo "+ $command"
  # shellcheck disable=SC2086 # the words of a command line
  $command </dev/null
done <<<"$commands"
[[ -s report.html ]]
