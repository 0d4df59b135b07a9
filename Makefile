# make help lists the targets. Two commands do all the set-up: make demo, make check.
.DEFAULT_GOAL := help
PYTHON ?= python3
BIN := .venv/bin
STAMP := .venv/.installed
CORE := .venv/.core
# Test workers share the cores; threads of the linear algebra would fight over them. By file: what
# the tests of a file share is made once.
# One more than there are cores: some tests wait for programs, for a machine or for a page.
WORKERS := $(shell expr $$(nproc 2>/dev/null || echo 1) + 1)
SINGLE := OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1
# Bytecode is kept: without it each worker and each command that a test starts compiles everything.
TESTS := $(SINGLE) PYTHONDONTWRITEBYTECODE= $(BIN)/pytest -n $(WORKERS) --dist loadfile \
	--no-loadscope-reorder --durations=10
# On a bare installation, on a real LinuxCNC, in a real browser, of the site and its pages, with damaged files, of benchmarks,
# and against published numbers.
SYSTEM := tests/core tests/machine tests/browser tests/docs tests/hard tests/benchmarks tests/validation
# What libraries do for us: files, tables, pictures, settings, shapes, maps.
OLDEST := $(addprefix tests/unit/,files tasks cli show maps surface \
	design/test_run.py design/test_plan.py design/test_outputs.py design/test_workers.py design/test_sensitivity.py)
# Rounding differs between the kernels of OpenBLAS, which follow the processor: results must not.
NUMERICAL := tests/laws $(addprefix tests/unit/,qualification six_seats maps measurement laboratory \
	design/test_probe_from_map.py design/test_measured_forces.py design/test_orientation.py)

.PHONY: help venv demo check check-system check-all kernels linuxcnc linuxcnc-if-possible browser-if-possible format lint types contracts test docs docs-gallery hard mutation release-check oldest benchmark lock licences sbom clean

help:  ## list the targets
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 14

venv: $(STAMP)  ## create .venv with everything

$(CORE): pyproject.toml requirements-dev.lock tools/make_venv.sh
	PYTHON="$(PYTHON)" sh tools/make_venv.sh
	@touch $(CORE)

$(STAMP): $(CORE)
	@echo "installing all extras and the tools of development (a minute or two)"
	$(BIN)/pip install --quiet --disable-pip-version-check --requirement requirements-dev.lock
	@touch $(STAMP)

demo: $(CORE)  ## run the main job on the example data and say where to look
	$(BIN)/pretravel demo --output demo-output

# What reads the code alone runs beside the tests, on one core; what it says comes after them.
check: $(STAMP)  ## everything that must pass before a commit, but check-system
	@mkdir -p .mypy_cache; $(MAKE) --no-print-directory --keep-going lint contracts types \
		>.mypy_cache/output 2>&1 & read=$$!; \
	$(MAKE) --no-print-directory test; tests=$$?; \
	wait $$read; read=$$?; cat .mypy_cache/output; [ $$tests = 0 ] && [ $$read = 0 ]

check-system: linuxcnc-if-possible browser-if-possible $(STAMP)  ## the tests of a bare installation, on LinuxCNC, in a browser, of the site, with damaged files, against published numbers, and the longer ones
	$(TESTS) -m "not slow" $(SYSTEM) || { \
		echo "What failed runs once more: a control or a browser can starve on a busy computer."; \
		$(TESTS) -m "not slow" --last-failed --last-failed-no-failures none $(SYSTEM); }
	$(TESTS) -m "long and not slow" tests/unit tests/laws

check-all: linuxcnc-if-possible browser-if-possible lint types contracts $(STAMP)  ## all tests with the slow ones, kernels, benchmarks, single faults in the code, and the built package
	$(TESTS) -m "slow or not slow"
	$(MAKE) --no-print-directory kernels
	$(BIN)/python -m benchmarks.run --print
	$(SINGLE) $(BIN)/python -m tests.mutation.run --named --number 5
	$(MAKE) --no-print-directory release-check

kernels: $(STAMP)  ## the numerical tests as on this processor, on one with AVX2 and on one without
	for kernel in "" Haswell Prescott; do \
		OPENBLAS_CORETYPE=$$kernel $(TESTS) -m "not slow" $(NUMERICAL) || exit 1; done

format: $(STAMP)  ## put the code in order
	$(BIN)/ruff check --fix-only --quiet .
	$(BIN)/ruff format .

lint: $(STAMP)
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/codespell docs README.md CONTRIBUTING.md CHANGELOG.md src
	$(BIN)/python tools/prose.py docs README.md CONTRIBUTING.md CHANGELOG.md src

types: $(STAMP)
	$(BIN)/mypy

contracts: $(STAMP)
	$(BIN)/lint-imports

test: $(STAMP)  ## the tests and doctests
	$(TESTS) -m "not slow and not long" $(SYSTEM:%=--ignore=%)

docs: $(STAMP)  ## build the site of the documentation into docs/_build/site; a warning is an error
	$(SINGLE) $(BIN)/sphinx-build --quiet --fresh-env --fail-on-warning --keep-going --nitpicky docs docs/_build/site
	@echo "open docs/_build/site/index.html"

docs-gallery: $(STAMP)  ## run the scripts of the gallery: pictures, and the numbers that they assert (minutes)
	for script in docs/gallery/plot_*.py; do $(BIN)/python $$script || exit 1; done

linuxcnc: $(STAMP)  ## install LinuxCNC (Debian), and do all of docs/how-to/linuxcnc.md on it
	examples/linuxcnc/install
	rm -rf linuxcnc-demo
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python examples/linuxcnc/follow_guide linuxcnc-demo
	@echo "look at linuxcnc-demo: points.csv, points.png, map.png, compare.png, verify.png"

linuxcnc-if-possible:
	@examples/linuxcnc/install || echo "LinuxCNC cannot be installed here: tests on the real control are NOT run"

browser-if-possible:
	@tools/install_browser || echo "Chromium cannot be installed here: tests in a browser are NOT run"

hard: $(STAMP)  ## 100,000 mutated files for each reader, interrupted commands: hours
	$(SINGLE) $(BIN)/python -m tests.hard.run --processes $$(nproc)
	$(SINGLE) $(BIN)/python -m tests.hard.interrupted_writes
	$(SINGLE) $(BIN)/python -m tests.hard.nonsensical_options

mutation: $(STAMP)  ## single faults in the code, which the tests must notice: docs/reliability.md
	$(SINGLE) $(BIN)/python -m tests.mutation.run --named --number 30

release-check: $(STAMP)  ## build sdist and wheel, install them into bare environments, try them; RELEASE=FOLDER keeps them
	$(BIN)/pip install --quiet uv
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python tools/check_release.py $(RELEASE)

oldest: $(STAMP)  ## tests with the oldest versions of the libraries that pyproject.toml allows
	$(BIN)/pip install --quiet uv
	$(BIN)/uv venv --quiet --clear --python $(BIN)/python .venv-oldest
	$(BIN)/uv pip install --quiet --python .venv-oldest --resolution lowest-direct ".[all]"
	$(BIN)/uv pip install --quiet --python .venv-oldest pytest pytest-xdist hypothesis GTC
	$(SINGLE) .venv-oldest/bin/python -m pytest -q -W default -m "not slow" $(OLDEST)

benchmark: $(STAMP)  ## ratios against alternatives, and growth: docs/benchmarks.md (about an hour)
	$(BIN)/python -m benchmarks.run

lock: $(STAMP)  ## renew requirements-dev.lock from pyproject.toml
	$(BIN)/pip install --quiet uv
	$(BIN)/uv pip compile --quiet --universal --group dev --all-extras --no-emit-index-url --no-annotate \
		--no-header --upgrade pyproject.toml -o requirements-dev.lock
	$(BIN)/uv pip compile --quiet --universal --group dev --all-extras --no-emit-index-url --no-annotate \
		--no-header --constraint requirements-dev.lock --format pylock.toml pyproject.toml -o pylock.toml

licences: $(STAMP)  ## the table of docs/licences.md, from the libraries in .venv
	$(BIN)/python tools/licences.py

sbom: $(STAMP)  ## sbom.json: all libraries of an installation with their versions
	$(BIN)/python tools/licences.py --sbom sbom.json

clean:  ## remove what make made
	rm -rf .venv .venv-oldest docs/_build demo-output linuxcnc-demo .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
