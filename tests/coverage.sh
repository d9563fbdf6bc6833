#!/usr/bin/env bash
# What the fast tests that run the core reach of it: at least 90 % of its lines and 80 % of its branches (those that only an
# exception takes are left out). Arguments go to pytest.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. workflows/env.sh
build=build/coverage
cmake --preset coverage -Dpybind11_DIR="$(python -m pybind11 --cmakedir)" -DPython_EXECUTABLE="$(command -v python)" >/dev/null
cmake --build --preset coverage
find "$build" -name '*.gcda' -delete
ctest --preset coverage

# the package, with the instrumented core in place of the installed one
mkdir -p "$build/python/warmslip"
ln -sfn "$PWD"/python/warmslip/* "$PWD/$build"/_core.*.so "$build/python/warmslip"
export PYTHONPATH=$PWD/tests/shadow:$PWD/$build/python
python -m pytest -q -p no:cacheprovider -m "not slow" tests/core tests/python/{mesh,model,io,simulation,studies,verification} "$@"

gcovr --root . --filter cpp/warmslip --exclude-throw-branches --exclude-unreachable-branches \
  -j 2 --sort uncovered-number --print-summary \
  --txt "$build/coverage.txt" --html-details "$build/coverage.html" --fail-under-line 90 --fail-under-branch 80 "$build"
