# The README's two commands are `make run` and `make test`. Everything is installed into .venv from
# requirements.lock; nothing else needs to be on the machine but Python 3.11, make and pip.

PYTHON ?= $(shell command -v python3.11 || command -v python3)
STUDY  ?= examples/two_blades/study.toml
WORKERS ?= 2

VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
DOCS_INSTALLED := $(VENV)/.docs-installed
READERS_INSTALLED := $(VENV)/.readers-installed
SPARSE_INSTALLED := $(VENV)/.sparse-installed
LOCK_FLAGS := --quiet --generate-hashes --strip-extras \
	--no-emit-index-url --no-emit-find-links --no-emit-trusted-host
# Two test workers on two cores: a threaded BLAS under each would only make them wait for each other.
ONE_THREAD := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1

.PHONY: help install run test coverage readers test-readers sparse test-sparse lint docs figures second-damper reconstruction bench bench-rival calculix validate baseline strategies alarms sections lock clean
.DELETE_ON_ERROR:

help:  ## list the targets
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

install: $(INSTALLED)  ## make .venv, install the locked versions and compile the contact laws

$(INSTALLED): requirements.lock pyproject.toml
	@test -n "$(PYTHON)" || { echo "No Python found. Install Python 3.11 or name it: make PYTHON=/path/to/python3.11"; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' || \
		{ echo "$(PYTHON) is not Python 3.11, for which requirements.lock is made. Name one: make PYTHON=/path/to/python3.11"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	@$(BIN)/python .ci/system_libraries.py
	@$(BIN)/stickslip compile
	@touch $@

run: $(INSTALLED)  ## solve the example of two blades and a damper, and write its report
	@status=0; $(BIN)/stickslip run $(STUDY) --workers $(WORKERS) || status=$$?; page=$(dir $(STUDY))results/report.html; \
	if [ -e "$$page" ]; then echo "Open $$page in a browser."; fi; exit $$status

test: $(INSTALLED)  ## run the tests
	$(ONE_THREAD) $(BIN)/python -m pytest -n $(WORKERS) --durations=20

coverage: $(INSTALLED)  ## run the tests and report their coverage, a quarter slower
	$(ONE_THREAD) $(BIN)/python -m pytest -n $(WORKERS) --durations=20 --cov --cov-report=term:skip-covered

readers: $(READERS_INSTALLED)  ## install what reads Nastran's binary files, and files of ANSYS to test with

$(READERS_INSTALLED): $(INSTALLED) readers-requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r readers-requirements.lock
	@touch $@

test-readers: $(READERS_INSTALLED)  ## run the tests of the readers of ANSYS and Nastran files, none skipped
	$(ONE_THREAD) STICKSLIP_READERS=required $(BIN)/python -m pytest tests/test_readers_ansys.py tests/test_readers_nastran.py

sparse: $(SPARSE_INSTALLED)  ## install the faster factorisation of large models

$(SPARSE_INSTALLED): $(INSTALLED) sparse-requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --require-hashes -r sparse-requirements.lock
	@touch $@

test-sparse: $(SPARSE_INSTALLED)  ## run the tests of factorisations and modes with it
	$(ONE_THREAD) $(BIN)/python -m pytest tests/test_factorisation.py tests/test_modes.py

lint: $(INSTALLED)  ## style, types and the direction of imports
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

$(DOCS_INSTALLED): $(INSTALLED) docs/requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r docs/requirements.lock
	@touch $@

docs: $(DOCS_INSTALLED)  ## build the documentation; any warning is an error
	$(ONE_THREAD) $(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html
	@echo "Open docs/_build/html/index.html in a browser."

figures: $(DOCS_INSTALLED)  ## draw the figures of Gastaldi & Berruti (2017) for the own two blades; writes docs/seed_figures.md (some minutes)
	$(ONE_THREAD) $(BIN)/python -m evidence.figures

bench: $(INSTALLED)  ## run every benchmark; writes evidence/benchmarks/out/results.json
	$(ONE_THREAD) $(BIN)/python -m evidence.benchmarks

bench-rival: .venv-rival/.installed  ## install pyHarm-os, which the chain benchmark is timed against, into .venv-rival

.venv-rival/.installed: evidence/benchmarks/requirements.lock $(INSTALLED)
	$(PYTHON) -m venv .venv-rival
	.venv-rival/bin/python -m pip install --quiet --disable-pip-version-check --require-hashes -r evidence/benchmarks/requirements.lock
	@touch $@

strategies: $(DOCS_INSTALLED)  ## compare all ways of choosing harmonics; writes docs/strategies.md and its figure (some ten minutes)
	$(ONE_THREAD) $(BIN)/python -m evidence.strategies compare

second-damper: $(INSTALLED)  ## look for a damper for the second bending mode; writes docs/second_damper.md (some fifteen minutes)
	$(ONE_THREAD) $(BIN)/python -m evidence.second_damper

reconstruction: $(INSTALLED)  ## look for the two blades and damper that show most of what the paper tells; writes docs/reconstruction.md (some thirty minutes)
	$(ONE_THREAD) $(BIN)/python -m evidence.reconstruction

alarms: $(INSTALLED)  ## count missed and false alarms of the strategies that verify; writes docs/strategies_alarms.md (ten to twenty minutes)
	$(ONE_THREAD) $(BIN)/python -m evidence.strategies alarms

sections: $(DOCS_INSTALLED)  ## two blades with 1 to 15 sections of contact points; writes docs/contact_points_numbers.md and its picture (some ten minutes)
	$(ONE_THREAD) $(BIN)/python -m evidence.sections

calculix:  ## install CalculiX with apt, for the comparisons of `make validate` that need it (as root)
	apt-get update -qq
	DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends calculix-ccx

validate: $(INSTALLED)  ## compare with closed forms, other codes and the literature
	@tests=pass; list=holds; \
	$(ONE_THREAD) $(BIN)/python -m pytest -n $(WORKERS) -m validation || tests="DO NOT ALL PASS, see above"; \
	$(ONE_THREAD) $(BIN)/python -m evidence.validation || list="DOES NOT HOLD WHOLE, see above"; \
	echo "The tests marked validation $$tests; the list of comparisons $$list."; \
	test "$$tests $$list" = "pass holds"

baseline: $(INSTALLED)  ## compare the examples with the results of the commit that the moves began from (some minutes)
	$(ONE_THREAD) $(BIN)/python -m evidence.baseline

lock: $(INSTALLED)  ## resolve the newest versions and write both lock files
	$(BIN)/python -m pip install --quiet --disable-pip-version-check pip-tools
	CUSTOM_COMPILE_COMMAND="make lock" $(BIN)/python -m piptools compile $(LOCK_FLAGS) --upgrade --extra fe --extra report --extra test \
		--build-deps-for editable -o requirements.lock pyproject.toml
	CUSTOM_COMPILE_COMMAND="make lock" $(BIN)/python -m piptools compile $(LOCK_FLAGS) --upgrade --extra docs \
		-c requirements.lock -o docs/requirements.lock pyproject.toml
	CUSTOM_COMPILE_COMMAND="make lock" $(BIN)/python -m piptools compile $(LOCK_FLAGS) --upgrade --extra bench \
		-o evidence/benchmarks/requirements.lock pyproject.toml
	CUSTOM_COMPILE_COMMAND="make lock" $(BIN)/python -m piptools compile $(LOCK_FLAGS) --upgrade --extra readers --extra readers-test \
		-c requirements.lock -c docs/requirements.lock -o readers-requirements.lock pyproject.toml
	CUSTOM_COMPILE_COMMAND="make lock" $(BIN)/python -m piptools compile $(LOCK_FLAGS) --upgrade --extra sparse \
		-c requirements.lock -o sparse-requirements.lock pyproject.toml

clean:  ## remove everything that the other targets made, .venv included
	rm -rf $(VENV) .venv-rival .coverage* htmlcov .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache \
		docs/_build docs/auto_examples docs/generated evidence/benchmarks/out evidence/validation/out examples/*/results
	find src tests evidence docs examples -name __pycache__ -type d -prune -exec rm -rf {} +
