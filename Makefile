# make demo   power against load resistance, SPICE beside the averaged formulas: table and plot in out/
# make test   lint, types and tests
# make setup  what both need: system packages, .venv, the package; done once
# make docs   the pages and the reference of the Python names, into docs/_build/index.html
# make bench  performance, side by side with a reference, in one run; results in benchmarks/results/

PYTHON ?= python3
BIN := .venv/bin

.PHONY: setup demo test docs bench clean
setup: .venv/.complete

.venv/.complete: pyproject.toml setup.sh
	@PYTHON="$(PYTHON)" sh setup.sh
	@touch $@

demo: setup
	@echo "The paper's device: load swept through its time-constant ratio mu = 1/(R Cp w0)."
	$(BIN)/harvester sweep examples/paper_figure3.toml --vary nondimensional.mu=0.01:10:13 --out out/paper
	@echo "A published plate with a stop: load resistance from 1 kohm to 10 Mohm."
	$(BIN)/harvester sweep examples/plate_with_stop.toml --vary load.resistance=1k:10M:13 --out out/plate_with_stop
	@echo "Plots: out/paper/sweep.png (the published formula is up to four times too high)"
	@echo "       out/plate_with_stop/sweep.png"

test: setup
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/pytest -n 2 --dist loadfile

docs: setup
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build
	@echo "docs/_build/index.html"

bench: setup
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[bench]'
	$(BIN)/python benchmarks/lockstep.py
	$(BIN)/python benchmarks/ensemble.py
	$(BIN)/python benchmarks/effects.py
	$(BIN)/python benchmarks/accuracy.py
	$(BIN)/python benchmarks/figure1.py
	$(BIN)/python benchmarks/on_demand.py

clean:
	rm -rf .venv out docs/_build
