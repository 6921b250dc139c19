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

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="no compiler")
KINDS = dict.fromkeys(("angle", "rate", "target"), "input")
KINDS |= dict.fromkeys(("gain", "damping", "fault"), "parameter") | {"torque": "output"}
XML3 = """<fmiModelDescription fmiVersion="3.0" modelName="c" instantiationToken="c">
<CoSimulation modelIdentifier="c"/><ModelVariables>{}</ModelVariables><ModelStructure/>
</fmiModelDescription>"""
READ = ("arm tip position y", "arm.velocity x", "arm elastic q1", "hinge moment z", "hinge angle")


@pytest.fixture(scope="module")
def units(tmp_path_factory):
    """Of FMI 2, of FMI 3, without a library, that leads elsewhere, and no archive."""
    folder = tmp_path_factory.mktemp("unit")
    for path in (*archive.SOURCES.glob("*.[ch]"), *(TESTS / "fmu").glob("*.c")):
        shutil.copy(path, folder)
    every = [description.Variable(name, kind, "1", 0.0) for name, kind in KINDS.items()]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(archive, "SOURCES", folder)
        content = description.Content("c", "A controller.", every, 2e-3, "controller.c")
        archive.write_archive(folder / "2.fmu", content)
    compiled = ["gcc", "-shared", "-fPIC", "-o", folder / "c.so", folder / "controller3.c"]
    subprocess.run(compiled, check=True)
    texts = [f'<Float64 name="{name}" valueReference="{k}" causality="{kind}"/>'
             for k, (name, kind) in enumerate(KINDS.items())]  # fmt: skip
    places = {"3": f"binaries/{fmpy.platform_tuple}/c.so", "bare": "c.so", "away": "../c.so"}
    for name, place in places.items():
        with zipfile.ZipFile(folder / f"{name}.fmu", "w") as file:
            file.writestr("modelDescription.xml", XML3.format("".join(texts)))
            file.write(folder / "c.so", place)
    (folder / "text.fmu").write_text("text")
    return folder


def arm(law=None, unit=None, fault=0, told=(), **changed):
    mech = rom.Mechanism(gravity=(0, -9.81, 0))
    body = mech.add_flexible("arm", stiffened_beam(EI=50.0, n_modes=3, stiffened=False))
    mech.add_rigid("hub", mass=1, inertia=(0.1, 0.1, 0.1), at=(0, 0, 0))
    mech.revolute("hinge", "ground", "hub", axis=(0, 0, 1))
    mech.fixed("clamp", "hub", body.marker("root"))
    mech.motor("servo", "hinge", law or (lambda t, x, v: 0.0), every=law and 2e-3)
    mech.force("push", body.marker("tip"), (0, 0, 0))
    if unit:
        inputs = {"angle": "hinge angle", "rate": "hinge.angle rate", "target": lambda t: 0.2 * t}
        inputs |= {"gain": 30, "damping": 3, "fault": fault, **dict(told)}
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


@pytest.mark.parametrize("name", READ)
def test_it_is_told_what_the_columns_of_a_history_have(units, name, tmp_path):
    told = {"angle": name, "rate": 0, "target": 0, "gain": -1}
    sol = moved(arm(unit=units / "2.fmu", told=told, outputs={"torque": "push.z"}), 0.01)
    rom.write_history(sol, tmp_path / "h.csv")
    table = np.genfromtxt(tmp_path / "h.csv", delimiter=",", names=True, deletechars="")
    (column,) = (x for x in table.dtype.names if x.replace("_markers", "").startswith(
        name.replace(".", " ").replace(" ", "_") + "_["))  # fmt: skip
    push = sol.element("push").force[:, 0, 2]
    assert_allclose(push[5:7], table[column][4], rtol=1e-9, atol=1e-12)  # up to the next sample


@pytest.mark.parametrize(("fault", "why"), [(1, "nan"), (2, "battery"), (3, "1 s"), (4, "SIGABRT")])
def test_what_it_does_wrong_ends_the_run_by_its_name(units, fault, why):
    with pytest.raises(SolverError, match=f"'unit'.*{why}") as told:
        moved(arm(unit=units / "2.fmu", fault=fault, time_limit=1.0))
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
])  # fmt: skip
def test_units_and_names_that_do_not_fit_are_refused(units, unit, changed, error, culprit):
    refuses(error, culprit, arm, unit=units / f"{unit}.fmu", **changed)
