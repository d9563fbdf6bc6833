#!/usr/bin/env bash
# Makes this checkout ready to use: system packages, a virtual environment in .venv, the compiled package.
# Five to ten minutes the first time, most of it compiling; about a second after that. Safe to repeat.
#
# With PETSC_DIR set (a cluster's module, conda, an own build) no system package is touched, PYTHON (default: python3) is
# the interpreter and petsc4py is compiled against that PETSc, which takes another two minutes.
set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
venv=$root/.venv
log() { printf '== %s\n' "$*" >&2; }

system=(g++ cmake ninja-build pkg-config libpetsc-real-dev libsuitesparse-dev libeigen3-dev doctest-dev
        libopenblas0-pthread openmpi-bin python3-dev python3-venv python3-petsc4py python3-mpi4py git)
python=${PYTHON:-}
if [[ -z ${PETSC_DIR:-} ]] && command -v apt-get >/dev/null; then
  missing=()
  for p in "${system[@]}"; do
    [[ $(dpkg-query -W -f '${db:Status-Status}' "$p" 2>/dev/null) == installed ]] || missing+=("$p")
  done
  if ((${#missing[@]})); then
    as_root=()
    if ((EUID)); then
      command -v sudo >/dev/null || { echo "ask an administrator for: apt-get install ${missing[*]}" >&2; exit 1; }
      as_root=(sudo)
    fi
    log "installing system packages (about a minute): ${missing[*]}"
    "${as_root[@]}" apt-get update -qq
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends \
      -o DPkg::Lock::Timeout=600 "${missing[@]}" >/dev/null
  fi
  python=${python:-/usr/bin/python3} # the interpreter Debian's petsc4py is for, whatever PATH has
fi
python=${python:-python3}
pip() { "$venv/bin/python" -m pip --disable-pip-version-check -qq "$@"; }

# the environment is made anew when the interpreter, PETSc or this script changes
base="$("$python" -c 'import sys; print(sys.executable, *sys.version_info[:3])') ${PETSC_DIR:-system} ${PETSC_ARCH:-}"
base="$base $(sha256sum <"${BASH_SOURCE[0]}" | cut -c1-16)"
if [[ $(cat "$venv/.base" 2>/dev/null) != "$base" ]]; then
  log "making the virtual environment .venv (about ten seconds)"
  # the system's packages only where they hold the petsc4py to use
  site=()
  "$python" -c 'import petsc4py.PETSc, mpi4py.MPI' 2>/dev/null && site=(--system-site-packages)
  "$python" -m venv --clear ${site[@]+"${site[@]}"} "$venv"
  pip install setuptools wheel 'scikit-build-core>=1.0' 'pybind11>=2.13' ninja
  if [[ ! -v site[0] ]]; then
    log "compiling petsc4py for this PETSc (about two minutes)"
    version=$(PKG_CONFIG_PATH=${PETSC_DIR:-}/${PETSC_ARCH:-}/lib/pkgconfig:${PETSC_DIR:-}/lib/pkgconfig:${PKG_CONFIG_PATH:-} \
              bash -c 'pkg-config --modversion PETSc || pkg-config --modversion petsc')
    : "${PETSC_DIR:=$(pkg-config --variable=prefix PETSc)}"; export PETSC_DIR
    pip install 'setuptools<81' numpy 'cython>=3' mpi4py
    # not from pip's cache: its key leaves out the PETSc and NumPy a wheel was built for
    CFLAGS=${CFLAGS:--O1 -g0} pip install --no-cache-dir --no-build-isolation "petsc4py==${version%.*}.*"
  fi
  echo "$base" >"$venv/.base"
fi

# the package is installed anew when its metadata changes; its C++ is rebuilt at import when a source changes
stamp=$( (cat "$root/pyproject.toml" && grep '^project(' "$root/CMakeLists.txt") | sha256sum)
if [[ $(cat "$venv/.stamp" 2>/dev/null) != "$stamp" ]]; then
  log "compiling warmslip and installing what it needs (about five minutes of CPU, no output until it is done)"
  # a petsc4py built against NumPy 1 cannot be loaded beside NumPy 2
  old=$("$venv/bin/python" -c 'import numpy; print("numpy<2" if numpy.__version__ < "2" else "numpy")')
  pip install --no-build-isolation --config-settings=editable.rebuild=true -e "$root[test,workflow]" "$old"
  echo "$stamp" >"$venv/.stamp"
fi
