SHELL := /bin/bash
VENV := .venv
PY := $(VENV)/bin/python
DNF := $(VENV)/bin/dnf-pyg
PYTHON ?= $(firstword $(shell command -v python3.11 python3.12 python3.13 python3) python3)
SETUP := $(VENV)/.setup-done
SCATTER := $(VENV)/.scatter-done
CONSTRAINTS := constraints.txt
PIP := $(PY) -m pip install -q -c $(CONSTRAINTS)

.DEFAULT_GOAL := help
.PHONY: help setup setup-scatter demo demo-train test lint bench docs

help:  ## List the tasks
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## /  make \1\t/' | expand -t 24

setup: $(SETUP)  ## Make .venv with torch and this package (once; about a minute after the downloads)

$(SETUP): pyproject.toml $(CONSTRAINTS)
	@$(PYTHON) -c 'import sys; assert sys.version_info >= (3, 11), "Python 3.11 or newer is needed: make PYTHON=/path/to/python3.11"'
	@echo "[1/3] virtual environment in $(VENV)"
	@test -x $(PY) || $(PYTHON) -m venv $(VENV)
	@echo "[2/3] torch, pinned in $(CONSTRAINTS)"
	@$(PIP) torch
	@echo "[3/3] dnf-pyg, editable"
	@$(PIP) -e .
	@touch $@
	@echo "ready: $(DNF) --help"

setup-scatter: $(SCATTER)  ## Add what training and the tests need, with torch-scatter built from source (once)

$(SCATTER): $(SETUP)
	@echo "[1/2] torch-scatter, built from source the first time (4 to 8 minutes on 2 cores)"
	@$(PIP) "setuptools>=77" wheel ninja
	@printf '[build_ext]\nparallel=2\n' > $(VENV)/dist.cfg
	@start=$$SECONDS; DIST_EXTRA_CONFIG=$(CURDIR)/$(VENV)/dist.cfg CFLAGS=-g0 MAX_JOBS=2 \
	  $(PIP) --no-build-isolation "torch-scatter>=2.1.2" && \
	  echo "      torch-scatter took $$((SECONDS - start)) s"
	@echo "[2/2] dnf-pyg with its train and test extras"
	@$(PIP) -e ".[train,test]"
	@touch $@

demo: $(SETUP)  ## Denoise a part and a scan with the packaged weights; pictures and pages in runs/demo (a minute)
	@rm -rf runs/demo
	$(DNF) demo -o runs/demo

test: $(SCATTER)  ## Run the whole test suite, a process for each core
	@$(PY) -m pytest -n auto --maxprocesses 8 --dist loadfile

lint: $(SCATTER)  ## Check style and types (ruff, mypy)
	@$(VENV)/bin/ruff check . && $(VENV)/bin/ruff format --check . && $(VENV)/bin/mypy

bench: $(SCATTER)  ## Print the speed and memory tables (minutes; a quiet machine)
	@for script in tests/bench/bench_*.py; do $(PY) $$script || exit 1; done

docs: $(SCATTER)  ## Build the documentation into site/html (warnings are errors)
	@$(PY) -c "import furo, latex2mathml, myst_nb" 2>/dev/null || $(PIP) -e ".[docs]"
	@$(PY) -m sphinx -q -W --keep-going docs site/html
	@echo "ready: site/html/index.html"

TRAINED := runs/demo-train

demo-train: $(SCATTER)  ## Train on generated meshes, test, and denoise one that training has not seen (minutes)
	@rm -rf $(TRAINED) && mkdir -p $(TRAINED)
	$(DNF) make-shape bracket -o $(TRAINED)/clean.ply --seed 1000
	$(DNF) add-noise $(TRAINED)/clean.ply -o $(TRAINED)/noisy.ply --level 0.2
	$(DNF) fit -c configs/demo.yaml
	$(DNF) test -c configs/demo.yaml --ckpt_path $(TRAINED)/best.ckpt
	$(DNF) denoise $(TRAINED)/noisy.ply -o $(TRAINED)/denoised.ply --weights $(TRAINED)/best.ckpt \
	  --reference $(TRAINED)/clean.ply --picture $(TRAINED)/demo.png
