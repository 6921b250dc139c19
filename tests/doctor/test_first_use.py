"""First uses: what is compiled for them ahead, and what is then left to compile."""

import json
import os

import pytest

from benchmarks.benchmarks import start
from cases.command import environment, python
from cases.command import rom as command
from cases.long import few
from rom.doctor import first_use
from rom.doctor.probes import compiled

USED = """
import importlib, pkgutil
import rom.components, rom.mbs
from rom.doctor.first_use import CASES
from rom.mbs.compiler.cache import CODE_FILES
modules = [importlib.import_module(module.name) for package in (rom.mbs, rom.components)
           for module in pkgutil.walk_packages(package.__path__, package.__name__ + ".")]
for case in CASES.values():
    case()
found = [getattr(x, "kernel", x) for module in modules for x in vars(module).values()]
made = {x.py_func: x for x in found if type(x).__name__ == "CPUDispatcher"}
called = {getattr(f.__globals__.get(name), "py_func", None)
          for f in CODE_FILES for name in f.__code__.co_names}
first = {f: x for f, x in made.items() if f in CODE_FILES and f not in called}
print(len(first), *sorted(f.__qualname__ for f, x in first.items() if not x.overloads))
"""


@pytest.mark.long
@pytest.mark.once
def test_cases_of_first_use_ask_for_all_that_can_be_compiled():
    """Whatever no other kernel calls, every stage too, has been called or linked by a case."""
    done = python("-c", USED, timeout=900)
    assert done.returncode == 0, done.stderr
    count, *unused = done.stdout.split()
    assert int(count) > 30 and not unused


FIRST_MOTIONS = """
import numba, numpy as np
from numba.core import event
import rom
from benchmarks.models import KINDS, bar, slider_crank

class Compiled(event.Listener):
    names = []
    def on_start(self, event):
        self.names.append(event.data["dispatcher"].__name__)
    def on_end(self, event):
        pass

event.register("numba:compile", Compiled())
pendulum = rom.Mechanism(gravity=(0, 0, -9.81))
bob = pendulum.add_rigid("bob", mass=2.0, inertia=(1e-3, 2e-3, 2e-3), at=(0.5, 0, 0),
                         markers={"pin": (-0.5, 0, 0)})
pendulum.revolute("hinge", pendulum.ground.marker((0, 0, 0)), bob.marker("pin"), axis=(0, 1, 0))
motion = rom.simulate(pendulum, t_end=0.05, dt=1e-3)
rom.audit(motion)
rod = rom.reduce(bar((0.16, 0.02, 0.012), (4, 1, 1)), method=rom.CraigBampton(6), interfaces=KINDS,
                 reference=tuple(KINDS), certify=False)
for reference in ("root", "free"):
    motion = rom.simulate(slider_crank(rod.with_reference(reference)), t_end=1e-3, dt=1e-5)
    motion.reaction("crank pin"), motion.position("slider"), motion.elastic("rod")
rom.audit(motion)
print(len(Compiled.names), *Compiled.names)
numba.njit(lambda x: x)(1.0)
print(len(Compiled.names))
"""


def test_after_the_set_up_first_motions_compile_nothing():
    """As Numba counts, which then counts a function of another kind."""
    done = command("doctor", "--compile", "demo", timeout=600)
    assert done.returncode == 0, done.stderr
    quiet = environment(PYTHONWARNINGS="ignore")
    done = python("-c", FIRST_MOTIONS, env=quiet, timeout=120)
    assert (done.stdout.split(), done.stderr) == (["0", "1"], "")


@pytest.mark.long
@pytest.mark.once
def test_first_uses_are_measured_with_nothing_compiled_and_again():
    """A case of few functions, of which Numba keeps each in a file."""
    name = "best_matching"
    figures = list(start(cases=(name,), again=(name,)))
    assert [(f.case, f.quantity) for f in figures] == [
        (name, "functions compiled"), (name, "processor time"),
        (f"{name}, compiled before", "functions compiled"),
        (f"{name}, compiled before", "processor time"), ("machine", "load"),
    ]  # fmt: skip
    first, seconds, again, short, load = (f.value for f in figures)
    assert (first, again) == (3, 0)
    assert short < seconds and load > 0


@pytest.mark.once
@pytest.mark.parametrize("how", few(1, ["aloud", "--quiet"]))
def test_the_doctor_says_what_it_compiles_unless_asked_not_to(how):
    """In processes that compile nothing, which takes seconds anywhere."""
    more = [] if how == "aloud" else [how]
    env = environment(NUMBA_DISABLE_JIT="1")
    done = command("doctor", "--compile", "demo", "--json", *more, env=env)
    assert done.returncode == 0
    found = json.loads(done.stdout)["findings"]
    assert [f["name"] for f in found] == list(first_use.DEMO_CASES)
    assert {(f["state"], f["value"]) for f in found} == {("ok", "was compiled before")}
    said = done.stderr.splitlines()
    assert len(said) == (2 if how == "aloud" else 0)
    assert all(line.startswith(f"{k} of 2, ") for k, line in enumerate(said, 1))


MEETING = """
import json, pathlib, sys, time
here, case = pathlib.Path(__file__).parent, sys.argv[1]
(here / f"{case}.met").touch()
end = time.monotonic() + 30
while len(list(here.glob("*.met"))) < 2 and time.monotonic() < end:
    time.sleep(0.01)
if case == "crash":
    import os
    os.abort()
print(json.dumps({"name": case, "functions": int(time.monotonic() < end), "seconds": 1.25}))
"""


@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="there is one core")
def test_cases_are_compiled_side_by_side_and_one_that_crashes_takes_none_with_it(
    tmp_path, monkeypatch
):
    """Each of the first two waits for the other one."""
    (tmp_path / "meeting.py").write_text(MEETING)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    found = {f.name: f for f in compiled("meeting", ("one", "crash", "two"))}
    assert found["one"].value == found["two"].value == "1 functions in 1.2 s of the processor"
    assert (found["crash"].state, found["crash"].value) == ("broken", "crashed (SIGABRT)")


def test_what_cannot_be_compiled_is_an_error(monkeypatch, capsys):
    from rom.cli.main import main

    monkeypatch.setattr(first_use, "CASES", {"no such case": None})
    assert main(["doctor", "--compile"]) == 5
    said = capsys.readouterr()
    assert "no such case is broken: failed: KeyError: 'no such case'" in said.err
    assert "broken: failed" in said.out
