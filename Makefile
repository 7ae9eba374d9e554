# graben: `make` or `make help` lists the targets. Chains of stages are in pipelines/*/*.mk.
SHELL := /bin/bash
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:

PYTHON ?= python3
VENV   := .venv
BIN    := $(VENV)/bin
READY  := $(VENV)/.ready
RESULTS ?= results
FIDELITY ?= standard
# The order of the tests and the tries of the fuzz: others each time.
SEED   := $(or $(SEED),$(shell date +%s))
# Runs that do not wait for one another go side by side.
TRIES  ?= 20000
SECONDS ?= 1500
JOBS   ?= $(shell nproc)
ifeq ($(MAKELEVEL),0)
MAKEFLAGS += -j$(JOBS)
endif

# make upscaling BUDGET="10 min": the finest fidelity at which the chain fits (make install first).
ifdef BUDGET
FIDELITY := $(shell $(BIN)/python pipelines/budget.py $(firstword $(MAKECMDGOALS)) "$(BUDGET)" --jobs $(JOBS))
ifeq ($(FIDELITY),)
$(error no fidelity for BUDGET)
endif
endif

include pipelines/upscaling/upscaling.mk
include pipelines/wear/wear.mk

.PHONY: help
help: ## list the targets
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sort | awk -F':.*## ' '{printf "  make %-14s %s\n", $$1, $$2}'

.PHONY: install
install: $(READY) ## make .venv with graben and everything it needs

$(READY): pyproject.toml constraints.txt
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "graben needs Python 3.11 or newer; set PYTHON=...")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[dev]'
	@touch $@

.PHONY: demo
demo: $(READY) ## both chains at draft fidelity, one table, pictures (under 10 minutes)
	@$(MAKE) --no-print-directory FIDELITY=draft upscaling wear
	@$(BIN)/python pipelines/summary.py table $(RESULTS)

.PHONY: test
test: $(READY) ## the tests in random order (under 12 minutes, compilation included); again: SEED=N
	@echo "order of the tests: make test SEED=$(SEED)"
	$(BIN)/python -m pytest -n 2 --dist loadfile -m "not verify" --randomly-seed=$(SEED)

.PHONY: matrix
matrix: $(READY) ## the tests in other orders, threads, Pythons, versions, beside a load (an hour; ROWS="lowest busy")
	$(BIN)/python tests/matrix.py $(ROWS)

.PHONY: fuzz
fuzz: $(READY) ## damaged inputs are read or refused (at most TRIES tries, SECONDS seconds); again: SEED=N
	$(BIN)/python -m tests.fuzz --tries $(TRIES) --seconds $(SECONDS) --seed $(SEED)

.PHONY: verify
verify: $(READY) ## the long verification against closed forms
	$(BIN)/python -m pytest -m verify

.PHONY: verify-udec
verify-udec: $(READY) ## 16 tessellations of voronoi-granite against UDEC's curves (16 CPU minutes)
	$(BIN)/python pipelines/upscaling/verify_udec.py $(RESULTS)/verify --picture docs/images/udec-band.png

.PHONY: verify-extrapolation
verify-extrapolation: $(READY) ## laws fitted up to 4 MPa against our blocks at 3 to 10 MPa (12 CPU minutes)
	$(BIN)/python pipelines/upscaling/verify_extrapolation.py $(RESULTS)/verify --picture docs/images/extrapolation.png

.PHONY: tradeoffs
tradeoffs: $(READY) ## what accuracy costs, every knob of every stage: docs/studies/tradeoffs.md (an hour; restartable)
	$(BIN)/python pipelines/tradeoffs/study.py $(RESULTS) --page docs/studies/tradeoffs.md

.PHONY: verify-promises
verify-promises: $(READY) ## each fidelity against the error that it promises (20 minutes; restartable)
	$(BIN)/python pipelines/tradeoffs/study.py $(RESULTS) --promises

.PHONY: bench
bench: $(READY) ## the benchmarks; JSON lines in results/bench/
	@mkdir -p $(RESULTS)/bench
	@for script in benchmarks/*.py; do echo "$$script"; \
	  $(BIN)/python $$script | tee -a $(RESULTS)/bench/$$(basename $$script .py).jsonl || exit 1; done

.PHONY: features
features: $(READY) ## what each optional feature costs in time and memory, on and off: a table
	@$(BIN)/python benchmarks/features.py --table

.PHONY: lint
lint: $(READY) ## ruff (lint and format) and mypy
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

.PHONY: clean
clean: ## remove results and caches (keeps .venv; compiled kernels: graben warm --forget)
	rm -rf $(RESULTS) build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis
	find graben tests benchmarks -name __pycache__ -type d -prune -exec rm -rf {} +
