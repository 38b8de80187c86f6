PYTHON ?= python3
JOBS   ?= 2
BIN    := .venv/bin
PIP    := $(BIN)/python -m pip --disable-pip-version-check install --quiet --constraint constraints.txt

.PHONY: demo test test-slow test-other test-all warm warm-other lint \
        counts pictures bench bench-full campaign docs wheel clean

# Tests start a thousand processes, each of which would translate all modules anew where somebody's
# settings keep no bytecode; `make clean` removes it.
unexport PYTHONDONTWRITEBYTECODE

demo: .venv/installed
	$(BIN)/mbody demo

# The warm step builds every kernel once, so that the workers only load them. Each worker begins with
# half of the tests, so that what the tests of a file share is computed by one of them.
warm: .venv/installed-dev
	$(BIN)/mbody warmup

# What a change must pass: every subject with its numbers, without the tests marked as slow
# (docs/design/tests.md).
test: warm
	$(BIN)/python -m pytest -n $(JOBS) --dist worksteal -m "not slow"

# Some of the slow ones: `make test-slow PART=tests/image`.
test-slow: warm
	$(BIN)/python -m pytest -n $(JOBS) --dist worksteal -m slow $(PART)

# Files with tests that have a marker: others need not be loaded.
marked = $$(grep -rlE 'mark\.($(1))\b' tests validation --include='*.py')

# What another machine could change, all of it at once: the least versions that pyproject.toml
# declares, numba as the core with kernels without any special instruction, BLAS of an old
# processor. Tests of what rounding could sway, and of the compiler, without the slow ones; OTHER
# without a setting shows which of them a failure is due to.
MINIMUM := .venv-minimum/bin
OTHER   := MBODY_CORE=numba NUMBA_CPU_NAME=generic OPENBLAS_CORETYPE=Prescott
SWAYED   = -m "(processor or numba) and not slow" $(call marked,processor|numba)

# The first line builds some kernels ahead of time, as the least numba does.
warm-other: .venv-minimum/installed-dev
	$(MINIMUM)/mbody doctor
	env $(OTHER) $(MINIMUM)/mbody warmup

test-other: warm-other
	env $(OTHER) $(MINIMUM)/python -m pytest -n $(JOBS) --dist worksteal $(or $(PART),$(SWAYED))

# Everything, here and as on another machine: over an hour on two cores.
test-all: warm warm-other
	$(BIN)/python -m pytest -n $(JOBS) --dist worksteal
	env $(OTHER) $(MINIMUM)/python -m pytest -n $(JOBS) --dist worksteal

# The hunt for silent errors: hours on demand (COUNT of a SUBJECT: mechanisms, scenes, uneven,
# held or invariance); findings in the folder campaign/SUBJECT, where it goes on.
COUNT ?= 100000
SUBJECT ?= mechanisms
campaign: .venv/installed-dev
	$(BIN)/python -m tests.campaign $(SUBJECT) --count $(COUNT) --workers $(JOBS) \
		--to campaign/$(SUBJECT)

lint: .venv/installed-dev
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy

# The table of accepted work: steps, evaluations, factorisations, sizes of elimination.
counts: .venv/installed-dev
	$(BIN)/python -m tests.work_counts

# The pictures in docs/pictures: a film, a free-body diagram, the gallery.
pictures: .venv/installed-dev
	$(BIN)/python -m tests.pictures

# The site, docs/_build/html/index.html, without any network. Films of the gallery that are newer
# than their models are kept.
docs: .venv/installed-docs
	$(BIN)/mbody warmup
	$(BIN)/python -m sphinx -W --keep-going -b html docs docs/_build/html
	@echo "open docs/_build/html/index.html"

# Time to reach an error, beside the peers: a short form, and all of it with its page.
bench: .venv/installed-bench
	$(BIN)/python -m benchmarks --short

bench-full: .venv/installed-bench
	$(BIN)/python -m benchmarks --save --page

# Wheels in dist/: one with libraries for Linux on x86-64, and one without any; the core for
# browsers and the binaries of co-simulation units are in both.
LEVELS := x86-64-v3 x86-64-v2 x86-64-v4
UNITS := x86-64-v2 aarch64 windows macos
wheel: .venv/installed-dev
	$(PIP) --editable ".[wheel]"
	rm -rf mbody/core_libraries dist
	$(BIN)/mbody compile $(addprefix --target ,$(LEVELS) wasm32) -o mbody/core_libraries
	$(BIN)/mbody compile --fmu $(addprefix --target ,$(UNITS)) -o mbody/core_libraries
	MBODY_WHEEL=manylinux_2_17_x86_64 $(BIN)/python -m build --wheel
	$(BIN)/python -m build --wheel
	rm -rf mbody/core_libraries

clean:
	rm -rf .venv .venv-minimum dist docs/_build .pytest_cache .ruff_cache .mypy_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(BIN)/pip:
	$(PYTHON) -m venv .venv

.venv/installed: pyproject.toml constraints.txt | $(BIN)/pip
	$(PIP) --editable ".[jit]"
	touch $@

.venv/installed-dev: pyproject.toml constraints.txt | $(BIN)/pip
	$(PIP) --editable ".[dev]"
	touch $@ .venv/installed

.venv/installed-docs: pyproject.toml constraints.txt | $(BIN)/pip
	$(PIP) --editable ".[docs,jit]"
	touch $@ .venv/installed

.venv/installed-bench: pyproject.toml constraints.txt | $(BIN)/pip
	$(PIP) --editable ".[bench]"
	touch $@ .venv/installed

.venv-minimum/installed-dev: pyproject.toml constraints-minimum.txt
	test -d .venv-minimum || $(PYTHON) -m venv .venv-minimum
	$(MINIMUM)/python -m pip --disable-pip-version-check install --quiet \
	    --constraint constraints-minimum.txt --editable ".[dev]"
	touch $@
