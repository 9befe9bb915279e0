# Nothing is assumed on the machine but Python 3.11 or newer with venv, and make.
PYTHON ?= python3
OUT ?= out/demo
# A copy of FabricSlide (github wngfra/FabricSlide, MIT); the demo runs on it where it is there.
FABRICSLIDE ?= ../shared/datasets/fabricslide

VENV := .venv
BIN := $(VENV)/bin
VIBRATION := --models vib-te,vib-te-aug --protocol both

.PHONY: install demo test lint slow clean

install: $(VENV)/.installed

$(VENV)/.installed: pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; v = sys.version.split()[0]; sys.exit(None if sys.version_info >= (3, 11) else f"Python 3.11 or newer is needed, {v} found; set PYTHON=...")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[dev]'
	@touch $@

demo: install
	$(BIN)/python scripts/demo_session.py $(OUT)/session
	$(BIN)/afferents extract $(OUT)/session $(OUT)/session.zarr
	$(BIN)/afferents evaluate $(OUT)/session.zarr --out $(OUT)/generated $(VIBRATION)
	$(BIN)/afferents report $(OUT)/generated
	@if [ -d "$(FABRICSLIDE)" ]; then \
	  $(BIN)/afferents evaluate "fabricslide:$(FABRICSLIDE)" --out $(OUT)/fabricslide $(VIBRATION) && \
	  $(BIN)/afferents report $(OUT)/fabricslide; \
	else echo "FabricSlide is not at $(FABRICSLIDE): real recordings left out (set FABRICSLIDE=...)"; fi
	@for results in generated fabricslide; do \
	  page=$(OUT)/$$results/report.html; [ -f $$page ] && echo "Report: $(CURDIR)/$$page" || true; done

lint: install
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

test: lint
	$(BIN)/python -m pytest

slow: install
	$(BIN)/python -m pytest -m slow

clean:
	rm -rf $(VENV) out
