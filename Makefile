# Each target sets up all it needs in a local virtual environment: Python ≥ 3.11 with venv, and pip, are enough.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
EXTRAS ?= dev,fem,optimise,explore,docs
STAMP := $(VENV)/.installed-$(EXTRAS)
# one thread for each BLAS call: the parallel work is done by gearbench's own threads and by pytest's workers
export OPENBLAS_NUM_THREADS ?= 1
export MPLBACKEND ?= agg
# faults alone: neither what it loads nor advice about itself
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check --root-user-action=ignore

.PHONY: demo test test-all lint bench studies docs docs-tables clean system-libraries browser

demo: $(STAMP)
	@$(BIN)/python -m examples.demo out/demo

test: $(STAMP) system-libraries
	$(BIN)/python -m pytest -m "not slow" -n 2 --dist loadfile

test-all: $(STAMP) system-libraries browser
	$(BIN)/python -m pytest -n 2 --dist loadfile

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright

bench: $(STAMP)
	$(BIN)/python -m pytest benchmarks --benchmark-only -o addopts="" -q

studies: $(STAMP) system-libraries
	$(BIN)/python -m studies run all

# The pages of docs/ into out/site: warnings are errors, nothing comes from the network.
docs: $(STAMP)
	$(BIN)/python -m sphinx -b html -W --keep-going -q -d out/doctrees docs out/site
	@echo "open out/site/index.html"

# Pages that are made from the code; tests/docs/test_tables.py holds them up to date.
docs-tables: $(STAMP)
	$(BIN)/python -m docs.generate

# Shared libraries that gmsh loads: named, and installed where this is possible without asking anyone.
# CalculiX too, for contact by finite elements; nothing else needs it, and its tests are skipped without it.
system-libraries: $(STAMP)
	@missing="$$($(BIN)/python -c 'from fem_reference.environment import missing_system_packages as m; print(*m())')"; \
	if [ -n "$$missing" ]; then \
	  echo "gmsh needs these Debian packages: $$missing"; \
	  if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	    apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq $$missing; \
	  else \
	    echo "install them with: sudo apt-get install $$missing"; exit 1; \
	  fi; \
	fi
	@command -v ccx >/dev/null || \
	  { [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null && \
	    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq calculix-ccx; } || \
	  echo "contact by finite elements needs CalculiX: sudo apt-get install calculix-ccx"

# Chromium for the tests of the explorer; without it they are skipped and say so.
browser:
	@if ! command -v chromium >/dev/null || ! command -v chromedriver >/dev/null; then \
	  if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	    apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq chromium chromium-driver; \
	  else \
	    echo "no Chromium, its tests are skipped; install it with: sudo apt-get install chromium chromium-driver"; \
	  fi; \
	fi

$(STAMP): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "Python 3.11 or newer is needed: make PYTHON=python3.12 …"; exit 1; }
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV) || { echo "the module venv is missing: apt-get install python3-venv"; exit 1; }
	@echo "installing gearbench and what it needs into $(VENV): once, some minutes"
	@$(PIP) --upgrade pip
	@$(PIP) --editable ".[$(EXTRAS)]"
	@touch $@

clean:
	rm -rf $(VENV) out .pytest_cache .ruff_cache
