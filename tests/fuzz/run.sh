#!/usr/bin/env bash
# Random bytes through the readers of files, with the compiled core under the address and undefined behaviour sanitizers and
# coverage of Python and C++ alike as the guide: run.sh [SECONDS [READER...]]. Needs clang; Atheris is fetched into build/fuzz.
# A defect ends the run and leaves its input in build/fuzz/found. Inputs that reach something new are kept in
# build/fuzz/corpus between runs; run.sh --merge takes the least of them that reach every branch into tests/fuzz/corpus.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
merge=
if [[ ${1:-} == --merge ]]; then merge=1; shift; fi
seconds=${1:-600}
shift || true
readers=("$@")
((${#readers[@]})) || readers=(scene formula mesh lists checkpoint trajectory)
command -v clang++ >/dev/null || { echo "the fuzzer needs clang++: apt-get install clang" >&2; exit 1; }

build=build/fuzz
[[ -d $build/atheris ]] || python -m pip install -qq --disable-pip-version-check --target "$build/atheris" 'atheris==3.*'
cmake --preset fuzz -Dpybind11_DIR="$(python -m pybind11 --cmakedir)" -DPython_EXECUTABLE="$(command -v python)" >/dev/null
cmake --build --preset fuzz
mkdir -p "$build/python/warmslip" "$build/found"
ln -sfn "$PWD"/python/warmslip/* "$PWD/$build"/_core.*.so "$build/python/warmslip"
export PYTHONPATH=$PWD/tests/shadow:$PWD/$build/python:$PWD/$build/atheris:$PWD/tests/fuzz

for reader in "${readers[@]}"; do
  corpus=tests/fuzz/corpus/$reader kept=$build/corpus/$reader dictionary=tests/fuzz/$reader.dict
  mkdir -p "$kept"
  options=(-timeout=10 -rss_limit_mb=3000 -max_len=8192 "-artifact_prefix=$build/found/$reader-" -print_final_stats=1)
  [[ -f $dictionary ]] && options+=("-dict=$dictionary")
  if [[ $merge ]]; then
    options+=(-set_cover_merge=1 -use_counters=0 "$corpus" "$kept")
  else
    options+=("-max_total_time=$((seconds / ${#readers[@]}))" "$kept" "$corpus")
  fi
  # leaks: Python and MPI hold what they have to the end
  ASAN_OPTIONS=detect_leaks=0 UBSAN_OPTIONS=print_stacktrace=1:halt_on_error=1 \
    LD_PRELOAD=$(readlink -f "$build/atheris/asan_with_fuzzer.so") \
    tests/fuzz/fuzz.py "--reader=$reader" "${options[@]}" >"$build/$reader.log" 2>&1 ||
    { grep -av 'NEW\|REDUCE\|Instrumenting' "$build/$reader.log" | tail -n 40 >&2; exit 1; }
  printf '%-11s %s\n' "$reader" "$(grep -ao 'Done .*\|MERGE-OUTER: .* new files.*' "$build/$reader.log" | tail -n 1)"
done
