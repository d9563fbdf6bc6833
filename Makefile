# The commands of the project; `make help` lists them.
.DEFAULT_GOAL := help
SHELL := bash
.PHONY: help setup reproduce test verify trade coverage asan fused fuzz bench mutants lint docs extremes envelope wheel
ARGS ?=
env := . workflows/env.sh &&

help:  ## list these commands
	@sed -n 's/^\([a-z]*\):.*## /  make \1\t/p' $(MAKEFILE_LIST) | expand -t 20

setup:  ## system packages, .venv and the compiled package (five to ten minutes once, most of it compiling, then a second)
	@bash workflows/setup.sh

reproduce:  ## every figure and verdict of the paper into results/ (ARGS go to snakemake)
	@bash workflows/run.sh $(ARGS)

test:  ## all C++ and Python tests (ARGS go to pytest)
	@bash tests/run.sh $(ARGS)

verify: setup  ## every proof of the numbers into results/verification (ARGS go to snakemake)
	@$(env) snakemake -s workflows/verify/Snakefile --quiet host reason $(ARGS)

trade: setup  ## what accuracy costs: every method against an independent reference, into results/tradeoff (ARGS go to snakemake)
	@$(env) snakemake -s workflows/trade/Snakefile --quiet host reason $(ARGS)

coverage: setup  ## lines and branches of the C++ core that the fast tests reach (ARGS go to pytest)
	@bash tests/coverage.sh $(ARGS)

asan: setup  ## the C++ tests under the address and undefined behaviour sanitizers
	@$(env) cmake --preset asan >/dev/null && cmake --build --preset asan && ctest --preset asan

fused: setup  ## the answers of a build with -O3, wide vectors and fused multiply-add against those of the release build, to 1e-12
	@$(env) cmake --preset fused >/dev/null && cmake --build --preset fused && ctest --preset fused

fuzz: setup  ## random bytes through every reader of files, under the sanitizers for ten minutes (ARGS: seconds, readers)
	@$(env) bash tests/fuzz/run.sh $(ARGS)

bench: setup  ## the benchmarks alone (ARGS go to pytest)
	@$(env) python -m pytest -o addopts="--import-mode=importlib" --benchmark-only $(ARGS) tests/benchmarks

mutants: setup  ## seeded faults against the tests: which check kills which (ARGS: names, --handful N, --every, --out FILE)
	@$(env) python tests/mutants/run.py $(ARGS)

extremes: setup  ## scenes all over the space of data, each judged in 80 digits (ARGS: --families, --count N, --jobs N, --seed N, --scene laws:50)
	@$(env) python tests/campaign/run.py $(ARGS)

envelope: setup  ## how far each datum of five scenes can be moved (ARGS: --scenes, --axes, --jobs N)
	@$(env) python tests/campaign/envelope.py $(ARGS)

docs: setup  ## the site into build/docs: tutorial, how-to, reference, theory, examples that are run (ARGS go to sphinx-build)
	@bash workflows/docs.sh $(ARGS)

wheel:  ## the wheel built, installed into a fresh environment and used from an empty folder (five minutes of CPU)
	@bash tests/wheel.sh

lint: setup  ## format, style, types, layers, spelling, and files that services read
	@$(env) ruff check . && ruff format --check . && mypy && lint-imports
	@$(env) snakefmt --check Snakefile workflows
	@$(env) git ls-files -z ':!results' ':!tests/fuzz/corpus' | xargs -0 codespell
	@$(env) check() { check-jsonschema --builtin-schema "vendor.$$1" "$${@:2}"; } && \
	  check github-workflows .github/workflows/*.yml && check dependabot .github/dependabot.yml && \
	  check github-issue-forms .github/ISSUE_TEMPLATE/[^c]*.yml && check github-issue-config .github/ISSUE_TEMPLATE/config.yml && \
	  check readthedocs .readthedocs.yaml && check citation-file-format CITATION.cff
	@if command -v clang-format >/dev/null; then \
	  git ls-files '*.cpp' '*.hpp' | xargs -r clang-format --dry-run --Werror; \
	else echo "clang-format is not installed: C++ format not checked"; fi
	@if command -v clang-tidy >/dev/null; then \
	  $(env) cmake --preset tidy >/dev/null && cmake --build --preset tidy; \
	else echo "clang-tidy is not installed: C++ not analysed"; fi
