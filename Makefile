# Two commands on a fresh machine with python3 (3.11 or later, with venv), make and a C compiler:
#   make demo    the main job, on real flights where they are found, otherwise on simulated ones
#   make test    every check
PYTHON ?= python3
BIN := .venv/bin
STAMP := .venv/.complete
# One more than the two cores that are usual: while a test waits, another one runs.
WORKERS ?= 3
# Threads that do not fight for cores.
QUICK := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1
# Three test processes and many started programs would each compile every module anew.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help demo test page lint types layers unit speed proof siege site clean
.DEFAULT_GOAL := help

help:
	@echo "make demo   identify the CoaX from one flight, predict another, write demo/report.html"
	@echo "make test   ruff, pyrefly, import-linter, pytest and the benchmarks in short"
	@echo "make proof  the statistics with all their seeds and the benchmarks in full, into docs/proof.md (hours)"
	@echo "make siege  damaged files, kills, full disks, packets and hostile pages, into docs/proof.md (an hour)"
	@echo "make site   the documentation as a site, build/site/index.html; offline, warnings are errors"
	@echo "make clean  remove .venv and everything that was built"

# The stamp is written last, so that an interrupted installation is done again and a finished one is not.
$(STAMP): lock/dev.txt pyproject.toml
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "swashplate needs Python 3.11 or later; run: make PYTHON=python3.11 ...")'
	test -x $(BIN)/python || $(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --require-hashes -r lock/dev.txt
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation -e .
	touch $@

demo: $(STAMP)
	$(BIN)/swash demo --out demo

# First what fails fastest. Then everything at once, for some tests wait for browsers and clocks; short speeds judge nothing.
test: $(STAMP)
	$(MAKE) --no-print-directory -j 2 --output-sync page lint layers
	$(MAKE) --no-print-directory -j 3 unit types speed

# three.js and uPlot for `swash live`, by hash; without npm the tests of the page are skipped with the reason.
page:
	$(PYTHON) scripts/vendor_page.py --if-npm

lint: $(STAMP)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

types: $(STAMP)
	$(BIN)/pyrefly check --python-interpreter-path $(BIN)/python --output-format min-text

layers: $(STAMP)
	$(BIN)/lint-imports

unit: $(STAMP)
	$(QUICK) $(BIN)/python -m pytest -m "not proof" -q -n $(WORKERS) --dist loadfile --no-loadscope-reorder --max-worker-restart 0

speed: $(STAMP)
	$(QUICK) $(BIN)/python -m benchmarks.run --short

proof: $(STAMP)
	$(BIN)/python -m tests.proof

# Sizes: make siege SIEGE="--minutes 10 --only files"; see python -m tests.siege.run --help
siege: $(STAMP)
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.siege.run $(SIEGE)

site: $(STAMP)
	$(BIN)/python docs/site/build_site.py

clean:
	rm -rf src/swashplate/links/live/page/vendor .venv build dist demo .pytest_cache .ruff_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
