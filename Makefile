# `make demo` and `make test` do everything on a fresh machine: they create .venv,
# install the pinned dependencies and run. Python 3.11 or newer and make are all it takes.

PYTHON ?= python3
JOBS ?= 2
OUT ?= out
# The EMPS benchmark, if it lies beside the checkout; the demo then identifies a real axis.
EMPS ?= ../shared/recordings/emps

VENV := .venv
BIN := $(VENV)/bin
INSTALL := -m pip --disable-pip-version-check --no-input install --quiet
PIP := $(BIN)/python $(INSTALL) -c constraints.txt
# Each file must have its hash in the lock; no source is built, since what builds it has no hash.
LOCKED := $(INSTALL) --require-hashes --no-deps --only-binary :all:
INPUTS := pyproject.toml constraints.txt
CODE := $(wildcard agents baselines benchmarks drill_env supply tests train.py)

# The stamps lie inside the environment, so that they vanish with it.
READY := $(VENV)/.ready
READY_DEV := $(VENV)/.ready-dev
READY_BENCH := $(VENV)/.ready-bench
# The tools that lock, list and audit have an environment of their own and stay out of what they list.
SUPPLY := $(VENV)/supply
READY_SUPPLY := $(SUPPLY)/.ready

export PATH := $(CURDIR)/$(BIN):$(PATH)
# No window and no display is needed anywhere.
export MPLBACKEND := Agg
export SDL_VIDEODRIVER := dummy
export SDL_AUDIODRIVER := dummy
export PYGAME_HIDE_SUPPORT_PROMPT := 1
export NO_MKDOCS_2_WARNING := 1

.DEFAULT_GOAL := help
# The closing lines of `make test` must be those of pytest, with -j too.
.NOTPARALLEL:
.PHONY: help demo test bench fuzz cluster proof lint type docs warm tests format setup setup-locked lock licences sbom audit clean

help:
	@echo "make demo    install, then run the main job; results in ./$(OUT)"
	@echo "make test    install, then check style and types, build the docs, run all tests"
	@echo "make bench   install the peers too, then measure beside them"
	@echo "make fuzz    hostile input, random rigs and environments, killed commands (hours; N= READERS=)"
	@echo "make cluster install Ray, polars and DuckDB too, then test on a Ray cluster of two nodes here"
	@echo "make proof   conceal effects, diagnose, score; coverage of intervals (hours; resumable)"
	@echo "make setup   install for development only (.venv)"
	@echo "make setup-locked   install from the lock, every file checked by its hash (LOCK=all: every extra)"
	@echo "make lock    make supply/*.lock anew from constraints.txt"
	@echo "make licences   write the table of docs/licences.md anew"
	@echo "make sbom    what is installed, as CycloneDX JSON in ./$(OUT)"
	@echo "make audit   known vulnerabilities of what is locked (needs PyPI's advisories)"
	@echo "make format lint type docs tests   one step each"
	@echo "make clean   remove everything that can be made again, .venv included"

demo: $(READY)
	$(BIN)/drill-env demo --out $(OUT) $(addprefix --recordings ,$(wildcard $(EMPS)))

# pytest comes last: its summary closes the output.
test: lint type docs tests

bench: $(READY_BENCH) warm
	$(BIN)/python -m benchmarks

# Inputs for each reader; READERS names some of them alone. Then random rigs with random effects:
# ranges as a machine's, and shapes of effects from all that a rig file may hold. Then random
# configurations of the environments, long commands that are killed, and odd places to run in.
N ?= 100000
FUZZ_RIGS ?= 10000
FUZZ_TRUTH ?= 300
FUZZ_ENVIRONMENTS ?= 500
FUZZ_KILLS ?= 50
FUZZ_SEED ?= 7

fuzz: $(READY_DEV) warm
	$(BIN)/python -m benchmarks.fuzz $(READERS) --inputs $(N) --seed $(FUZZ_SEED)
	$(BIN)/python -m benchmarks.fuzz.rigs --rigs $(FUZZ_RIGS) --seed $(FUZZ_SEED)
	$(BIN)/python -m benchmarks.fuzz.rigs --rigs $(FUZZ_RIGS) --seed $(FUZZ_SEED) --wide
	$(BIN)/python -m benchmarks.fuzz.truth --rigs $(FUZZ_TRUTH) --seed $(FUZZ_SEED)
	$(BIN)/python -m benchmarks.fuzz.truth --rigs $(FUZZ_TRUTH) --seed $(FUZZ_SEED) --effects
	$(BIN)/python -m benchmarks.fuzz.environments --n $(FUZZ_ENVIRONMENTS) --seed $(FUZZ_SEED)
	$(BIN)/python -m benchmarks.fuzz.killed --kills $(FUZZ_KILLS) --seed $(FUZZ_SEED)
	$(BIN)/python -m benchmarks.fuzz.places

cluster: $(READY_DEV) warm
	$(PIP) -e ".[dev,cluster,tables]"
	$(BIN)/python -m pytest -q tests/test_engine.py tests/test_cluster.py tests/test_fleet.py

# Seeds from a million on are the proof's: once a release, never while developing.
PROOF_SEED ?= 1000013
PROOF_CASES ?= --kinds single:200 --kinds null:100 --kinds pair:60 --kinds out:60 --kinds shape:20 \
  --kinds differ:100

proof: $(READY_DEV) warm
	$(BIN)/python -m benchmarks.concealed.make --seed $(PROOF_SEED) $(PROOF_CASES) \
	  --out $(OUT)/proof/cases --answers $(OUT)/proof/answers
	$(BIN)/python -m benchmarks.concealed.run --cases $(OUT)/proof/cases \
	  --out $(OUT)/proof/reports --jobs $(JOBS)
	$(BIN)/python -m benchmarks.concealed.oracle --cases $(OUT)/proof/cases \
	  --answers $(OUT)/proof/answers --out $(OUT)/proof/oracles --jobs $(JOBS)
	$(BIN)/python -m benchmarks.concealed.score --reports $(OUT)/proof/reports \
	  --answers $(OUT)/proof/answers --oracles $(OUT)/proof/oracles --out $(OUT)/proof/score
	$(BIN)/python -m benchmarks.identification_study --trials 100 --out $(OUT)/proof/coverage --jobs $(JOBS)

setup: $(READY_DEV)

# What each lock holds, the stamps then say is installed.
LOCK ?= core
STAMPS := $(READY) $(if $(filter all,$(LOCK)),$(READY_DEV) $(READY_BENCH))

setup-locked: | $(BIN)/python
	$(BIN)/python $(LOCKED) -r supply/$(LOCK).lock
	$(BIN)/python $(INSTALL) --no-deps --no-build-isolation -e .
	$(BIN)/python -m pip check
	@touch $(STAMPS)

# Python 3.11.5 is the least that the pinned versions allow. The core needs its build backend too.
COMPILE := $(SUPPLY)/bin/uv pip compile --quiet --universal --python-version 3.11.5 \
  --generate-hashes --no-header --no-annotate

lock: $(READY_SUPPLY)
	echo hatchling | $(COMPILE) -c constraints.txt pyproject.toml - -o supply/core.lock
	$(COMPILE) -c constraints.txt pyproject.toml --all-extras -o supply/all.lock
	$(COMPILE) supply/tools.in -o supply/tools.lock

licences: $(READY_BENCH)
	$(BIN)/python -m supply.licences docs/licences.md

sbom: $(READY) $(READY_SUPPLY)
	@mkdir -p $(OUT)
	$(SUPPLY)/bin/cyclonedx-py environment --pyproject pyproject.toml --mc-type library \
	  --output-reproducible --of JSON -o $(OUT)/sbom.json $(BIN)/python

# The lock names every file, so pip has nothing to find out and is left out.
audit: $(READY_SUPPLY)
	$(SUPPLY)/bin/python -m supply.audit $(OUT)/audit.json \
	  $(SUPPLY)/bin/pip-audit -r supply/all.lock --require-hashes --disable-pip --progress-spinner off

lint: $(READY_DEV)
	$(BIN)/ruff check $(CODE)
	$(BIN)/ruff format --check $(CODE)

format: $(READY_DEV)
	$(BIN)/ruff check --fix $(CODE)
	$(BIN)/ruff format $(CODE)

type: $(READY_DEV)
	$(BIN)/pyright

docs: $(READY_DEV)
	$(BIN)/mkdocs build --quiet --strict

# Fills numba's cache once; the parallel test processes would each compile on their own. The filter
# is compiled on another core meanwhile.
warm: $(READY)
	$(BIN)/python -c "import numpy as n, drill_env as d; \
	  from drill_env.recordings import Recording as R; \
	  from drill_env.identification import prediction_error as e, samples as s, noise as m; \
	  t = n.arange(0, 1, 0.01); r = s.prepare(R(t, t, t, t), d.Rig()); \
	  e.path_of(r, d.Rig(), m.NoiseModel(), r.starts)" & filter=$$!; \
	$(BIN)/python -c "import drill_env as d, drill_env.integrator as i; \
	  i.simulate(d.Rig(), 3.5, 1.0, sensitivity=True)" && \
	$(BIN)/python -c "import drill_env as d, drill_env.integrator as i; \
	  i.simulate(d.Rig(effects=({'id': 'unbalance', 'torque': 0.01, 'phase': 0.0},)), 3.5, 1.0)" && wait $$filter

tests: $(READY_DEV) warm
	$(BIN)/python -m pytest -q -n $(JOBS)

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and \
	  "drill-env needs Python 3.11 or newer; name one: make PYTHON=python3.11")'
	$(PYTHON) -m venv $(VENV)

$(READY): $(INPUTS) | $(BIN)/python
	$(PIP) -e .
	@touch $@

$(READY_DEV): $(INPUTS) | $(BIN)/python
	$(PIP) -e ".[dev]"
	@touch $(READY) $@

$(READY_BENCH): $(INPUTS) $(READY_DEV)
	$(PIP) -e ".[dev,bench]"
	@touch $@

$(READY_SUPPLY): supply/tools.lock | $(BIN)/python
	$(PYTHON) -m venv $(SUPPLY)
	$(SUPPLY)/bin/python $(LOCKED) -r $<
	@touch $@

clean:
	rm -rf $(VENV) build dist site $(OUT) .pytest_cache .ruff_cache .hypothesis
	find $(CODE) -name __pycache__ -type d -prune -exec rm -rf {} +
