#!/usr/bin/env bash
# All tests: the C++ ones on one and two processes (ctest), then the Python ones. Arguments go to pytest.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
bash workflows/setup.sh
. workflows/env.sh
cmake --preset release >/dev/null
cmake --build --preset release
ctest --preset release
python -m pytest "$@"
