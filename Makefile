# Two commands do everything on a fresh machine: `make demo` and `make test`.
PYTHON ?= python3
BIN := .venv/bin
READY := .venv/ready
QC := build/qc/checkers
# The page in the browser, and what it is built from; Node comes from PyPI, into .venv.
PAGE := src/odscen/web/static/index.html
PAGE_SOURCES := $(shell find frontend/src frontend/public -type f) \
	$(wildcard frontend/*.json frontend/*.ts frontend/*.cjs frontend/*.html)
DOCS := .venv/docs-ready
MODULES := frontend/node_modules/.package-lock.json
# Some machines forbid Python to keep what it compiles: then each process that a test starts compiles
# all of odscen, 0.8 s of it.
unexport PYTHONDONTWRITEBYTECODE
NPM := cd frontend && PATH="$(CURDIR)/$(BIN):$$PATH" npm --silent

.PHONY: demo test test-interchange test-interchange-part fuzz regression test-page chromium allocator page api api-changes check check-source check-page docs hooks format bench golden maps large-town check-maps check-wheel test-lowest test-newest screenshots clean

# Set-up plus the main job: build the shipped maps, sample a scenario, run it, name the report.
demo: $(READY)
	$(BIN)/odscen demo --workspace demo

# Set-up plus the tests, the suite of scenarios on the shipped maps among them. Of the slow tests
# it runs a part, the same at each commit; `make test SLOW=all` runs all.
SLOW := part
test: test-page $(READY) $(QC) $(PAGE) chromium allocator
	ODSCEN_SLOW=$(SLOW) $(BIN)/python -m pytest -n 2 --dist loadfile
	$(MAKE) regression

# Scenarios on the shipped maps against their baselines; see docs/regression.md.
regression: $(READY)
	$(BIN)/odscen test suites/shipped.toml --jobs 2 --workspace build/regression --junit build/regression/junit.xml --html build/regression/report.html
	$(BIN)/odscen test suites/netconvert.toml --jobs 2 --workspace build/regression --junit build/regression/junit-netconvert.xml --html build/regression/report-netconvert.html

# Exports of runs read by programs of others, in environments of their own in build/interchange
# (5 GB); see docs/learning-formats.md. `make test` reads the same with plain readers.
test-interchange: $(READY)
	$(BIN)/python -m tools.read_exports $(INTERCHANGE)

# One of them, with a reader that is installed in a minute; `.ci/run` has it.
test-interchange-part: $(READY)
	$(BIN)/python -m tools.read_exports commonroad --maps maps/signal_crossing.xodr --seconds 10

# The parts of the page that need no browser.
test-page: $(MODULES)
	$(NPM) run test

page: $(PAGE)

# For the tests in a browser, which are skipped without; ODSCEN_REQUIRE_BROWSER=1 and CI forbid that.
chromium:
	$(PYTHON) -m tools.chromium

# SUMO runs faster with it, see docs/runs.md; everything works without.
allocator:
	@PATH="$$PATH:/sbin" ldconfig -p 2>/dev/null | grep -q libtcmalloc_minimal.so.4 || \
	$(PYTHON) -m tools.debian libtcmalloc-minimal4 "with which SUMO is faster"

# The page's types of all messages, from what the server says of itself; see docs/server.md.
api: $(READY) $(MODULES)
	$(BIN)/python -m tools.api_schema

check: check-source check-page

check-source: $(READY)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# The page, and that its types of all messages are those of the server.
check-page: $(READY) $(MODULES)
	$(BIN)/python -m tools.api_schema --check
	$(NPM) run check

# What of the public API would break for users of REF, the last release if not given; see docs/api.md.
api-changes: $(READY)
	$(BIN)/python -m tools.api_changes $(REF)

# The documentation as a site in build/site; a broken link or anchor is an error.
docs: $(DOCS)
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build

# The quick checks before each commit.
hooks: $(READY)
	$(BIN)/pre-commit install

format: $(READY)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# Benchmarks print ratios against a named peer, measured in the same run.
bench: $(READY) $(PAGE) chromium allocator
	$(BIN)/python -m bench

# Faults of every kind, an hour of them; see docs/faults.md.
fuzz: $(READY) $(PAGE)
	$(BIN)/python -m bench fuzz $(FUZZ)

# With the lowest versions that pyproject.toml admits: the demo and a part of the tests.
test-lowest: $(READY) $(PAGE)
	$(BIN)/python -m tools.try_versions lowest

# The same with the newest ones, on Pythons that are on this machine.
test-newest: $(READY) $(PAGE)
	$(BIN)/python -m tools.try_versions newest 3.12 3.13
	ODSCEN_SLOW=all $(BIN)/python -m pytest -q -rs tests/cli/test_two_pythons.py

# The wheel from a clone of what is committed, on a machine without Node.
check-wheel: $(READY)
	$(BIN)/python -m tools.check_wheel

# Pictures of every view for docs/, light and dark, and those of measures, templates and a sweep.
screenshots: $(READY) $(PAGE) chromium
	$(BIN)/python -m tools.measure_pictures
	$(BIN)/python -m tools.template_pictures
	$(BIN)/python -m tools.sweep_pictures
	$(BIN)/python -m tools.screenshots

# Rewrites golden files and the published schema from what the code does now; read the diff.
golden: $(READY)
	ODSCEN_GOLDEN=write ODSCEN_SLOW=all $(BIN)/python -m pytest -q -m golden

# Writes maps/*.xodr again.
maps: $(READY)
	$(BIN)/python -m tools.make_maps

# A town with 140 junctions, for trials of scale.
large-town: $(READY)
	$(BIN)/python -m tools.make_maps --only large_town -o build

check-maps: $(QC)
	build/qc/bin/python tools/check_maps.py maps/*.xodr

# ASAM's own checks and schemas; they need NumPy 1, hence an environment of their own.
$(QC):
	$(PYTHON) -m venv build/qc
	build/qc/bin/pip install --quiet --disable-pip-version-check 'asam-qc-opendrive>=1.0,<2' 'asam-qc-openscenarioxml>=1.0,<2'
	touch $@

$(READY): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "odscen needs Python 3.11 or newer; this is " + sys.version.split()[0])'
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --upgrade 'pip>=25.1'
	$(BIN)/python -m pip install --quiet --editable '.[png]' --group dev
	$(BIN)/python -m compileall -q src
	touch $@

$(DOCS): pyproject.toml | $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --group docs
	touch $@

$(MODULES): frontend/package-lock.json frontend/package.json | $(READY)
	$(NPM) ci --no-progress
	touch $@

# Setting up has built it once; the sources may be newer.
$(PAGE): $(PAGE_SOURCES) $(MODULES) | $(READY)
	$(NPM) run build

clean:
	rm -rf .venv demo bench/out build/browser frontend/node_modules $(dir $(PAGE))
