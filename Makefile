# Nothing is assumed on the machine but Python 3.11 or newer with venv, and make.
PYTHON ?= python3
OUT ?= out/demo

VENV := .venv
BIN := $(VENV)/bin
# Of benchmarks and scripts, only what would stop them: calls, names, imports and attributes.
LOOSELY := --no-strict-optional --no-warn-unreachable $(patsubst %,--disable-error-code=%,arg-type assignment misc \
	no-untyped-call no-untyped-def type-arg var-annotated operator return-value no-any-return \
	call-overload import-untyped import-not-found unused-ignore)
# Two processes of one thread each, for two processors.
TESTS := OMP_NUM_THREADS=1 $(BIN)/python -m pytest

.PHONY: install demo live docs results results-pages check lint test test-system test-processors test-lerobot slow coverage licences bench package clean

install: $(VENV)/.installed

$(VENV)/.installed: pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; v = sys.version.split()[0]; sys.exit(None if sys.version_info >= (3, 11) else f"Python 3.11 or newer is needed, {v} found; set PYTHON=...")'
	$(PYTHON) -m venv $(VENV)
	@echo "installing into $(VENV)"
	@cpu=$$($(BIN)/python scripts/torch_index.py) && \
	if [ -n "$$cpu" ]; then export PIP_EXTRA_INDEX_URL="$$PIP_EXTRA_INDEX_URL $$cpu"; fi && \
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	@touch $@

demo: install
	$(BIN)/afferents reproduce $(OUT)

live: install
	$(BIN)/afferents live --model demo --video rig --audio rig --web

docs: install
	rm -rf docs/generated
	MPLBACKEND=Agg $(BIN)/python -m sphinx -W --keep-going docs docs/_build/html
	@echo "the site: docs/_build/html/index.html"

# Hours: PART=NAME for some, PART=list for their names.
results: install
	$(BIN)/python scripts/make_results.py $(PART)

results-pages: install
	$(BIN)/python scripts/results_pages.py
	$(BIN)/python scripts/architecture.py

lint: install
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/mypy $(LOOSELY) benchmarks scripts
	$(BIN)/lint-imports --no-cache

test: install
	$(TESTS) -m 'not slow and not system' -n 2 --dist loadfile

test-system: install
	$(TESTS) -m 'system and not slow'

check:
	$(MAKE) lint
	$(MAKE) test
	$(MAKE) test-system

test-processors: install
	sh scripts/test_processors.sh $(BIN)/python

test-lerobot: install
	sh scripts/test_lerobot.sh $(BIN)/python

slow: install
	$(BIN)/python -m pytest -m slow

# What the tests of every day go through: the least covered files, and all. WHAT=tests/unit/rig for some.
coverage: install
	rm -rf out/coverage && mkdir -p out/coverage
	OMP_NUM_THREADS=1 $(BIN)/coverage run -m pytest -m 'not slow and not system' -n 2 --dist loadfile $(WHAT)
	$(BIN)/coverage combine --quiet
	$(BIN)/coverage report --sort=cover | sed -n '1,22p;/^TOTAL/p'

licences: install
	$(BIN)/python scripts/licences.py

bench: install
	$(BIN)/python benchmarks/all.py out/benchmarks.md

package:
	sh scripts/test_package.sh $(PYTHON)

clean:
	rm -rf $(VENV) out dist docs/_build docs/examples docs/generated
	find docs/gallery -mindepth 1 ! -name '*.py' ! -name '*.rst' -delete
