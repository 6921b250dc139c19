"""Before anything numerical is loaded: one thread per process, mpirun as root; what begins."""

import os
import re
import signal
from importlib.util import find_spec

import pytest

import rom.fe  # noqa: F401  dolfinx of a wheel finds MPI only after it
from cases.long import ABSENT, LONGEST_FIRST, ONCE, ROM_LONG
from cases.paths import TESTS

# a shell lets what it starts in the background ignore Ctrl-C, and processes pass that on
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
os.environ["OMP_NUM_THREADS"] = "1"
os.environ.setdefault("OMPI_ALLOW_RUN_AS_ROOT", "1")
os.environ.setdefault("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
os.environ.setdefault("OMPI_MCA_rmaps_base_oversubscribe", "1")
# processes that wait for others leave the core to them
os.environ.setdefault("OMPI_MCA_mpi_yield_when_idle", "1")
os.environ.setdefault("MPIR_CVAR_POLLS_BEFORE_YIELD", "1")


LIGHT_HALF = "not fenicsx and not once"  # what `make test` runs without FEniCSx, and only there


def belongs_to_once(path):
    """Whether a file is named in `ONCE`, or skips itself where a library is absent."""
    named = any(path.is_relative_to(TESTS / place) for place in ONCE)
    skips = rf'^(\w+ = )?pytest\.importorskip\("({"|".join(ABSENT)})'
    return named or re.search(skips, path.read_text(), re.MULTILINE)


@pytest.hookimpl(tryfirst=True)  # before -m chooses
def pytest_collection_modifyitems(config, items):
    """Leave to `make long` what is marked so; begin with what takes longest, all else in order."""
    once = [path for path in {item.path for item in items} if belongs_to_once(path)]
    for item in items:
        if item.path in once:
            item.add_marker("once")
    left = [] if ROM_LONG else [item for item in items if item.get_closest_marker("long")]
    if left:
        config.hook.pytest_deselected(items=left)
        items[:] = [item for item in items if not item.get_closest_marker("long")]
    rank = {TESTS / name: k for k, name in enumerate(LONGEST_FIRST)}
    items.sort(key=lambda item: rank.get(item.path, len(rank)))


def pytest_runtest_setup(item):
    """What is marked `fenicsx` needs it, in whatever way it is started."""
    if item.get_closest_marker("fenicsx"):
        for name in ("dolfinx", "gmsh"):
            pytest.importorskip(name, reason=f"{name} is not installed")


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item):
    """What the light half skips is run nowhere: it needs the mark `once`."""
    report = (yield).get_result()
    light = item.config.option.markexpr == LIGHT_HALF and not find_spec("dolfinx")
    if light and report.skipped:
        report.outcome = "failed"
        report.longrepr = f"{item.nodeid} is skipped here and runs nowhere: mark it `once`"
