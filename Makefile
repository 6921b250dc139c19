# make setup   Debian packages, .venv over them, .venv-light without FEniCSx, and for both what first
#              motions need, compiled on all cores; seconds when done
# make demo    the main job: a flexible slider-crank; pictures and a report in out/
# make test    style, types, the tests that need FEniCSx, then those of the light half without it
# make long    what takes minutes: all demos under mpirun, signals at ten instants; and each test of
#              the light half in the environment where `make test` does not run it; `make -k long`
#              goes on with the next part where one has failed
# make docs    the site, in build/site/; runs its notebooks; pictures of demos that have run stand in it
# make pictures  run every demo, for the site; takes minutes
# make thumbnails  small copies of these pictures, kept in docs/thumbnails/
# make bench   measure speed and memory, NAME=motion for one of what `rom bench --list` names
# make clean   remove what the others have left, but not the environments
PYTHON = .venv/bin/python
# files whose tests try more where there is time, besides what is marked `long`
MORE = $(shell grep -rlE 'ROM_LONG|SHARED_BY' tests --include='test_*.py')
# test files side by side, in the order of tests/conftest.py, so that none of the long ones is last
SIDE_BY_SIDE = -n 2 --dist loadfile --no-loadscope-reorder
LIGHT = .venv-light/bin/python
# what Python compiles of sources is kept even where the system would not
unexport PYTHONDONTWRITEBYTECODE

.PHONY: setup demo test long long-marked long-more long-light-here long-light docs pictures thumbnails bench clean
setup:
	@.ci/setup.sh

demo: setup
	$(PYTHON) demos/demo_slider_crank.py

test: setup
	$(PYTHON) -m ruff check .
	$(PYTHON) -m ruff check --preview --select RUF027 . # a forgotten f before a string
	$(PYTHON) -m ruff format --check .
	MYPY_NUM_WORKERS=2 $(PYTHON) -m mypy
	$(PYTHON) -m pytest -m "fenicsx or once" $(SIDE_BY_SIDE)
	$(LIGHT) -m pytest -m "not fenicsx and not once" -p no:cacheprovider $(SIDE_BY_SIDE)

long: long-marked long-more long-light-here long-light

long-marked: setup
	ROM_LONG=1 $(PYTHON) -m pytest -m long $(SIDE_BY_SIDE)

long-more: setup
	ROM_LONG=1 $(PYTHON) -m pytest -m "not long" $(MORE) $(SIDE_BY_SIDE)

long-light-here: setup
	$(PYTHON) -m pytest -m "not fenicsx and not once" $(SIDE_BY_SIDE)

long-light: setup
	ROM_LONG=1 $(LIGHT) -m pytest -m "not fenicsx and once" -p no:cacheprovider $(SIDE_BY_SIDE)

docs: setup
	$(PYTHON) -m sphinx -W -n -q -D nb_execution_mode=cache docs build/site
	@echo "open build/site/index.html"

pictures: setup
	set -e; for demo in demos/demo_*.py; do $(PYTHON) $$demo -q; done

thumbnails:
	$(PYTHON) docs/site_thumbnails.py

bench: setup
	$(PYTHON) -m rom bench $(NAME)

clean:
	rm -rf out build/site build/notebooks build/jupyter_execute docs/generated docs/notebooks/*.npz
	rm -rf .pytest_cache .ruff_cache .mypy_cache .hypothesis
	find rom benchmarks tests demos meshes -name __pycache__ -prune -exec rm -rf {} +
