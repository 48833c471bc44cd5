# The README's two commands are `make run` and `make test`. Everything is installed into .venv from
# requirements.lock; nothing else needs to be on the machine but Python 3.11 or newer, make and pip.

VENV ?= .venv
# the one that made .venv, else what there is
PYTHON ?= $(shell sed -n 's/^executable = //p' $(VENV)/pyvenv.cfg 2>/dev/null | grep . || command -v python3.11 || command -v python3)
STUDY  ?= examples/two_blades/study.toml
WORKERS ?= 2
# further Pythons that `make release` goes its journey with, such as 3.12
PYTHONS ?=

VERSION := $(shell $(PYTHON) -c 'import sys; print("%d.%d" % sys.version_info[:2])' 2>/dev/null)
BIN := $(VENV)/bin
# another Python is another installation, and makes .venv anew
INSTALLED := $(VENV)/.installed-$(VERSION)
# an installation that was stopped goes on with this environment
MADE := $(VENV)/.made-$(VERSION)
DOCS_INSTALLED := $(VENV)/.docs-installed-$(VERSION)
OPTIONAL_INSTALLED := $(VENV)/.optional-installed-$(VERSION)
PIP_INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check
# one resolution for Linux, macOS and Windows and for all Pythons that pyproject.toml allows, in markers
LOCK := $(BIN)/uv pip compile pyproject.toml --quiet --universal --python-version 3.11 --generate-hashes --upgrade \
	--no-config --custom-compile-command "make lock"
# Processes that tests start would compile this package anew, each of them.
unexport PYTHONDONTWRITEBYTECODE
# Two test workers on two cores: a threaded BLAS under each would only make them wait for each other.
ONE_THREAD := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
# Each worker gets tests in one piece: what the tests of a file share is made, and what they compile compiled, once.
TESTS := pytest -n $(WORKERS) --dist worksteal --durations=20

.PHONY: help install run test test-kernels coverage optional test-optional test-cluster lint docs-tools docs release pages bench bench-rival calculix validate validate-tests validate-faults validate-kernels validate-literature validate-in-time validate-mutants baseline trust mutants lock clean
.DELETE_ON_ERROR:

help:  ## list the targets
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 12

install: $(INSTALLED)  ## make .venv, install the locked versions and compile the contact laws

$(INSTALLED): requirements.lock pyproject.toml
	@test -n "$(VERSION)" || { echo "No Python found. Install Python 3.11 or newer, or name it: make PYTHON=/path/to/python3.12"; exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "$(PYTHON) is Python $(VERSION), and 3.11 is the oldest that does. Name one: make PYTHON=/path/to/python3.12"; exit 1; }
	$(PYTHON) -m venv $(if $(wildcard $@ $(MADE)),,--clear) $(VENV)
	@touch $(MADE)
	@echo "Installing the locked versions: nothing is printed until they are there."
	$(PIP_INSTALL) --no-deps --require-hashes -r requirements.lock
	$(PIP_INSTALL) --no-deps --no-build-isolation -e .
	@$(BIN)/python .ci/system_libraries.py
	@$(BIN)/stickslip compile
	@touch $@

run: $(INSTALLED)  ## solve the example of two blades and a damper, and write its report
	@status=0; $(BIN)/stickslip run $(STUDY) --workers $(WORKERS) || status=$$?; page=$(dir $(STUDY))results/report.html; \
	if [ -e "$$page" ]; then echo "Open $$page in a browser."; fi; exit $$status

test: $(INSTALLED)  ## run the tests
	$(ONE_THREAD) $(BIN)/python -m $(TESTS)

test-kernels: $(INSTALLED)  ## run the tests marked `kernel` with the LAPACK kernels of Haswell, which `make test` does not have
	$(ONE_THREAD) $(BIN)/python -m evidence.kernels --marked --workers $(WORKERS)

coverage: $(INSTALLED)  ## run the tests and report their coverage, a quarter slower
	$(ONE_THREAD) $(BIN)/python -m $(TESTS) --cov --cov-report=term:skip-covered

optional: $(OPTIONAL_INSTALLED)  ## install what nobody needs by default: readers, a faster factorisation, files of ANSYS to test with (1 GB)

$(OPTIONAL_INSTALLED): $(INSTALLED) optional-requirements.lock
	$(PIP_INSTALL) --no-deps --require-hashes -r optional-requirements.lock
	@touch $@

test-optional: $(OPTIONAL_INSTALLED)  ## run the tests of these, none skipped
	$(ONE_THREAD) STICKSLIP_OPTIONAL=required $(BIN)/python -m pytest tests/test_readers_ansys.py tests/test_readers_nastran.py \
		tests/test_factorisation.py tests/test_modes.py

test-cluster: $(OPTIONAL_INSTALLED)  ## run jobs on a Dask cluster whose workers are killed, and with executorlib (a minute and a half)
	$(ONE_THREAD) STICKSLIP_CLUSTER=required $(BIN)/python -m pytest tests/test_cluster.py

lint: $(INSTALLED)  ## style, types and the direction of imports
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

docs-tools: $(DOCS_INSTALLED)  ## install what the documentation and a release are made with

$(DOCS_INSTALLED): $(INSTALLED) docs/requirements.lock
	$(PIP_INSTALL) --no-deps --require-hashes -r docs/requirements.lock
	@touch $@

docs: $(DOCS_INSTALLED)  ## build the documentation; any warning is an error
	$(ONE_THREAD) $(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html
	@echo "Open docs/_build/html/index.html in a browser."

# the modules of evidence/ that write pages of docs/
PAGE_figures = figures
PAGE_strategies = strategies compare
PAGE_alarms = strategies alarms
PAGE_second-damper = second_damper
PAGE_reconstruction = reconstruction
PAGE_sections = sections
PAGE_gallery = gallery

pages: $(DOCS_INSTALLED)  ## write a page of docs/ and its pictures anew: NAME=figures, strategies, alarms, second-damper, reconstruction, sections or gallery (five to thirty minutes)
	$(ONE_THREAD) $(BIN)/python -m evidence.$(or $(PAGE_$(NAME)),$(error NAME=figures, strategies, alarms, second-damper, reconstruction, sections or gallery))

bench: $(INSTALLED)  ## run every benchmark; writes evidence/benchmarks/out/results.json
	$(ONE_THREAD) $(BIN)/python -m evidence.benchmarks

bench-rival: .venv-rival/.installed  ## install pyHarm-os, which the chain benchmark is timed against, into .venv-rival

.venv-rival/.installed: evidence/benchmarks/requirements.lock $(INSTALLED)
	$(PYTHON) -m venv .venv-rival
	.venv-rival/bin/python -m pip install --quiet --disable-pip-version-check --no-deps --require-hashes -r evidence/benchmarks/requirements.lock
	@touch $@

trust: $(INSTALLED)  ## hold what a response trusts on random machines against a judge of its own (SEED=1 SYSTEMS=60, ten minutes)
	$(ONE_THREAD) $(BIN)/python -m evidence.trust --seed $(or $(SEED),1) --systems $(or $(SYSTEMS),60) --workers $(WORKERS)

mutants: $(INSTALLED)  ## change the library in one point, N=40 times, and list the changes that no test notices (SEED of the day; the first time all tests run once more)
	$(ONE_THREAD) $(BIN)/python -m evidence.mutants --n $(or $(N),40) --seed $(or $(SEED),$(shell date +%Y%m%d)) --workers $(WORKERS)

calculix:  ## install CalculiX with apt, for the comparisons of `make validate` that need it (as root)
	apt-get update -qq
	DEBIAN_FRONTEND=noninteractive apt-get install -qq -y --no-install-recommends calculix-ccx

validate: $(INSTALLED)  ## compare with closed forms, other codes, the literature and time integration; damage, kill and repeat: all parts
	$(ONE_THREAD) $(BIN)/python -m evidence.validation.parts --workers $(WORKERS)

# each part ends within half an hour on two quiet cores; a name here is one in evidence/validation/parts.py
PART = $(ONE_THREAD) $(BIN)/python -m evidence.validation.parts $(@:validate-%=%) --workers $(WORKERS)

validate-tests: $(INSTALLED)  ## a part of `make validate`: the slow tests
	$(PART)

validate-faults: $(INSTALLED)  ## a part of `make validate`: damaged files, kills, full disks, little memory
	$(PART)

validate-kernels: $(INSTALLED)  ## a part of `make validate`: numeric tests on every LAPACK kernel
	$(PART)

validate-literature: $(INSTALLED)  ## a part of `make validate`: closed forms, other programs, the literature
	$(PART)

validate-in-time: $(INSTALLED)  ## a part of `make validate`: time integration and many harmonics
	$(PART)

validate-mutants: $(INSTALLED)  ## a part of `make validate`: one-point changes that a test has to notice
	$(PART)

# `make baseline REF=hub/main NAME="two_tones flutter"`: what moved code has to pass
baseline: $(INSTALLED)  ## run every example, made small, with the sources of REF=HEAD and with those here: same numbers to the bit, same words (NAME=flutter: it alone)
	$(ONE_THREAD) $(BIN)/python -m evidence.baseline $(or $(REF),HEAD) $(NAME) --workers $(WORKERS)

release: $(DOCS_INSTALLED)  ## build the wheel, the source archive and the notes of a release into dist/ and try them; uploads nothing
	rm -rf dist
	$(BIN)/python -m build --no-isolation --outdir dist .
	$(BIN)/python -m twine check --strict dist/*
	$(BIN)/python .ci/release_notes.py >dist/NOTES.md
	$(BIN)/python .ci/wheel_journey.py dist $(BIN)/python $(PYTHONS)

lock: $(INSTALLED)  ## resolve the newest versions for every Python and system, and write the lock files
	$(PIP_INSTALL) uv
	$(LOCK) --extra fe --extra exchange --extra figure --extra test --group editable -o requirements.lock
	$(LOCK) --extra docs --group release -c requirements.lock -o docs/requirements.lock
	$(LOCK) --extra readers --extra readers-test --extra sparse --extra cluster -c requirements.lock -c docs/requirements.lock \
		-o optional-requirements.lock
	$(LOCK) --extra bench -o evidence/benchmarks/requirements.lock

clean:  ## remove everything that the other targets made, .venv included
	rm -rf $(VENV) .venv-rival dist .coverage* htmlcov .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache \
		docs/_build docs/auto_examples docs/generated evidence/benchmarks/out evidence/baseline/out evidence/validation/out evidence/mutants/out examples/*/results
	find src tests evidence docs examples -name __pycache__ -type d -prune -exec rm -rf {} +
