#!/usr/bin/env bash
# The site into build/docs; warnings are errors, and so are pages that need the network. Installs the extra `docs` and Doxygen first when they are missing. Arguments go to sphinx-build.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
. workflows/env.sh
if ! command -v doxygen >/dev/null; then
  echo "== installing Doxygen (half a minute)" >&2
  as_root=()
  ((EUID)) && as_root=(sudo)
  "${as_root[@]}" apt-get update -qq
  "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends doxygen >/dev/null
fi
if ! python -c "import breathe, furo, importlib, ipykernel, jupytext, myst_nb, sphinx; importlib.import_module('sphinx-mathjax-offline')" 2>/dev/null; then
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
python workflows/remote.py build/docs
echo "open build/docs/index.html"
