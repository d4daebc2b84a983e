# Three commands do everything, set-up included: make demo, make docs, make test. The first installs
# the package alone, the others what tests and manual need
PYTHON ?= python3
VENV := .venv
RUN := $(VENV)/bin

.PHONY: demo test test-all docs wheel faults folders bench bench-scale tables assets pages examples clean

demo: $(VENV)/package
	$(RUN)/mlscorr demo -o demo --overwrite

# In about ten minutes on two cores; test-all, in half an hour, runs what is marked long as well
test test-all: $(VENV)/ready
	$(RUN)/ruff check .
	$(RUN)/ruff format --check .
	$(RUN)/mypy
	$(RUN)/python -m pytest -n 2 --dist loadfile $(if $(filter test,$@),-m "not long")

# The manual, build/manual/index.html; its notebooks and examples run, and a warning is an error
docs: $(VENV)/ready
	$(RUN)/sphinx-build -q -W --keep-going -c docs -d build/doctrees . build/manual

# The wheel, installed by itself in an environment that knows nothing else, runs the demo
wheel: $(VENV)/package
	rm -rf build/lib build/wheel
	$(RUN)/python -m pip wheel --quiet --no-deps -w build/wheel .
	$(PYTHON) -m venv build/wheel/venv
	build/wheel/venv/bin/python -m pip install --quiet build/wheel/mlscorr-*.whl
	cd build/wheel && venv/bin/mlscorr demo -o demo

# The whole matrix of docs/faults.md, of which make test tries a part; SHARE=0.1 a tenth of it
faults: $(VENV)/ready
	MLSCORR_FAULTS=$(or $(SHARE),1) $(RUN)/python -m pytest -n 2 tests/faults

# Folders as vendors and offices have them, through init, check and correct; make test takes a part
folders: $(VENV)/ready
	$(RUN)/python -m tests.beds.folders_of_others

bench: $(VENV)/ready
	$(RUN)/python benchmarks/bench.py
	$(RUN)/python benchmarks/bench_start.py
	$(RUN)/python benchmarks/bench_simulate.py
	$(RUN)/python benchmarks/bench_collocation.py
	$(RUN)/python benchmarks/bench_tie_solver.py
	$(RUN)/python benchmarks/bench_ties.py 2
	$(RUN)/python benchmarks/bench_targets.py 2
	$(RUN)/python benchmarks/bench_libraries.py
	$(RUN)/python benchmarks/bench_matching.py
	$(RUN)/python benchmarks/bench_gap.py
	$(RUN)/python benchmarks/bench_render.py

# Two workers against one, a project against its survey, and runs that are killed and resumed
bench-scale: $(VENV)/ready
	$(RUN)/python benchmarks/bench_scale.py $(or $(DRIVES),2) $(or $(KILLS),5)

# TABLES="scenarios results" writes these alone, CHECK=FOLDER is one of mlscorr blind
tables: $(VENV)/ready
	$(RUN)/python benchmarks/readme_tables.py $(TABLES) $(if $(CHECK),--check $(CHECK))

# Draws the pictures of README and docs anew and says which have changed; PICTURES="--write" keeps them
assets: $(VENV)/ready
	$(RUN)/python benchmarks/assets.py $(PICTURES)

# Every kind of page in headless Chromium: widths, print, contrast, keys
pages: $(VENV)/ready
	$(RUN)/python -m pytest -rs tests/report/test_every_page_in_a_browser.py tests/report/test_pages_in_a_browser.py tests/report/gap/test_page.py

examples: $(VENV)/ready
	for script in examples/[0-9]*.py; do $(RUN)/python $$script || exit 1; done

# The package alone, for users; with what tests and manual need, for developers
$(VENV)/package: pyproject.toml setup.sh
	PYTHON=$(PYTHON) VENV=$(VENV) sh setup.sh
	touch $@

$(VENV)/ready: pyproject.toml setup.sh
	PYTHON=$(PYTHON) VENV=$(VENV) EXTRAS='[test,docs]' sh setup.sh
	touch $(VENV)/package $@

clean:
	rm -rf $(VENV) build demo
