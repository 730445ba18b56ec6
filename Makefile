# make demo   power against load resistance by formulas, Monte Carlo and SPICE: tables, plots in out/, the best load
# make check  about a minute: lint, format, types, layers, and the tests without ngspice or long statistics
# make test   some minutes: lint, format, types, and all tests but the thorough ones
# make test-all   everything: also 200 seeds, the documented commands, kills, attacks, a browser, second opinions
# make setup  requirements: system packages, .venv, the package with the versions of constraints.txt; done once
# make lock   a new constraints.txt: the newest versions that pyproject.toml allows; then run make test-all
# make docs   the pages and the reference of the Python names, into docs/_build/index.html
# make bench  performance compared with a reference, in one run; results in benchmarks/results/

PYTHON ?= python3
BIN := .venv/bin
# Bytecode is kept, also where the shell forbids it: every program that a test starts would compile the package anew.
export PYTHONDONTWRITEBYTECODE :=

.PHONY: setup demo check test test-all tests quick layers lint docs bench lock clean
setup: .venv/.complete

.venv/.complete: pyproject.toml tools/setup.sh constraints.txt
	@PYTHON="$(PYTHON)" sh tools/setup.sh
	@touch $@

demo: setup
	@echo "The device of the Entropy 2026 paper: load swept through its time-constant ratio mu = 1/(R Cp w0)."
	$(BIN)/harvester sweep examples/paper_figure3.toml --vary nondimensional.mu=0.01:10:13 --engine published --engine averaged --engine ensemble --engine spice --out out/paper
	@echo "A published plate with a stop: load resistance from 1 kohm to 10 Mohm."
	$(BIN)/harvester sweep examples/plate_with_stop.toml --vary load.resistance=1k:10M:13 --engine published --engine averaged --engine ensemble --engine spice --out out/plate_with_stop
	@echo "Plots: out/paper/sweep.png (the published formula is up to four times too high)"
	@echo "       out/plate_with_stop/sweep.png"
	@$(BIN)/python benchmarks/demo_answer.py out/plate_with_stop/sweep.csv

lint: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

# The types are checked beside the tests here too.
check: setup
	@$(MAKE) --no-print-directory --jobs 2 lint layers quick

layers: setup
	$(BIN)/lint-imports

quick: setup
	$(BIN)/pytest -n 2 --dist worksteal -m "not ngspice and not statistics and not slow and not thorough"

# The types are checked beside the tests, which is on another core.
test: setup
	@$(MAKE) --no-print-directory --jobs 2 lint tests

# Three on two cores: tests wait for the programs that they start.
tests: setup
	$(BIN)/pytest -n 3 --dist worksteal -m "not thorough"

test-all: lint
	$(BIN)/pytest -n 3 --dist loadfile

docs: setup
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build
	@echo "docs/_build/index.html"

bench: setup
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[bench]'
	$(BIN)/python benchmarks/lockstep.py
	$(BIN)/python benchmarks/ensemble.py
	$(BIN)/python benchmarks/effects.py
	$(BIN)/python benchmarks/accuracy.py
	$(BIN)/python benchmarks/figure1.py
	$(BIN)/python benchmarks/on_demand.py
	$(BIN)/python benchmarks/controls.py
	$(BIN)/python benchmarks/steady.py
	$(BIN)/python benchmarks/periodic_errors.py
	$(BIN)/python benchmarks/published.py
	$(BIN)/python benchmarks/second_opinion.py

# In a virtual environment of its own, which is thrown away: what .venv has besides does not matter.
lock:
	@fresh=$$(mktemp -d) && trap 'rm -rf "$$fresh"' EXIT && $(PYTHON) -m venv "$$fresh" && \
	"$$fresh"/bin/python -m pip install --quiet --disable-pip-version-check '.[test,bench]' && \
	{ echo "# Versions that are tested, of all that '.[test,bench]' brings; made by: make lock"; \
	  "$$fresh"/bin/python -m pip freeze --exclude piezo-harvester | grep ==; } >"$$fresh"/constraints.txt && \
	cp "$$fresh"/constraints.txt constraints.txt

clean:
	rm -rf .venv out docs/_build
