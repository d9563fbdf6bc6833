#!/usr/bin/env bash
# Reproduces the paper: sets the checkout up, says what will run and for how long, runs the workflow.
# Arguments go to snakemake.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
about="every figure and verdict of the paper, into results/"
duration="not measured yet" # on two cores; write here what was measured

bash workflows/setup.sh
. workflows/env.sh
python -c 'import warmslip._core' # compiles what changed, once and not in every job

echo "== $about; time: $duration"
snakemake --cores all --dry-run --quiet rules "$@"
exec snakemake --cores all "$@"
