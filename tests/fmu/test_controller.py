"""A controller in an FMU moves a flexible arm as the same law in Python, sampled."""

import shutil
import subprocess
import zipfile

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import rom
from cases.beam import stiffened_beam
from cases.mbs.fmu_instance import fmpy
from cases.mbs.mechanisms import simulate_quietly
from cases.paths import TESTS
from cases.refusals import refuses
from rom.errors import ConfigError, FileFormatError, ResourceError, SolverError, UnsafeFileError
from rom.io.fmu import archive, description
from rom.report.run import columns

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="no compiler")
PLACES = {"3": f"binaries/{fmpy.platform_tuple}/c.so", "bare": "c.so", "away": "../c.so"}


@pytest.fixture(scope="module")
def units(tmp_path_factory):
    """Of FMI 2 and 3, without a library, that leads elsewhere; and a text."""
    folder = tmp_path_factory.mktemp("unit")
    for path in (*archive.SOURCES.glob("*.[ch]"), *(TESTS / "fmu").glob("controller*")):
        shutil.copy(path, folder)
    kinds = dict.fromkeys(("angle", "rate", "target"), "input")
    kinds |= dict.fromkeys(("gain", "damping", "fault"), "parameter") | {"torque": "output"}
    every = [description.Variable(name, kind, "1", 0.0) for name, kind in kinds.items()]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(archive, "SOURCES", folder)
        content = description.Content("c", "A controller.", every, 2e-3, "controller.c")
        archive.write_archive(folder / "2.fmu", content)
    made = ["gcc", "-shared", "-fPIC", "-o", folder / "c.so", folder / "controller3.c"]
    subprocess.run(made, check=True)
    for name, place in PLACES.items():
        with zipfile.ZipFile(folder / f"{name}.fmu", "w") as file:
            file.write(folder / "controller3.xml", "modelDescription.xml")
            file.write(folder / "c.so", place)
    (folder / "text.fmu").write_text("text")
    return folder


def arm(law=None, unit=None, told=(), **changed):
    mech = rom.Mechanism(gravity=(0, -9.81, 0))
    body = mech.add_flexible("arm", stiffened_beam(EI=50.0, n_modes=3, stiffened=False))
    mech.add_rigid("hub", mass=1, inertia=(0.1, 0.1, 0.1), at=(0, 0, 0))
    mech.revolute("hinge", "ground", "hub", axis=(0, 0, 1))
    mech.fixed("clamp", "hub", body.marker("root"))
    mech.motor("servo", "hinge", law or (lambda t, x, v: 0.0), every=law and 2e-3)
    mech.force("push", body.marker("tip"), (0, 0, 0))
    if unit:
        inputs = {"angle": "hinge angle", "rate": "hinge.angle rate", "target": lambda t: 0.2 * t}
        inputs |= {"gain": 30, "damping": 3, **dict(told)}
        given = {"inputs": inputs, "outputs": {"torque": "servo"}, "every": 2e-3, "name": "unit"}
        mech.fmu(unit, **given | changed)
    return mech


def moved(mech, t_end=0.2, **options):
    return simulate_quietly(mech, t_end=t_end, dt=1e-3, **options)


@pytest.mark.parametrize("fmi", [2, 3])
def test_it_moves_the_arm_as_the_law_in_python_does_and_goes_on(units, fmi):
    law = moved(arm(lambda t, x, v: -30 * (x - 0.2 * t) - 3 * v))
    mech = arm(unit=units / f"{fmi}.fmu")
    half = moved(mech, 0.1).final
    for sol in (moved(mech, state=half), moved(mech)):
        assert_array_equal(np.r_[sol.q[-1], sol.lam[-1]], np.r_[law.q[-1], law.lam[-1]])
    refuses(ConfigError, "unit", moved, mech, state=half)  # it has gone on, and keeps no states


@pytest.mark.parametrize("name", ["arm tip position y", "arm elastic q1", "hinge moment z"])
def test_it_is_told_what_the_columns_of_a_history_have(units, name):
    told = {"angle": name, "rate": 0, "target": 0, "gain": -1}
    sol = moved(arm(unit=units / "2.fmu", told=told, outputs={"torque": "push.z"}), 0.01)
    _, values = columns(sol)[name.replace("tip", "markers tip")]
    assert_allclose(sol.element("push").force[5:7, 0, 2], values[4], rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(("fault", "why"), [(1, "nan"), (2, "flat"), (3, "1 s"), (4, "SIGABRT")])
def test_what_it_does_wrong_ends_the_run_by_its_name(units, fault, why):
    with pytest.raises(SolverError, match=f"'unit'.*{why}") as told:
        moved(arm(unit=units / "2.fmu", told={"fault": fault}, time_limit=1.0))
    assert told.value.solution.t[-1] == pytest.approx(0.01)


@pytest.mark.parametrize(("unit", "changed", "error", "culprit"), [
    ("bare", {}, ResourceError, "c.so"),
    ("away", {}, UnsafeFileError, "../c.so"),
    ("text", {}, FileFormatError, "no FMU"),
    ("2", {"told": {"speed": 1}}, ConfigError, "speed"),
    ("2", {"told": {"angle": "hinge angel"}}, ConfigError, "angel"),
    ("2", {"told": {"gain": "hinge angle"}}, ConfigError, "gain"),
    ("2", {"outputs": {"force": "servo"}}, ConfigError, "force"),
    ("2", {"outputs": {"torque": "hinge"}}, ConfigError, "hinge"),
    ("2", {"outputs": {}}, ConfigError, "unit"),
])  # fmt: skip
def test_units_and_names_that_do_not_fit_are_refused(units, unit, changed, error, culprit):
    refuses(error, culprit, arm, unit=units / f"{unit}.fmu", **changed)
