#!/usr/bin/env bash
# Runs README's first result and the commands of its "Five minutes" in an empty folder, as a reader would, and compares the
# modes that README prints. Usage: readme.sh README.md FOLDER
set -euo pipefail
readme=$(realpath "$1")
rm -rf "$2" && mkdir -p "$2" && cd "$2"
commands=$(awk '/^## /{inside = ($0 == "## Five minutes")} inside && /^    whirl /' "$readme" | sed 's/  *#.*//')
[[ $(wc -l <<<"$commands") -ge 9 ]] || { echo "README shows too few commands" >&2; exit 1; }

first=$(awk '/^## Five minutes/{exit} /^    whirl (frf|modes) /' "$readme" | sed "s#examples/#$(dirname "$readme")/examples/#")
[[ $(wc -l <<<"$first") -eq 2 ]] || { echo "README's first result is not whirl frf and whirl modes" >&2; exit 1; }
while read -r command; do
  echo "+ $command"
  # shellcheck disable=SC2086
  $command </dev/null | tee last.txt
done <<<"$first"
# The mode lines of README and of the program: number, frequency, damping and their deviations.
modes() { awk '$1 ~ /^[0-9]+$/ && $2 ~ /^[0-9.]+$/ && NF >= 5 { print $1, $2, $3, $4, $5 }'; }
diff <(awk '/^## Five minutes/{exit} /^    /' "$readme" | modes) <(modes <last.txt) || {
  echo "README's first result is not what the program prints" >&2; exit 1; }
while read -r command; do
  echo "+ $command"
  # shellcheck disable=SC2086 # the words of a command line
  $command </dev/null
done <<<"$commands"
[[ -s report.html ]]
