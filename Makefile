# The project's commands. Each one makes the environment that it needs.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed

.PHONY: setup demo rally paper imitation pages test check format clean help
.DEFAULT_GOAL := help

help: ## print this list
	@grep -E '^[a-z]+:.*##' $(MAKEFILE_LIST) | sed -E 's/^([a-z]+):.*## /  make \1\t/'

setup: $(STAMP) ## make the environment: .venv with pinned dependencies

$(STAMP): pyproject.toml constraints.txt tests/models.txt
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Volley needs Python 3.11 or newer; name one with: make PYTHON=python3.12")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[test,check,paper,bench]'
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps -r tests/models.txt
	@touch $@

demo: setup ## play five strikes; prints a table and writes a trace
	$(BIN)/python -m tools.demo

rally: setup ## throw twenty balls, which the arm returns; prints a table and writes a trace
	$(BIN)/python -m tools.rally

paper: setup ## make the paper's figures, table and traces
	$(BIN)/python -m experiments

imitation: setup ## make docs/imitation.md, its figures and numbers
	$(BIN)/python -m experiments.imitation

pages: setup ## make docs/protocol.md, docs/api.md and docs/trace.md
	$(BIN)/python -m tools.pages.protocol > docs/protocol.md
	$(BIN)/python -m tools.pages.api > docs/api.md
	$(BIN)/python -m tools.pages.trace > docs/trace.md

test: setup ## run every test: one process a core, then those that need the wall clock
	$(BIN)/python -m pytest -n auto --dist loadfile --no-loadscope-reorder --max-worker-restart=0 -m 'not realtime'
	$(BIN)/python -m pytest -m realtime tests/system

check: setup ## check lint, format, types and import direction
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/lint-imports
	$(BIN)/basedpyright --warnings

format: setup ## let ruff rewrite the sources
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean: ## remove the environment and caches
	rm -rf $(VENV) .pytest_cache .ruff_cache .hypothesis .import_linter_cache *.egg-info
