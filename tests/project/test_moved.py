"""Old import paths lead to the modules that moved, and say so."""

import importlib
import subprocess
import sys

import pytest

from cases.files.modules import where_they_run
from rom import moved
from rom.mbs.analysis.linearize import linearize
from rom.mbs.integrate.consistent_start import initial_state
from rom.mbs.results.state import Memory, State

# they run in the environments of other programs
SCRIPTS = {f"rom.bench.peers.{name}" for name in ("beams", "craig_bampton", "ffrf", "ross_films")}
IMPORTED = [old for old, new in moved.NEW_PATHS.items() if new not in SCRIPTS]


@pytest.mark.parametrize("old", where_they_run(IMPORTED))
def test_an_old_path_is_the_module_itself_and_warns(old, monkeypatch):
    if old.startswith("rom.fe."):
        pytest.importorskip("dolfinx", reason="modules of rom.fe need it")
    for name in [name for name in sys.modules if name == old or name.startswith(f"{old}.")]:
        monkeypatch.delitem(sys.modules, name)
    with pytest.warns(DeprecationWarning, match=f"^{old} is {moved.NEW_PATHS[old]} now") as caught:
        found = importlib.import_module(old)
    assert found is importlib.import_module(moved.NEW_PATHS[old])
    assert found.__spec__.name == found.__name__ == moved.NEW_PATHS[old]
    assert not [w for w in caught if "moved.py" in w.filename]


def test_no_old_path_hides_a_module():
    assert all(importlib.util.find_spec(new).origin for new in moved.NEW_PATHS.values())
    assert not set(moved.NEW_PATHS) & set(moved.NEW_PATHS.values())


def test_the_warning_names_the_line_that_imports():
    code = "import warnings\nwarnings.simplefilter('always')\n\nfrom rom.mbs.alpha import advance"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stderr.startswith("<string>:4: DeprecationWarning: rom.mbs.alpha is ")


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_names_are_found_where_they_were():
    """Also those that left their module, and those of modules whose place a package took."""
    state = importlib.import_module("rom.mbs.state")
    assert (state.State, state.Memory, state.initial_state) == (State, Memory, initial_state)
    assert importlib.import_module("rom.mbs.linearize").linearize is linearize
    for package, module in FRONTS.items():
        front, behind = importlib.import_module(package), importlib.import_module(module)
        assert front.__all__ and not front.__name__.startswith("rom.moved")
        for name in set(front.__all__) - NEW_IN_FRONTS:
            assert getattr(front, name) is getattr(behind, name), f"{package}.{name}"


NEW_IN_FRONTS = {
    *(
        "in_late_wind read_modes read_responses write_responses Limit Rock modes motion arch "
        "drawn minimum_thickness stands wall BaseMotion MovingLoad PointLoad SupportMotion Wind "
        "facing Table ramp read_record recorded rectangle sine Joint read_joints load_factor "
        "Motion simulate substructured_modes"
    ).split()
}
FRONTS = {
    "rom.eigen": "rom.eigen.verbs",
    "rom.checks": "rom.checks.gates",
    "rom.report": "rom.report.html",
    "rom.bench": "rom.bench.benchmarks",
    "rom.mbs.integrate": "rom.mbs.integrate.simulation",
    "rom.mbs.parts": "rom.mbs.parts.bodies",
    "rom.fe.mesh": "rom.fe.mesh.read",
    "rom.io.sid": "rom.io.sid.format",
    "rom.components.masonry": "rom.components.masonry.stones",
    "rom.cyclic.blades": "rom.cyclic.blades.blade",
}
