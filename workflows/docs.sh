#!/usr/bin/env bash
# The site into build/docs; warnings are errors. Installs the extra `docs` first when it is missing. Arguments go to sphinx-build.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. workflows/env.sh
if ! python -c 'import furo, ipykernel, jupytext, myst_nb, sphinx' 2>/dev/null; then
  echo "== installing what builds the site (about a minute)" >&2
  mapfile -t extra < <(python - <<'PYTHON'
import tomllib

import numpy

# a petsc4py built against NumPy 1 cannot be loaded beside NumPy 2
print("numpy<2" if numpy.__version__ < "2" else "numpy")
print(*tomllib.load(open("pyproject.toml", "rb"))["project"]["optional-dependencies"]["docs"], sep="\n")
PYTHON
  )
  python -m pip --disable-pip-version-check -qq install "${extra[@]}"
fi
# -E: pages made from the code are read anew
sphinx-build -W --keep-going -q -E "$@" -b html python/docs build/docs
echo "open build/docs/index.html"
