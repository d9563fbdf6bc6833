#!/usr/bin/env bash
# Reproduces the paper: sets the checkout up, says what will run and for how long, runs the workflow.
# Arguments go to snakemake, as in `bash workflows/run.sh --configfile workflows/config/ci.yaml`.
# What is already there and up to date is not made again. Ends non-zero when a job or the verdict failed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
duration="9 to 15 minutes on two cores" # measured: 9.6 and 14.8

bash workflows/setup.sh
. workflows/env.sh

config=workflows/config/paper.yaml
for ((i = 1; i < $#; i++)); do
  if [[ ${!i} == --configfile ]]; then j=$((i + 1)) && config=${!j}; fi
done
folder() { sed -n "s/^  $1: *//p" "$config"; }
paper=$(folder paper)

noise='^Select jobs\|^Execute \|^\[\|^Using \|^Assuming \|^Building \|^Rules claiming \|^$'
quietly() { snakemake "$@" 2>&1 | sed -u "/$noise/d"; }

plan=$(quietly --dry-run --quiet rules "$@") || { echo "$plan" >&2 && exit 1; }
status=0
if grep -q '^total ' <<<"$plan"; then
  echo "== the figures, tables and verdict of $config; the full grid takes: $duration"
  echo "== progress is also in $(folder runs)/logs; stopping and starting again keeps what is done"
  quietly --quiet reason host "$@" || status=$?
else
  echo "== everything of $config is up to date"
fi
echo "== look at $paper/report.html, the figures in $paper/figures, the verdict in $paper/verdict.json"
((status == 0)) || echo "== not everything is right: a job failed, or the verdict did" >&2
exit "$status"
