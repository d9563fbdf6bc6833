#!/usr/bin/env bash
# The wheel away from the checkout: built, installed into a fresh virtual environment and used from an empty folder.
set -Eeuo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
trap 'echo "== tests/wheel.sh failed at line $LINENO" >&2' ERR
bash workflows/setup.sh # the system packages, and the petsc4py and NumPy to agree with
. workflows/env.sh
work=$PWD/build/wheel
schema=$PWD/python/warmslip/scene.schema.json
rm -rf "$work"
mkdir -p "$work/empty"

echo "== building the wheel (five minutes of CPU)"
python -m pip --disable-pip-version-check -qq wheel --no-deps --config-settings=build-dir="$work/tree" -w "$work" .
wheel=$(echo "$work"/*.whl)

echo "== its files are those of python/warmslip and the extension"
diff <(python -m zipfile -l "$wheel" | awk 'NR > 1 {print $1}' | grep -v '\.dist-info/' | sed 's/_core\..*\.so$/_core.so/' | sort) \
  <({ git ls-files --cached --others --exclude-standard python/warmslip | sed 's,^python/,,' && echo warmslip/_core.so; } | sort)

echo "== installing it"
base=$(python -c 'import sys; print(sys._base_executable)')
site=()
"$base" -c 'import petsc4py.PETSc, mpi4py.MPI' 2>/dev/null && site=(--system-site-packages)
"$base" -m venv ${site[@]+"${site[@]}"} "$work/venv"
mapfile -t same < <(python -c '
import numpy, petsc4py
print(f"petsc4py=={petsc4py.__version__}")
print("numpy<2" if numpy.__version__ < "2" else "numpy")  # a petsc4py built against NumPy 1 cannot be loaded beside NumPy 2
')
"$work/venv/bin/python" -m pip --disable-pip-version-check -qq install "$wheel" "${same[@]}"

cd "$work/empty"
export PATH=$work/venv/bin:$PATH
unset PYTHONPATH
warmslip() { echo "== warmslip $*" >&2 && command warmslip "$@"; }
[[ $(python -c 'import warmslip; print(warmslip.__file__)') == "$work"/venv/* ]]
[[ $(warmslip --version) == "warmslip $(python -c 'import warmslip; print(warmslip.__version__)')" ]]
warmslip list >scenes.txt
grep -q paper_mixed scenes.txt
warmslip schema >schema.json
cmp schema.json "$schema"
warmslip explain plate_with_hole >explained.txt # a scene with a mesh file
warmslip run paper_mixed --set mesh.n=4 --set time.steps=4 --out run
warmslip view run --out view --no-animate
[[ -s view/report.html ]]
python - <<'PYTHON'
import json

from warmslip import _core

summary = json.load(open("run/summary.json"))
assert summary["outcome"] == next(iter(_core.Outcome.__members__)), summary["outcome"]
# the checkout around this folder is not where the package lies
assert summary["stamp"]["commit"] is None, summary["stamp"]
print(f"outcome: {summary['outcome']}")
PYTHON
