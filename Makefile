# make demo   runs the demo, make test   passes the tests; both set up what they need in .venv.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# Rebuilt when the lock or the project's own description changes.
READY := $(VENV)/.ready

.PHONY: setup demo test docs check lint types layers lock benchmark clean

setup: $(READY)

demo: $(READY)
	$(BIN)/nearfar demo nearfar-demo --force

# Many tests wait for a browser, a camera or another program: half as many more processes than
# processors.
PROCESSES = $(shell $(PYTHON) -c 'import os; print(-(-3 * len(os.sched_getaffinity(0)) // 2))' 2>/dev/null || echo auto)

# One thread for BLAS: the processes share the work as it is.
test: export OPENBLAS_NUM_THREADS := 1
# Each process would compile all modules anew where it keeps none of them.
test docs: export PYTHONDONTWRITEBYTECODE :=
test: $(READY)
	$(BIN)/python -m pytest --numprocesses=$(PROCESSES) --maxprocesses=4 --dist=loadfile --no-loadscope-reorder

# Runs every command and example in them; then open docs/_build/html/index.html.
docs: $(READY)
	rm -rf docs/_build docs/gallery docs/reference/api
	$(BIN)/python -m sphinx --fail-on-warning --keep-going -q -b html docs docs/_build/html

check: lint types layers test

lint: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/oxlint --deny-warnings src/nearfar/viewer src/nearfar/report

types: $(READY)
	$(BIN)/mypy

layers: $(READY)
	$(BIN)/lint-imports

benchmark: $(READY)
	$(BIN)/python benchmarks/reconstruction.py
	$(BIN)/python benchmarks/accuracy.py

$(READY): requirements.lock pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(0 if sys.version_info >= (3, 11) else "nearfar needs Python 3.11 or newer: make PYTHON=python3.12")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	touch $(READY)

# Needs uv on the path; hashes are of what PyPI holds.
lock:
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url \
		--no-annotate --custom-compile-command 'make lock' --quiet \
		--extra dask --extra mitsuba --extra window --extra gphoto2 --extra raw --extra webcam --extra film \
		--extra viewer --group dev --group docs --group build pyproject.toml -o requirements.lock

clean:
	rm -rf $(VENV) nearfar-demo docs/_build docs/gallery docs/reference/api dist .mypy_cache .ruff_cache .pytest_cache .import_linter_cache
