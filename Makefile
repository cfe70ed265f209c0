# `make demo` and `make test` set everything up in .venv; they need Python >= 3.11 and a C++17 compiler.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
OTHER_MUJOCO := 3.17.0
NATIVE := $(wildcard native/CMakeLists.txt native/*/*)

.PHONY: demo test check install install-dev models tables clean

demo: $(VENV)/installed
	$(BIN)/mjtactile press star --force 100gf --tilt 15 --shift 1.25,0 --rotate 20 --out demo.npz --figure demo.png

# Everything CI runs: style, types, all tests, and the MuJoCo side again on the oldest supported MuJoCo.
test: $(VENV)/installed-dev .mujoco-$(OTHER_MUJOCO)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright --pythonpath $(BIN)/python
	$(BIN)/python -m pytest
	PYTHONPATH=.mujoco-$(OTHER_MUJOCO) $(BIN)/python -m pytest tests/mujoco tests/cli -m "not slow"

# What a developer runs between edits.
check: $(VENV)/installed-dev
	$(BIN)/ruff check .
	$(BIN)/pyright --pythonpath $(BIN)/python
	$(BIN)/python -m pytest -m "not slow"

install: $(VENV)/installed
install-dev: $(VENV)/installed-dev

$(VENV)/bin/python:
	$(PYTHON) -c "import sys; sys.exit(sys.version_info < (3, 11) and 'mjtactile needs Python 3.11 or newer')"
	$(PYTHON) -m venv $(VENV)

$(VENV)/installed: $(VENV)/bin/python pyproject.toml constraints.txt $(NATIVE)
	$(PIP) install -c constraints.txt -e .
	touch $@

$(VENV)/installed-dev: $(VENV)/bin/python pyproject.toml constraints.txt $(NATIVE)
	$(PIP) install -c constraints.txt -e '.[dev]'
	touch $@ $(VENV)/installed

# A second MuJoCo beside the first: found first on PYTHONPATH, its dependencies shared.
.mujoco-$(OTHER_MUJOCO): | $(VENV)/installed-dev
	$(PIP) install --no-deps --target $@.partial mujoco==$(OTHER_MUJOCO)
	mv $@.partial $@

models: $(VENV)/installed
	$(BIN)/python models/generate.py

tables: $(VENV)/installed
	$(BIN)/mjtactile bench mesh --readme README.md
	$(BIN)/mjtactile bench plugin --readme README.md
	$(BIN)/mjtactile bench trade --readme README.md --out benchmarks/trade.json --figure docs/images/trade.png

clean:
	rm -rf $(VENV) .mujoco-* build dist demo.npz demo.png
