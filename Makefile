# Two commands do everything, set-up included: make demo, make test
PYTHON ?= python3
VENV := .venv
RUN := $(VENV)/bin

.PHONY: demo test bench examples clean

demo: $(VENV)/ready
	$(RUN)/mlscorr demo -o demo --overwrite

test: $(VENV)/ready
	$(RUN)/ruff check .
	$(RUN)/ruff format --check .
	$(RUN)/python -m pytest -n 2 --dist loadfile

bench: $(VENV)/ready
	$(RUN)/python benchmarks/bench.py
	$(RUN)/python benchmarks/bench_simulate.py
	$(RUN)/python benchmarks/bench_collocation.py
	$(RUN)/python benchmarks/bench_targets.py 2
	$(RUN)/python benchmarks/bench_gap.py
	$(RUN)/python benchmarks/bench_render.py

examples: $(VENV)/ready
	for script in examples/*.py examples/real/*_gap.py; do $(RUN)/python $$script || exit 1; done

$(VENV)/ready: pyproject.toml setup.sh
	PYTHON=$(PYTHON) VENV=$(VENV) sh setup.sh
	touch $@

clean:
	rm -rf $(VENV) demo
