# `make demo` and `make test` set everything up in .venv; they need Python >= 3.11 and a C++17 compiler.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
OTHER_MUJOCO := 3.17.0
NATIVE := $(wildcard native/CMakeLists.txt native/*/*)

.PHONY: demo test check install install-dev models tables weights clean

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
	$(BIN)/mjtactile bench envs --readme docs/environments.md
	$(BIN)/mjtactile envs --readme docs/environments.md
	$(BIN)/mjtactile bench trade --readme README.md --out benchmarks/trade.json --figure docs/images/trade.png

# Every shipped recogniser anew, from presses to weights; two at a time. `make weights SHIP=1` puts them in the package.
WEIGHTS := build/weights
DATA := build/presses
TRAIN := OMP_NUM_THREADS=1 PYTHONPATH=. $(BIN)/python training
weights: $(VENV)/installed
	mkdir -p $(WEIGHTS)/all $(WEIGHTS)/top
	$(BIN)/mjtactile dataset --spec training/presses.toml --out $(DATA) --workers 2
	$(TRAIN)/train_view.py --data $(DATA) --weights $(WEIGHTS)/all
	$(TRAIN)/train_view.py --data $(DATA) --weights $(WEIGHTS)/top --layers 0 --parts 120
	$(MAKE) -j2 force-all force-top
	$(MAKE) -j2 shapes-all shapes-top
	$(TRAIN)/add_shape.py --shape hexagon --steps 3000 --data $(DATA) --weights $(WEIGHTS)/all
	$(TRAIN)/add_shape.py --shape cross --steps 3000 --data $(DATA) --weights $(WEIGHTS)/all
	$(TRAIN)/grasp_presses.py --out build/grasps.npz --workers 2
	$(TRAIN)/train_grasp.py --data build/grasps.npz --weights $(WEIGHTS)/grasp
	$(if $(SHIP),mkdir -p mjtactile/recognition/weights/grasp && cp $(WEIGHTS)/grasp/* mjtactile/recognition/weights/grasp/)
	$(if $(SHIP),cp $(WEIGHTS)/all/* mjtactile/recognition/weights/all/ && cp $(WEIGHTS)/top/* mjtactile/recognition/weights/top/)

.PHONY: force-all force-top shapes-all shapes-top
force-all:
	$(TRAIN)/train_force.py --data $(DATA) --weights $(WEIGHTS)/all
force-top:
	$(TRAIN)/train_force.py --data $(DATA) --weights $(WEIGHTS)/top --steps 5000

shapes-all shapes-top: shapes-%:
	$(TRAIN)/train_pose.py --module position --data $(DATA) --weights $(WEIGHTS)/$*
	$(TRAIN)/train_pose.py --module size --data $(DATA) --weights $(WEIGHTS)/$*
	$(TRAIN)/train_pose.py --module orientation --data $(DATA) --weights $(WEIGHTS)/$*
	$(TRAIN)/train_shapes.py --data $(DATA) --weights $(WEIGHTS)/$*

clean:
	rm -rf $(VENV) .mujoco-* build dist demo.npz demo.png
