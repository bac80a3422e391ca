# Two commands do everything: `make demo` and `make test`. They need Python 3.11 or newer and a network for pip.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
PLUGINS := $(patsubst %/pyproject.toml,%,$(wildcard plugins/*/pyproject.toml))
DISTRIBUTIONS := -e . $(addprefix -e ,$(PLUGINS))

.PHONY: demo test test-slow lint schemas picture clean

$(VENV)/.installed: pyproject.toml $(addsuffix /pyproject.toml,$(PLUGINS))
	@$(PYTHON) -c 'import sys; sys.exit(0 if sys.version_info >= (3, 11) else "estimfw needs Python 3.11 or newer; this is " + sys.version.split()[0] + ". Try: make PYTHON=python3.12 demo")'
	@echo "A virtual environment in $(VENV), with estimfw and its plugins: a minute or two ..."
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check $(DISTRIBUTIONS)
	@touch $@

$(VENV)/.installed-dev: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[dev]' $(DISTRIBUTIONS)
	@touch $@

SITE := site={latitude: 34 deg, longitude: 75 deg, height: 100 m}

demo: $(VENV)/.installed  ## The main job: the attitude of a standing vehicle from its IMU log, and the page that shows how it converged
	@echo "A log of five minutes: an IMU at yaw 30, pitch 2, roll -1 deg, with biases and noise ..."
	$(BIN)/estimfw simulate examples/static_12.yaml --set 'source.rate=100 Hz' --set 'source.duration=300 s' \
	  --set 'initial_attitude={yaw: 30 deg, pitch: 2 deg, roll: -1 deg}' --format csv --output results/demo_log --force
	@echo "... and its attitude, from the log alone (the first run compiles, for some 20 s):"
	$(BIN)/estimfw run examples/imu_log.yaml --set source.file=results/demo_log/imu.csv --set '$(SITE)' --output results/demo --force
	@echo
	@echo "The page with all pictures:  results/demo/report.html"
	@echo "The numbers, for xarray:     results/demo/result.nc"
	@echo "On your own IMU log:         $(BIN)/estimfw run examples/imu_log.yaml --set source.file=LOG --set '$(SITE)'"
	@echo "12 states reduced to 7:      $(BIN)/estimfw explain examples/static_7.yaml"
	@echo "... and what that costs:     $(BIN)/estimfw budget examples/static_7.yaml"

test: $(VENV)/.installed-dev  ## The tests, without the long Monte Carlo
	$(BIN)/python -m pytest -n 2 -m 'not slow'

test-slow: $(VENV)/.installed-dev  ## The long ones alone
	$(BIN)/python -m pytest -n 2 -m slow

lint: $(VENV)/.installed-dev  ## Style, types, import rules, freshness of the schemas
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/mypy tests $(addsuffix /tests,$(PLUGINS)) examples/vendor_sensor/acme_compass conftest.py
	$(BIN)/lint-imports
	$(BIN)/estimfw schema --check

schemas: $(VENV)/.installed  ## Write schemas/ anew
	$(BIN)/estimfw schema --write schemas

picture: $(VENV)/.installed  ## The pictures of the README, made anew
	$(BIN)/estimfw run examples/static_7.yaml --output results/static_7 --force
	cp results/static_7/figures/output_errors_attitude.png docs/static_7.png
	$(BIN)/estimfw run examples/ins_staged.yaml --output results/ins_staged --force
	cp results/ins_staged/figures/state_errors_attitude_error.png docs/ins_staged.png

clean:
	rm -rf $(VENV) results .mypy_cache .ruff_cache .pytest_cache .hypothesis
