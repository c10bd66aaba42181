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

# Debian packages: installed, and named in a line, where this is possible without asking anyone; else named alone.
apt = if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then echo "installing of the system: $(1)"; \
  apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq $(1) >/dev/null; \
  else echo "missing of the system: sudo apt-get install $(1)"; false; fi

.PHONY: demo test test-all lint bench studies docs docs-tables wheel clean system-libraries programs kernels

demo: $(STAMP)
	@$(BIN)/python -m examples.demo out/demo

test: $(STAMP) system-libraries kernels
	$(BIN)/python -m pytest -m "not slow" -n 2 --dist loadfile --max-worker-restart 0

test-all: $(STAMP) system-libraries programs kernels
	$(BIN)/python -m pytest -n 2 --dist loadfile --max-worker-restart 0

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright
	$(BIN)/codespell
	$(BIN)/proselint check README.md CONTRIBUTING.md CHANGELOG.md docs

bench: $(STAMP)
	$(BIN)/python -m pytest benchmarks --benchmark-only -o addopts="" -q

studies: $(STAMP) system-libraries programs
	$(BIN)/python -m studies run all

# The pages of docs/ into out/site: warnings are errors, nothing comes from the network.
docs: $(STAMP)
	$(BIN)/python -m sphinx -b html -W --keep-going -q -d out/doctrees docs out/site
	@echo "open out/site/index.html"

# The sdist, and the wheel made from it, in an environment and a folder of its own: nothing of the sources is found there.
wheel: $(STAMP)
	@rm -rf out/wheel && mkdir -p out/wheel
	@$(BIN)/python -m build --outdir out/wheel .
	@$(PYTHON) -m venv out/wheel/venv
	@out/wheel/venv/bin/python -m pip install --quiet --disable-pip-version-check out/wheel/*.whl
	@cp examples/case1.toml out/wheel
	cd out/wheel && venv/bin/gearbench --version && venv/bin/gearbench simulate case1.toml -o case1.nc

# Pages that are made from the code; tests/docs/test_tables.py holds them up to date.
docs-tables: $(STAMP)
	$(BIN)/python -m docs.generate

# Compiled loops, which the processes of pytest would each compile for themselves.
kernels: $(STAMP)
	@$(BIN)/python -m tests.support.kernels

# Shared libraries that gmsh loads.
system-libraries: $(STAMP)
	@missing="$$($(BIN)/python -c 'from fem_reference.environment import missing_system_packages as m; print(*m())')"; \
	[ -z "$$missing" ] || { $(call apt,$$missing); }

# CalculiX, for contact by finite elements, and Chromium, for the tests of the explorer; without them they are skipped.
programs:
	@command -v ccx >/dev/null || { $(call apt,calculix-ccx); } || true
	@command -v chromedriver >/dev/null || { $(call apt,chromium chromium-driver); } || true

$(STAMP): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "Python 3.11 or newer is needed: make PYTHON=python3.12 …"; exit 1; }
	@test -x $(BIN)/pip || $(PYTHON) -m venv $(VENV) || { $(call apt,python3-venv) && $(PYTHON) -m venv $(VENV); }
	@echo "installing gearbench and what it needs into $(VENV): once, some minutes"
	@$(PIP) --upgrade pip
	@$(PIP) --editable ".[$(EXTRAS)]"
	@touch $@

clean:
	rm -rf $(VENV) out .pytest_cache .ruff_cache
