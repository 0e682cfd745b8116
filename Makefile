# Two commands: `make run` installs and runs the demo scenario, `make test` runs everything CI runs.
# `make reports` makes the published reports again, `make scanline-report` one of them.
# They use uv where it is on the PATH, else venv and pip.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
UV := $(shell command -v uv 2>/dev/null)

.PHONY: run test clean picture reports multiview-report scanline-report network-report

run: $(VENV)/.installed
	$(BIN)/wsnsim run scenarios/quickstart.yaml --out runs/quickstart --force

test: $(VENV)/.installed-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m pytest -n 2 --dist loadfile

clean:
	rm -rf $(VENV) runs

$(VENV)/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "wsnsim needs Python 3.11 or newer; found $$($(PYTHON) --version 2>&1). Name one: make run PYTHON=python3.12"; exit 2; }
ifdef UV
	$(UV) venv --quiet --python $(PYTHON) $(VENV)
else
	$(PYTHON) -m venv $(VENV)
endif

$(VENV)/.installed: pyproject.toml $(VENV)/bin/python
ifdef UV
	$(UV) pip install --quiet --python $(BIN)/python -e .
else
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e .
endif
	@touch $@

$(VENV)/.installed-test: pyproject.toml $(VENV)/.installed
ifdef UV
	$(UV) pip install --quiet --python $(BIN)/python -e '.[test]'
else
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[test]'
endif
	@touch $@

$(VENV)/.installed-reports: pyproject.toml $(VENV)/.installed
ifdef UV
	$(UV) pip install --quiet --python $(BIN)/python -e '.[reports]'
else
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -e '.[reports]'
endif
	@touch $@

# The pages of the published systems (hours).
reports: multiview-report scanline-report

# The studies behind reports/multiview.md (hours; what runs/ has of them is not run again), then the page,
# its figures and its table of all runs.
MULTIVIEW_STUDIES := variants factors radio deployments

multiview-report: $(VENV)/.installed-reports
	for study in $(MULTIVIEW_STUDIES); do \
		$(BIN)/wsnsim sweep scenarios/studies/multiview_$$study.yaml --out runs/multiview-$$study || exit 1; \
	done
	$(BIN)/python -m wsnsim.claims --runs runs --out reports

# The same for reports/scanline.md (two hours), with the CPU times of the tracker's step.
SCANLINE_STUDIES := cameras priors tradeoff occluders trackers hull lab radio

scanline-report: $(VENV)/.installed-reports
	for study in $(SCANLINE_STUDIES); do \
		$(BIN)/wsnsim sweep scenarios/studies/scanline_$$study.yaml --out runs/scanline-$$study || exit 1; \
	done
	$(BIN)/wsnsim bench scanline --json > runs/scanline-bench.json
	$(BIN)/python -m wsnsim.claims scanline --runs runs --out reports

# The network beside theory, a Monte Carlo and ns-3 (a few minutes): reports/network.md and .csv. DATA names the
# folder of public traces, whose section is left out without them.
network-report: $(VENV)/.installed
	$(BIN)/python -m wsnsim.claims network --out reports $(if $(DATA),--data $(DATA))

# The README's picture: the report of the demo as a browser shows it (needs chromium).
picture: run
	chromium --headless --no-sandbox --disable-gpu --hide-scrollbars --window-size=1280,5200 \
		--virtual-time-budget=8000 --screenshot=runs/quickstart/page.png \
		"file://$(CURDIR)/runs/quickstart/report.html"
	$(BIN)/python -c "from PIL import Image; \
		Image.open('runs/quickstart/page.png').convert('RGB').crop((80, 1310, 1200, 3590)) \
		.resize((700, 1425)).quantize(160).save('reports/quickstart.png', optimize=True)"
