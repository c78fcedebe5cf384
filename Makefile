PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
# one more than processors: some tests wait
WORKERS := $(shell expr $$(getconf _NPROCESSORS_ONLN) + 1)

.PHONY: run test thorough check docs packages bench controller format clean

run: $(STAMP)  ## install into .venv, smooth the samples, show what came out
	$(BIN)/python samples/show.py

# the many processes that tests start load what the first has compiled; they are as many as there is work for, so that
# threads of each for its arithmetic would only wait for one another
test thorough: export PYTHONDONTWRITEBYTECODE =
test thorough: export OMP_NUM_THREADS = 1
test thorough: export OPENBLAS_NUM_THREADS = 1
thorough: export CORNERSMOOTH_THOROUGH = 1

test:  ## the whole test suite, on all processors
thorough:  ## the same with every case of the long lists

# in a new checkout every worker would rewrite all asserts; what fails runs once more, and shows what it compared
TESTS := $(BIN)/python -m pytest -n $(WORKERS) --dist worksteal
test thorough: $(STAMP)
	$(TESTS) --assert=plain || { $(TESTS) --last-failed --last-failed-no-failures=none; false; }

check: $(STAMP)  ## lint, format and types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

docs: $(STAMP)  ## the reference of the library, as pages in build/docs
	$(BIN)/python tools/make_reference.py

packages: $(STAMP)  ## wheel and sdist, installed in every Python that is here
	.ci/packages

bench: $(STAMP)  ## time the whole command beside a plain C program; with BEFORE=FOLDER beside another checkout
	$(BIN)/python benchmarks/$(if $(BEFORE),compare.py $(BEFORE),bench.py)

controller: $(STAMP)  ## time texts on LinuxCNC's whole controller
	$(BIN)/python tests/nc/controller_table.py $(CORNERSMOOTH_CORPUS)

format: $(STAMP)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# pip compiles on one processor, and the tests of all packages
$(STAMP): pyproject.toml
	test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile -e '.[dev]'
	-$(BIN)/python -m compileall -qq -j 0 -x '/tests/' $(VENV)/lib
	touch $@

clean:
	rm -rf $(VENV) build
