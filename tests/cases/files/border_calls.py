"""A legal call of every public callable of the core, from small objects that are made once.

What components refuse beyond their annotations stands in tables of their own tests.
"""

import inspect
import os
from dataclasses import fields, is_dataclass, replace
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace

import numpy as np
from scipy.io import mmwrite

import rom
import rom.report
import rom.view
from cases.files.toml_files import PENDULUM
from cases.mbs.mechanisms import rotor
from cases.solid import KINDS, STEEL, block, composite, reduced
from cases.wheels import beam_ring, bladed_model, bladed_ring
from rom.components import cosserat
from rom.eigen.scipy import SciPyOperators
from rom.mbs.elements import springs
from rom.reduction.interfaces.connection import connect

X, Y, Z = np.eye(3)
TOGETHER = ((("a", "tip"), ("b", "root")),)
FENICSX = find_spec("dolfinx") is not None
# classes that are public without standing in rom: what public functions return and take
ALSO = {
    "Solution": rom.mbs.Solution,
    "State": rom.mbs.State,
    "modes_figure": rom.report.modes,
    "motion_figure": rom.report.motion,
}
# of a public class, for `rom.simulate` alone, which fills the folder of a motion by them, and for
# FMUs, whose communication steps have any length
INNER = {"Keeping.begin", "Keeping.due", "Keeping.write"}
INNER |= {"Stepper.advance", "Stepper.recall", "Stepper.start"}
# (callable, argument) -> wrong values that would be legal and cost time
SKIPPED = {
    ("equilibrium", "steps"): {"million"},
    ("simulate", "t_end"): {"million", "1e300", "1.5"},
}


@cache
def mechanism_file():
    with TemporaryDirectory() as folder:
        path = Path(folder) / "pendulum.toml"
        path.write_text(PENDULUM)
        return rom.read_mechanism(path)


model = cache(lambda: block(cells=(3, 1, 1)))
behind = cache(lambda: block(cells=(3, 1, 1), origin=(1.0, 0.0, 0.0)))  # that block
body = cache(lambda: reduced(3, model()))
solution = cache(lambda: rom.simulate(mechanism(), t_end=2e-3, dt=1e-3))
ring = cache(lambda: bladed_ring(4))
spinning = cache(lambda: beam_ring(6, per_sector=3, EA=1e3, rotary=0.1))
mistuned = cache(lambda: rom.mistuned_wheel(ring(), 1))
blade = cache(lambda: rom.reduced_blade(wheel().parts, wheel().model, n_modes=1))
bladed = cache(lambda: rom.bladed_wheel(wheel().parts, 2))
reduced_run_up = cache(lambda: wheel().run_up.reduced(1))


@cache
def models_in_a_row():
    """Two models with an interface of one name where they meet."""
    (root, end), (start, tip) = (m.interfaces.values() for m in (model(), behind()))
    of = {"a": {"root": root, "joint": replace(end, name="joint")},
          "b": {"joint": replace(start, name="joint"), "tip": tip}}  # fmt: skip
    return {"a": replace(model(), interfaces=of["a"]), "b": replace(behind(), interfaces=of["b"])}


@cache
def pieces():
    return rom.reduce_pieces(models_in_a_row(), reference="root", method=rom.Guyan(), certify=False)


@cache
def bodies():
    """Two bodies in a row."""
    return {
        "a": body(),
        "b": rom.reduce(behind(), method=rom.Guyan(), interfaces=KINDS, certify=False),
    }


@cache
def free():
    """The same for coupling by forces."""
    return {
        "a": rom.substructure(model(), n_modes=1, interfaces=KINDS),
        "b": rom.substructure(behind(), n_modes=1, interfaces=KINDS),
    }


@cache
def regions():
    return composite(
        {"web": STEEL, "rest": STEEL}, lambda c: "web" if c[0] < 1 else "rest", cells=(3, 1, 1)
    )


def mechanism():
    """A pendulum with a flexible body welded to it, a slider and a wheel."""
    mech = rom.Mechanism()
    marks = {"a": (0, 0, 0.5), "b": (0, 0, -0.5), "c": (0, 0, 0)}
    arm = mech.add_rigid("arm", mass=1.0, inertia=(1, 1, 1), at=(0, 0, -0.5), markers=marks)
    ground = mech.ground.marker((0, 0, 0))
    mech.revolute("hinge", ground, arm.marker("a"), axis=X)
    beam = mech.add_flexible("beam", body(), at=(0, 0, -1.0) - body().marker("root").point)
    mech.fixed("weld", arm.marker("b"), beam.marker("root"))
    return mech


def driven(*, free=True):
    """A mass on a spring along x, on a table that a drive shakes; the mass may be driven too."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    for name in ("table", "mass"):
        part = mech.add_rigid(name, mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0),
                              markers={"c": (0, 0, 0), "d": (1, 0, 0)})  # fmt: skip
        mech.prismatic(f"rail of {name}", mech.ground.marker((0, 0, 0)), part.marker("c"), axis=X)
    mech.drive("shaker", "rail of table", lambda t: 0.0 * t)
    if not free:
        mech.drive("second", "rail of mass", lambda t: 0.0 * t)
    one, two = (mech.parts[name] for name in ("table", "mass"))
    mech.spring_damper("spring", one.marker("c"), two.marker("d"), stiffness=100.0, damping=1.0)
    return mech


def rod():
    section = {"stretch": 1e3, "bend": 1.0, "mass": 1.0, "inertia": 1e-3}
    return cosserat.body(cosserat.straight(1.0, 2, **section))


@cache
def wheel():
    """What only finite elements can make: the sector of a bladed wheel."""
    made = bladed_model(6, degree=1, cells=(4, 2, 2, 2), blade=(1, 3))
    of = rom.CyclicSector.from_model
    sector = rom.rotating_sector(of(made, fixed=("bore",), regions=("blade",)), made)
    parts = rom.substructured_sector(sector, made, n_modes=1, n_blade_modes=1)
    heated = rom.Heat(1e-5, 1.0)
    run_up = rom.spin_up(of(made, fixed=("bore",)), made, speed=10.0, n_states=2)
    return SimpleNamespace(model=made, sector=sector, parts=parts, heat=heated, run_up=run_up)


def operators():
    return SciPyOperators(model().K, model().M, rom.eigen.rigid_motions(model().points))


def files():
    """Make the files that a call reads, once in the folder of the test."""
    if os.path.exists("M.mtx"):
        return
    rom.save(body(), "body.rom.npz")
    rom.save_state(solution().final, "state.npz")
    rom.export(body(), "body.SID_FEM")
    for name in "KM":
        mmwrite(f"{name}.mtx", getattr(model(), name))


def spring(stiffness):
    """A mechanism of one parameter."""
    mech = driven()
    one, two = (mech.parts[name] for name in ("table", "mass"))
    mech.spring_damper("more", one.marker("c"), two.marker("d"), stiffness=stiffness)
    return mech


def nothing(t, parameters, motion, memory, out):
    """A law of no force."""


def lawful():
    mech = driven()
    mech.law("law", nothing, mech.parts["mass"].marker("c"), compiled=False)
    return mech


def marked(mech=None):
    mech = driven() if mech is None else mech
    return mech, mech.parts["mass"].marker("c")


DEFAULTS = {  # argument -> legal value
    "acceleration": lambda: X,
    "body": body,
    "boundary": lambda: np.arange(12),
    "build": lambda: spring,
    "fixed": lambda: ("root",),
    "interface": lambda: model().interfaces["root"],
    "interfaces": lambda: KINDS,
    "labels": lambda: tuple(f"{k}" for k in range(12)),
    "law": lambda: rom.mbs.Impact(stiffness=1.0),
    "loads": lambda: {"tip": (1.0, 0, 0, 0, 0, 0)},
    "mechanism": driven,
    "method": rom.Guyan,
    "model": model,
    **dict.fromkeys(("n", "n_modes"), lambda: 1),
    "ops": operators,
    "parameters": lambda: {"stiffness": 2.0},
    "reference": lambda: "root",
    "solution": solution,
    "state": lambda: None,
    "title": lambda: "title",
    "caption": lambda: "caption",
    "units": lambda: "mm-t-s",
}


GIVEN = {  # callable -> legal values of its own
    "Report.warn_of_failures": lambda: {"of": "a check"},
    "campbell": lambda: {"mechanism": lambda speed: rotor(speed), "speeds": [1.0, 2.0]},
    "check": lambda: {"record": body()},
    "check_law": lambda: {"mechanism": lawful(), "name": "law"},
    "craig_bampton": lambda: {"K": model().K, "M": model().M},
    "equilibrium_sensitivity": lambda: {"output": lambda mech, state: state.q[0]},
    "export": lambda: {"path": "out.SID_FEM"},
    "frequency_response": lambda: {
        "frequencies": [1.0], "force": marked()[1], "motion": marked()[1],
    },
    "inverse_dynamics": lambda: {"mechanism": driven(free=False), "t": [0.0, 1e-3]},
    "linearize": dict,
    "example": lambda: {"name": "beam.geo"},
    "load": lambda: {"path": "body.rom.npz"},
    "load_state": lambda: {"path": "state.npz"},
    "modes": lambda: {"n": 1},
    "motion_sensitivity": lambda: {"result": lambda stiffness: 2 * stiffness},
    "read_component": lambda: {"path": "body.toml"},
    "read_mechanism": lambda: {"path": "mechanism.toml"},
    "read_model": lambda: {
        "K": "K.mtx", "M": "M.mtx", "nodes": (np.arange(1, 17), model().points),
        "interfaces": {"root": [1, 2, 3, 4]},
    },
    "read_sid": lambda: {"path": "body.SID_FEM"},
    "reduce": lambda: {"method": rom.Guyan(), "interfaces": KINDS, "certify": False},
    "certify_pieces": lambda: {
        "pieces": pieces(), "models": models_in_a_row(),
        "nonlinear": rom.Geometric(loads={"tip": (0, 1.0, 0, 0, 0, 0)}),
    },
    "reduce_pieces": lambda: {"models": models_in_a_row()},
    "release": lambda: {"state": rom.equilibrium(driven())},
    "save": lambda: {"path": "out.rom.npz"},
    "save_state": lambda: {"path": "out.npz", "state": solution().final},
    "second_order_balanced_truncation": lambda: {
        "K": np.diag([1.0, 2.0]), "M": np.eye(2), "D": 0.1 * np.eye(2), "B": np.ones((2, 1)),
        "C": np.ones((1, 2)), "r": 1,
    },
    "simulate": lambda: {"t_end": 1e-3, "dt": 1e-3},
    "Stepper": lambda: {"mechanism": driven(), "dt": 1e-3},
    "Stepper.step": lambda: {"values": ()},
    "snapshot": lambda: {"state": rom.equilibrium(driven())},
    "surface_load": lambda: {"pressure": 1.0},
    "transmissibility": lambda: {"frequencies": [1.0], "drive": "shaker", "motion": marked()[1]},
    "certify_motion": lambda: {"richer": {"beam": body()}},
    "write_animation": lambda: {"path": "out.glb", "frames": 2},
    "write_body_fmu": lambda: {"path": "nowhere/out.fmu"},
    "write_fmu": lambda: {"path": "out.fmu", "script": "none.py", "dt": 1e-3},
    "write_mechanism_fmu": lambda: {"file": mechanism_file(), "path": "out.fmu"},
    "write_history": lambda: {"path": "out.csv"},
    "write_report": lambda: {"path": "out.html", "sections": {"numbers": ["text"]}},
    "write_stress": lambda: {"path": "out.vtu", "q": np.zeros(body().n_modes)},
    "write_stress_history": lambda: {"path": "out.pvd", "body": "beam"},
    # methods
    "Assembly.reduced": lambda: {"n_interface": 3},
    "Basis.project": lambda: {"A": np.eye(2)},
    "Characteristic.kinds": lambda: {"connection": connect(operators(), model(), {"root": "full"})},
    "FlexibleBody.rotating_frequencies": lambda: {"speed": 1.0, "axis": Z},
    "FlexibleBody.for_motion": lambda: {"motion": solution(), "name": "beam", "tol": 0.1},
    "FlexibleBody.marker": lambda: {"name": "root"},
    "FlexibleBody.beyond_range": lambda: {"q": np.zeros((1, body().n_modes))},
    "FlexibleBody.mean_rows": lambda: {"fixed": {"tip": "x"}},
    "Material.from_units": lambda: {"E": 210e3, "nu": 0.3, "rho": 7.85e-9},
    "Orthotropic.from_units": lambda: {
        "E": (1e3,) * 3, "nu": (0.3,) * 3, "G": (4e2,) * 3, "rho": 1e-9,
    },
    "Pieces.add_to": lambda: {"mech": rom.Mechanism(), "name": "beam"},
    "ModalDamping.matrix": dict,
    "Solution.*": lambda: {"body": "arm", "t": 1e-3, "marker": "a", "instant": 0, "name": "hinge"},
    "Solution.drive_load": lambda: {"name": "shaker"},
}  # fmt: skip
READERS = {"load", "load_state", "read_model", "read_sid"}  # of files that must be there
OF_ONE_NUMBER = """
AssumedModes BalancedTruncation CraigBampton EnhancedCraigBampton FreeFree Herting Polynomial Rubin
""".split()
OF_A_RANGE = ("Density", "Thickness", "YoungsModulus")  # which have no border
OBJECTS = {  # class -> an object of it: legal arguments of the class, and owner of its methods
    **{name: partial(getattr(rom, name), 1) for name in OF_ONE_NUMBER},
    **{name: partial(getattr(rom, name), None, 0.9, 1.1) for name in OF_A_RANGE},
    "Assembly": lambda: rom.Assembly(bodies(), TOGETHER),
    "Attachment": lambda: rom.Attachment("tip", 1.0),
    "Basis": lambda: rom.Basis(np.eye(2), np.ones(1), ("a", "b")),
    "Characteristic": lambda: rom.Characteristic(rom.Guyan(), 6),
    "DualAssembly": lambda: rom.DualAssembly(free(), TOGETHER),
    "FEModel": model,
    "FlexibleBody": body,
    "FourierLegendre": lambda: rom.FourierLegendre(1, 1),
    "FreeSubstructure": lambda: free()["a"],
    "Guyan": rom.Guyan,
    "Interface": lambda: model().interfaces["root"],
    "Keeping": lambda: rom.Keeping("kept"),
    "Layered": lambda: rom.Layered(((0.0, 1.0),), model().K, model().K, model().K),
    "Material": lambda: STEEL,
    "ModalDamping": lambda: rom.ModalDamping(0.01),
    "Modes": lambda: rom.modes(model(), 1),
    "MomentMatching": rom.MomentMatching,
    "Orthotropic": lambda: rom.Orthotropic((1e9,) * 3, (0.3,) * 3, (4e8,) * 3, 1e3),
    "Pieces": pieces,
    "Geometric": lambda: rom.Geometric({"tip": (0, 1.0, 0, 0, 0, 0)}),
    "Rayleigh": rom.Rayleigh,
    "Region": lambda: rom.Region(model().K, model().M),
    "Report": lambda: rom.Report("title"),
    "Snapshots": lambda: rom.Snapshots(np.eye(12), n=6),
    "SpreadLoad": lambda: rom.mass_load(body(), X),
    "SteadyMotion": lambda: rom.steady_motion(driven()),
    "Stepper": lambda: rom.Stepper(driven(), dt=1e-3),
    "SurfaceMesh": lambda: model().surface,
    "WithLoads": lambda: rom.WithLoads(rom.Guyan()),
    "Mechanism": rom.Mechanism,
    "Solution": solution,
    "Solution.drive_load": lambda: rom.simulate(driven(), t_end=2e-3, dt=1e-3),
    "State": lambda: solution().final,
}
JOIN = {  # of the methods of a mechanism
    **dict.fromkeys(("joint", "joint1"), lambda mech: "hinge"),
    **dict.fromkeys(("axis", "axis1", "vector"), lambda mech: X),
    **dict.fromkeys(("radius", "radius1", "transition_speed", "pitch"), lambda mech: 0.1),
    **dict.fromkeys(("stiffness", "mass", "radius2", "ratio"), lambda mech: 1.0),
    "name": lambda mech: "new",
    "m1": lambda mech: mech.ground.marker((0, 0, 0)),
    "m2": lambda mech: mech.parts["arm"].marker("a"),
    "normal": lambda mech: Z,
    "joint2": lambda mech: "slide",
    "marker": lambda mech: mech.parts["arm"].marker("a"),
    "function": lambda mech: lambda t, *motion: 0.0 * t,
    "law": lambda mech: rom.mbs.Impact(stiffness=1.0),
    "part": lambda mech: mech.parts["beam"],
    "load": lambda mech: rom.mass_load(body(), X),
    "axis2": lambda mech: Y,
    "inertia": lambda mech: (1, 1, 1),
    "at": lambda mech: (0, 0, 0),
    "file": lambda mech: "none.fmu",
    **dict.fromkeys(("inputs", "outputs"), lambda mech: {}),
    "every": lambda mech: 1e-2,
    "body": lambda mech: body(),
}
JOIN_OWN = {
    ("marker", "place"): lambda mech: "arm.a",
    ("add", "element"): lambda mech: springs.Spring(
        *2 * (mech.ground.marker((0, 0, 0)),), 1.0, 0, 0
    ),
    ("add", "family"): lambda mech: springs.SPRINGS_FAMILY,
    ("motor", "law"): lambda mech: lambda t, x, v: 0.0,
    ("stop", "lower"): lambda mech: -1.0,
    ("part", "name"): lambda mech: "arm",
    ("add_nonlinear", "body"): lambda mech: rod(),
    ("bushing", "stiffness"): lambda mech: np.ones(6),
}


def parameters(function):
    variable = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    every = inspect.signature(function).parameters.values()
    return [p for p in every if p.kind not in variable and p.name not in ("self", "cls")]


def given(label, function):
    own = GIVEN.get(label, dict)()
    known = GIVEN.get(f"{label.partition('.')[0]}.*", dict)() | own
    needed = [p.name for p in parameters(function) if p.default is p.empty]
    return {name: known[name] if name in known else DEFAULTS[name]() for name in {*needed, *own}}


@cache
def owner(name):
    return OBJECTS[name]()


def of_function(label, function):
    solution()  # compiles what is not yet: no part of the time that a call may take
    if label in READERS:
        files()
    return function, given(label, function)


def of_class(name, kind):
    if not is_dataclass(kind):
        return kind, given(name, kind)
    made = owner(name)
    known = {p.name for p in parameters(kind)}
    return kind, {f.name: getattr(made, f.name) for f in fields(kind) if f.name in known}


def of_method(label):
    name, _, method = label.partition(".")
    function = getattr(owner(label if label in OBJECTS else name), method)
    return function, given(label, function)


def of_mechanism(method):
    mech = mechanism()
    cart = mech.add_rigid("cart", mass=1.0, inertia=(1, 1, 1), at=(0, 0, 0))
    mech.prismatic("slide", mech.ground.marker((0, 0, 0)), cart.marker((0, 0, 0)), axis=X)
    function, own = getattr(mech, method), {n: x for (of, n), x in JOIN_OWN.items() if of == method}
    needed = {p.name for p in parameters(function) if p.default is p.empty} | set(own)
    return function, {n: (own[n] if n in own else JOIN[n])(mech) for n in needed}


def methods(kind):
    """Public methods of a class that take arguments."""
    for name in dir(kind):
        member = inspect.getattr_static(kind, name)
        plain = isinstance(member, classmethod | staticmethod) or inspect.isfunction(member)
        public = not name.startswith("_") and plain and ".components." not in member.__module__
        if public and parameters(getattr(kind, name)):
            yield name


@cache
def calls():
    """{name of a public callable: what makes it and legal arguments, its parameters}."""
    core = [name for name in rom.__all__ if ".components." not in rom.MODULES[name]]
    core = [name for name in core if rom.MODULES[name] != "rom.errors"]  # which take anything
    public = {name: getattr(rom, name) for name in (*core, *OF_A_RANGE)} | ALSO
    found = {}
    for name, thing in public.items():
        if not inspect.isclass(thing):
            found[name] = partial(of_function, name, thing), parameters(thing)
            continue
        if parameters(thing):
            found[name] = partial(of_class, name, thing), parameters(thing)
        for method in methods(thing):
            label, is_mechanism = f"{name}.{method}", name == "Mechanism"
            if label not in INNER:
                make = partial(of_mechanism, method) if is_mechanism else partial(of_method, label)
                found[label] = make, parameters(getattr(thing, method))
    return found
