SHELL := /bin/bash
VENV := .venv
PY := $(VENV)/bin/python
PYTHON ?= python3.11
STAMP := $(VENV)/.setup-done
CONSTRAINTS := constraints.txt

.DEFAULT_GOAL := help
.PHONY: help setup demo test lint bench docs

help:  ## List the tasks
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z]+):.*## /  make \1\t/' | expand -t 16

setup: $(STAMP)  ## Make .venv with torch, torch-scatter and this package (once)

$(STAMP): pyproject.toml $(CONSTRAINTS)
	@$(PYTHON) -c 'import sys; assert sys.version_info >= (3, 11), "Python 3.11 or newer is needed: make PYTHON=/path/to/python3.11"'
	@echo "[1/4] virtual environment in $(VENV)"
	@test -x $(PY) || $(PYTHON) -m venv $(VENV)
	@echo "[2/4] torch, pinned in $(CONSTRAINTS) (about a minute)"
	@$(PY) -m pip install -q -c $(CONSTRAINTS) torch "setuptools>=77" wheel ninja
	@echo "[3/4] torch-scatter, built from source the first time (4 to 8 minutes on 2 cores)"
	@printf '[build_ext]\nparallel=2\n' > $(VENV)/dist.cfg
	@start=$$SECONDS; DIST_EXTRA_CONFIG=$(CURDIR)/$(VENV)/dist.cfg CFLAGS=-g0 MAX_JOBS=2 \
	  $(PY) -m pip install -q -c $(CONSTRAINTS) --no-build-isolation "torch-scatter>=2.1.2" && \
	  echo "      torch-scatter took $$((SECONDS - start)) s"
	@echo "[4/4] dnf-pyg, editable, with its test extra"
	@$(PY) -m pip install -q -c $(CONSTRAINTS) -e ".[test]"
	@touch $@
	@echo "ready: $(VENV)/bin/dnf-pyg --help"

test: $(STAMP)  ## Run the whole test suite
	@$(PY) -m pytest

lint: $(STAMP)  ## Check style and types (ruff, mypy)
	@$(VENV)/bin/ruff check . && $(VENV)/bin/ruff format --check . && $(VENV)/bin/mypy

bench: $(STAMP)  ## Print the speed and memory tables (minutes; a quiet machine)
	@for script in tests/bench/bench_*.py; do $(PY) $$script || exit 1; done

docs: $(STAMP)  ## Build the documentation into site/html (warnings are errors)
	@$(PY) -c "import furo, latex2mathml, myst_nb" 2>/dev/null || $(PY) -m pip install -q -c $(CONSTRAINTS) -e ".[docs]"
	@$(PY) -m sphinx -q -W --keep-going docs site/html
	@echo "ready: site/html/index.html"

DNF := $(VENV)/bin/dnf-pyg
DEMO := runs/demo

demo: $(STAMP)  ## Train on generated meshes, test, and denoise one that training has not seen
	@rm -rf $(DEMO) && mkdir -p $(DEMO)
	$(DNF) make-shape bracket -o $(DEMO)/clean.ply --seed 1000
	$(DNF) add-noise $(DEMO)/clean.ply -o $(DEMO)/noisy.ply --level 0.2
	$(DNF) fit -c configs/demo.yaml
	$(DNF) test -c configs/demo.yaml --ckpt_path $(DEMO)/best.ckpt
	$(DNF) denoise $(DEMO)/noisy.ply -o $(DEMO)/denoised.ply --weights $(DEMO)/best.ckpt \
	  --reference $(DEMO)/clean.ply --picture $(DEMO)/demo.png
