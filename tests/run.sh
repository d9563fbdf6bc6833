#!/usr/bin/env bash
# All tests: the C++ ones on one and two processes (ctest), then the Python ones, those that start MPI after the others and
# one at a time. Arguments go to pytest, which then runs what they ask for, one test at a time.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
bash workflows/setup.sh
. workflows/env.sh
cmake --preset release >/dev/null
cmake --build --preset release
ctest --preset release
(($#)) && exec python -m pytest "$@"
status=0
python -m pytest --numprocesses auto --maxprocesses 8 --dist loadfile -m "not mpi" || status=1
python -m pytest -m mpi || status=1
exit "$status"
