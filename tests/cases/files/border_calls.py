"""A legal call of every public callable, from small objects that are made once."""

import inspect
import os
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from functools import cache, partial
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace
from typing import Any

import numpy as np
from scipy.io import mmwrite

import rom
import rom.report
import rom.view
from cases.files.toml_files import PENDULUM
from cases.mbs.mechanisms import rotor
from cases.solid import STEEL, block, composite, reduced
from cases.wheels import beam_ring, bladed_model, bladed_ring
from rom.components import cosserat
from rom.components.gear_mesh.gears.geometry import GearPair
from rom.components.journal_bearing.films.tabulated import table_of
from rom.components.updating.family_model import family_model
from rom.components.updating.normal_equations import responses_at
from rom.eigen.scipy import SciPyOperators
from rom.eigen.verbs import rigid_motions
from rom.mbs.elements import springs
from rom.mbs.elements.contact.impact import Impact
from rom.mbs.results.solution import Solution
from rom.mbs.results.state import State
from rom.reduction.interfaces.connection import connect

X, Y, Z = np.eye(3)
KINDS = {"root": "rbe2", "tip": "rbe2"}
TOGETHER = ((("a", "tip"), ("b", "root")),)
FENICSX = find_spec("dolfinx") is not None
# classes that are public without standing in rom: what public functions return and take
ALSO = {
    "Solution": Solution,
    "State": State,
    "modes_figure": rom.report.modes,
    "motion_figure": rom.report.motion,
}
KEPT = {"RomError", "RomWarning"} | {
    name for name in rom.__all__ if rom.MODULES[name] == "rom.errors"
}  # what is raised takes anything
# of a public class, for `rom.simulate` alone, which fills the folder of a motion by them
INNER = {"Keeping.begin", "Keeping.due", "Keeping.write"}
# (callable, argument) -> wrong values that would be legal and cost time
SKIPPED = {
    ("equilibrium", "steps"): {"million"},
    ("spin_up", "n_states"): {"million"},
    ("spin_up", "speed"): {"million"},
    ("simulate", "t_end"): {"million", "1e300", "1.5"},
}


@dataclass(frozen=True)
class Call:
    """A public callable with legal arguments, all by name."""

    make: Callable[[], tuple[Callable[..., Any], dict[str, Any]]]
    arguments: tuple[str, ...]
    skipped: frozenset[tuple[str, str]]


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
waves = cache(lambda: rom.cyclic_modes(ring(), 1, 1))
blade = cache(lambda: rom.reduced_blade(wheel().parts, wheel().model, n_modes=1))
bladed = cache(lambda: rom.bladed_wheel(wheel().parts, 2))
reduced_run_up = cache(lambda: wheel().run_up.reduced(1))


@cache
def film_bearing():
    """A bearing whose table is made, so that nothing is compiled while a call is timed."""
    bearing = rom.mbs.JournalBearing(0.1, 0.05, 1e-4, cells=(12, 2))
    table_of("any", bearing)
    return bearing


@cache
def models_in_a_row():
    """Two models with an interface of one name where they meet."""
    (root, end), (start, tip) = (m.interfaces.values() for m in (model(), behind()))
    of = {"a": {"root": root, "joint": replace(end, name="joint")},
          "b": {"joint": replace(start, name="joint"), "tip": tip}}  # fmt: skip
    return {"a": replace(model(), interfaces=of["a"]), "b": replace(behind(), interfaces=of["b"])}


@cache
def pieces():
    """Their bodies."""
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


@cache
def family():
    return rom.reduce_parametric(
        regions(), parameters={"E": rom.YoungsModulus("web", 0.9, 1.1)}, method=rom.CraigBampton(2),
        interfaces=KINDS, certify=False, tol=0.1,
    )  # fmt: skip


def measured():
    """Responses of the family at the tip."""
    at = rom.updating.Channels([[1.0, 0.0, 0.0], [1.0, 0.1, 0.08]], [X + Y, X + Z])
    rows = at.rows(family().body, "sensor")
    model = family_model(family(), (rows, rows), {}, {}, ())
    f = np.linspace(1.0, 100.0, 20)
    H = responses_at(model, np.zeros(1), np.array([0.02]), 2 * np.pi * f)
    return rom.updating.Responses(f, H, at, at, 0.9, 10)


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
    """The frames of a rod."""
    section = {"stretch": 1e3, "bend": 1.0, "mass": 1.0, "inertia": 1e-3}
    return cosserat.body(cosserat.straight(1.0, 2, **section))


@cache
def wheel():
    """What only finite elements can make: the sector of a bladed wheel."""
    made = bladed_model(6, degree=1, cells=(4, 2, 2, 2), blade=(1, 3))
    sector = rom.rotating_sector(
        rom.CyclicSector.from_model(made, fixed=("bore",), regions=("blade",)), made
    )
    parts = rom.substructured_sector(sector, made, n_modes=1, n_blade_modes=1)
    heated = rom.Heat(1e-5, 1.0)
    run_up = rom.spin_up(
        rom.CyclicSector.from_model(made, fixed=("bore",)), made, speed=10.0, n_states=2
    )
    return SimpleNamespace(model=made, sector=sector, parts=parts, heat=heated, run_up=run_up)


def operators():
    return SciPyOperators(model().K, model().M, rigid_motions(model().points))


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
    """A mechanism with a law of its own."""
    mech = driven()
    mech.law("law", nothing, mech.parts["mass"].marker("c"), compiled=False)
    return mech


def marked(mech=None):
    """A mechanism and one of its markers."""
    mech = driven() if mech is None else mech
    return mech, mech.parts["mass"].marker("c")


DEFAULTS = {  # argument -> legal value
    "acceleration": lambda: X,
    "body": body,
    "boundary": lambda: np.arange(12),
    "build": lambda: spring,
    "diameter": lambda: 1,
    "fixed": lambda: ("root",),
    "heat": lambda: wheel().heat,
    "interface": lambda: model().interfaces["root"],
    "interfaces": lambda: KINDS,
    "labels": lambda: tuple(f"{k}" for k in range(12)),
    "law": lambda: Impact(stiffness=1.0),
    "loads": lambda: {"tip": (1.0, 0, 0, 0, 0, 0)},
    "mechanism": driven,
    "method": rom.Guyan,
    "model": model,
    "n": lambda: 1,
    "n_blade_modes": lambda: 1,
    "n_modes": lambda: 1,
    "ops": operators,
    "parameters": lambda: {"stiffness": 2.0},
    "reference": lambda: "root",
    "sector": lambda: wheel().sector,
    "share": lambda: 0.5,
    "solution": solution,
    "speed": lambda: 5.0,
    "state": lambda: None,
    "title": lambda: "title",
    "caption": lambda: "caption",
    "units": lambda: "mm-t-s",
    "blades": lambda: [blade()] * 6,
}


def of_wheel():
    return {"model": wheel().model}


def on_its_bore():
    return of_wheel() | {"fixed": ("bore",)}


GIVEN = {  # callable -> legal values of its own
    "Report.warn_of_failures": lambda: {"of": "a check"},
    "bladed_wheel": lambda: {"sector": wheel().parts, "n_waves": 2},
    "campbell": lambda: {"mechanism": lambda speed: rotor(speed), "speeds": [1.0, 2.0]},
    "check": lambda: {"record": body()},
    "check_law": lambda: {"mechanism": lawful(), "name": "law"},
    "craig_bampton": lambda: {"K": model().K, "M": model().M},
    **dict.fromkeys(("cyclic_modes", "mistuned_wheel", "wheel_modes"), lambda: {"sector": ring()}),
    **dict.fromkeys(("heated", "held_solid", "thermal_buckling"), on_its_bore),
    **dict.fromkeys(
        ("heated_sector", "rotating_sector", "substructured_sector", "CyclicSector.from_model",
         "Heat.on"), of_wheel),
    "continuation": lambda: {"span": (0.0, 1e-3)},
    "equilibrium_sensitivity": lambda: {"output": lambda mech, state: state.q[0]},
    "export": lambda: {"path": "out.SID_FEM"},
    "frequency_response": lambda: {
        "frequencies": [1.0], "force": marked()[1], "motion": marked()[1],
    },
    "inverse_dynamics": lambda: {"mechanism": driven(free=False), "t": [0.0, 1e-3]},
    "linearize": dict,
    "periodic_motion": lambda: {"period": 1.0, "steps": 10},
    "periodic_path": lambda: {"span": (1.0, 1.1), "period": 1.0, "steps": 2},
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
    "reduce_parametric": lambda: {
        "model": regions(), "parameters": {"E": rom.YoungsModulus("web", 0.9, 1.1)},
    },
    "certify_pieces": lambda: {
        "pieces": pieces(), "models": models_in_a_row(),
        "nonlinear": rom.Geometric(loads={"tip": (0, 1.0, 0, 0, 0, 0)}),
    },
    "reduce_pieces": lambda: {"models": models_in_a_row()},
    "reduced_blade": lambda: of_wheel() | {"sector": wheel().parts},
    "release": lambda: {"state": rom.equilibrium(driven())},
    "save": lambda: {"path": "out.rom.npz"},
    "save_state": lambda: {"path": "out.npz", "state": solution().final},
    "second_order_balanced_truncation": lambda: {
        "K": np.diag([1.0, 2.0]), "M": np.eye(2), "D": 0.1 * np.eye(2), "B": np.ones((2, 1)),
        "C": np.ones((1, 2)), "r": 1,
    },
    "simulate": lambda: {"t_end": 1e-3, "dt": 1e-3},
    "snapshot": lambda: {"state": rom.equilibrium(driven())},
    "spin_up": lambda: of_wheel() | {"speed": 10.0, "n_states": 2},
    "supported_sector": lambda: {"face": wheel().model.interfaces["bore"], "across": 1.0},
    "surface_load": lambda: {"pressure": 1.0},
    "transmissibility": lambda: {"frequencies": [1.0], "drive": "shaker", "motion": marked()[1]},
    "travelling_modes": lambda: {"sector": spinning(), "diameter": 2, "speed": 0.1},
    "update": lambda: {"family": family(), "test": measured()},
    "wheel_campbell": lambda: {"sector": spinning(), "diameter": 2, "speeds": [0.1, 0.2]},
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
    "BladedWheel.of_blades": lambda: {"Phi": bladed().modes([blade()] * 6)[1]},
    "BladedWheel.waves": lambda: {"speed": 0.0},
    **dict.fromkeys(("BladedWheel.amplification", "BladedWheel.response"), lambda: {
        "force": np.ones(blade().Psi.shape[0]), "engine_order": 1, "omega": [1.0], "damping": 0.01,
        "at": [0],
    }),
    "Characteristic.kinds": lambda: {"connection": connect(operators(), model(), {"root": "full"})},
    "CyclicSector.*": lambda: {"shapes": waves().shapes},
    "FlexibleBody.rotating_frequencies": lambda: {"speed": 1.0, "axis": Z},
    "FlexibleBody.marker": lambda: {"name": "root"},
    "FlexibleBody.beyond_range": lambda: {"q": np.zeros((1, body().n_modes))},
    "FlexibleBody.mean_rows": lambda: {"fixed": {"tip": "x"}},
    "Material.from_units": lambda: {"E": 210e3, "nu": 0.3, "rho": 7.85e-9},
    "Orthotropic.from_units": lambda: {
        "E": (1e3,) * 3, "nu": (0.3,) * 3, "G": (4e2,) * 3, "rho": 1e-9,
    },
    "Pieces.add_to": lambda: {"mech": rom.Mechanism(), "name": "beam"},
    "Heat.described": lambda: {"share": 0.5},
    "MistunedWheel.*": lambda: {
        "deviations": np.zeros(4), "force": [0.0, 1.0, 0.0], "engine_order": 1, "omega": [1.0],
        "damping": 0.01, "at": [1],
    },
    "ModalDamping.matrix": dict,
    "Mechanism.marker": lambda: {"place": "arm.a"},
    "Solution.*": lambda: {"body": "arm", "t": 1e-3, "marker": "a", "instant": 0, "name": "hinge"},
    "Solution.drive_load": lambda: {"name": "shaker"},
}  # fmt: skip
READERS = {"load", "load_state", "read_model", "read_sid"}  # of files that must be there
NEEDS = {  # callables whose arguments only finite elements can make
    "BladedWheel", "Heat.on", "ReducedBlade", "ReducedSpinUp", "SpinUp", "bladed_wheel", "heated",
    "heated_sector", "held_solid", "reduce_sector", "reduced_blade", "rotating_sector", "spin_up",
    "substructured_sector", "supported_sector", "thermal_buckling", "CyclicSector.from_model",
}  # fmt: skip
OBJECTS = {  # class -> an object of it: legal arguments of the class, and owner of its methods
    "Assembly": lambda: rom.Assembly(bodies(), TOGETHER),
    "Attachment": lambda: rom.Attachment("tip", 1.0),
    "BalancedTruncation": lambda: rom.BalancedTruncation(1),
    "Basis": lambda: rom.Basis(np.eye(2), np.ones(1), ("a", "b")),
    "BladedWheel": bladed,
    "BodyFamily": family,
    "Characteristic": lambda: rom.Characteristic(rom.Guyan(), 6),
    "CraigBampton": lambda: rom.CraigBampton(1),
    "CyclicModes": waves,
    "CyclicSector": ring,
    "Density": lambda: rom.Density(None, 0.9, 1.1),
    "DualAssembly": lambda: rom.DualAssembly(free(), TOGETHER),
    "EnhancedCraigBampton": lambda: rom.EnhancedCraigBampton(1),
    "FEModel": model,
    "FlexibleBody": body,
    "FourierLegendre": lambda: rom.FourierLegendre(1, 1),
    "FreeFree": lambda: rom.FreeFree(1),
    "AssumedModes": lambda: rom.AssumedModes(1),
    "FreeSubstructure": lambda: free()["a"],
    "Guyan": rom.Guyan,
    "Heat": lambda: rom.Heat(1e-5, 1.0),
    "Herting": lambda: rom.Herting(1),
    "Interface": lambda: model().interfaces["root"],
    "Keeping": lambda: rom.Keeping("kept"),
    "Layered": lambda: rom.Layered(((0.0, 1.0),), model().K, model().K, model().K),
    "Material": lambda: STEEL,
    "MistunedWheel": mistuned,
    "ModalDamping": lambda: rom.ModalDamping(0.01),
    "Modes": lambda: rom.modes(model(), 1),
    "MomentMatching": rom.MomentMatching,
    "Orthotropic": lambda: rom.Orthotropic((1e9,) * 3, (0.3,) * 3, (4e8,) * 3, 1e3),
    "Pieces": pieces,
    "Polynomial": lambda: rom.Polynomial(1),
    "Geometric": lambda: rom.Geometric({"tip": (0, 1.0, 0, 0, 0, 0)}),
    "Rayleigh": rom.Rayleigh,
    "ReducedBlade": blade,
    "ReducedSpinUp": reduced_run_up,
    "Region": lambda: rom.Region(model().K, model().M),
    "Report": lambda: rom.Report("title"),
    "Rubin": lambda: rom.Rubin(1),
    "Snapshots": lambda: rom.Snapshots(np.eye(12), n=6),
    "SpinUp": lambda: wheel().run_up,
    "SpreadLoad": lambda: rom.mass_load(body(), X),
    "SteadyMotion": lambda: rom.steady_motion(driven()),
    "SurfaceMesh": lambda: model().surface,
    "Thickness": lambda: rom.Thickness(None, 0.9, 1.1),
    "TravellingModes": lambda: rom.travelling_modes(spinning(), 2, 1, speed=0.1),
    "WheelCampbell": lambda: rom.wheel_campbell(spinning(), 2, 1, speeds=[0.1, 0.2]),
    "WithLoads": lambda: rom.WithLoads(rom.Guyan()),
    "YoungsModulus": lambda: rom.YoungsModulus(None, 0.9, 1.1),
    "Mechanism": rom.Mechanism,
    "Solution": solution,
    "Solution.drive_load": lambda: rom.simulate(driven(), t_end=2e-3, dt=1e-3),
    "State": lambda: solution().final,
}
JOIN = {
    "name": lambda mech: "new",
    "m1": lambda mech: mech.ground.marker((0, 0, 0)),
    "m2": lambda mech: mech.parts["arm"].marker("a"),
    "axis": lambda mech: X,
    "normal": lambda mech: Z,
    "joint": lambda mech: "hinge",
    "joint1": lambda mech: "hinge",
    "joint2": lambda mech: "slide",
    "marker": lambda mech: mech.parts["arm"].marker("a"),
    "stiffness": lambda mech: 1.0,
    "function": lambda mech: lambda t, *motion: 0.0 * t,
    "law": lambda mech: Impact(stiffness=1.0),
    "radius": lambda mech: 0.1,
    "radius1": lambda mech: 0.1,
    "radius2": lambda mech: 0.2,
    "vector": lambda mech: X,
    "part": lambda mech: mech.parts["beam"],
    "load": lambda mech: rom.mass_load(body(), X),
    "transition_speed": lambda mech: 0.1,
    "ratio": lambda mech: 2.0,
    "pitch": lambda mech: 0.1,
    "axis1": lambda mech: X,
    "axis2": lambda mech: Y,
    "mass": lambda mech: 1.0,
    "inertia": lambda mech: (1, 1, 1),
    "at": lambda mech: (0, 0, 0),
    "body": lambda mech: body(),
}  # of the methods of a mechanism
JOIN_OWN = {
    ("add", "element"): lambda mech: springs.Spring(
        *2 * (mech.ground.marker((0, 0, 0)),), 1.0, 0, 0
    ),
    ("add", "family"): lambda mech: springs.SPRINGS_FAMILY,
    ("motor", "law"): lambda mech: lambda t, x, v: 0.0,
    ("stop", "lower"): lambda mech: -1.0,
    ("part", "name"): lambda mech: "arm",
    ("add_nonlinear", "body"): lambda mech: rod(),
    ("bushing", "stiffness"): lambda mech: np.ones(6),
    ("gear_mesh", "wheel_a"): lambda mech: mech.ground.marker((0, 0, 0)),
    ("gear_mesh", "wheel_b"): lambda mech: mech.parts["arm"].marker((0, 0, 0)),
    ("gear_mesh", "pair"): lambda mech: GearPair((40, 40), 0.0125, 0.1),
    ("rolling_bearing", "inner"): lambda mech: mech.parts["arm"].marker((0, 0, 0)),
    ("rolling_bearing", "outer"): lambda mech: mech.ground.marker((0, 0, -0.5)),
    ("rolling_bearing", "bearing"): lambda mech: rom.mbs.BallBearing(9, 0.0127, 0.065),
    ("journal_bearing", "journal"): lambda mech: mech.parts["arm"].marker((0, 0, 0)),
    ("journal_bearing", "bush"): lambda mech: mech.ground.marker((0, 0, -0.5)),
    ("journal_bearing", "bearing"): lambda mech: film_bearing(),
    ("journal_bearing", "oil"): lambda mech: 0.03,
    ("tendon", "path"): lambda mech: [mech.ground.marker((0, 0, k)) for k in range(2)],
    ("tendon", "EA"): lambda mech: 1.0,
}


def parameters(function):
    """Parameters that may be given by name, in order."""
    variable = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    every = inspect.signature(function).parameters.values()
    return [p for p in every if p.kind not in variable and p.name not in ("self", "cls")]


def given(label, function):
    """Legal arguments of a function."""
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
        if not name.startswith("_") and plain and parameters(getattr(kind, name)):
            yield name


@cache
def calls():
    """Every public callable by name, with a legal call of it."""
    public = {name: getattr(rom, name) for name in rom.__all__ if name not in KEPT} | ALSO
    found = {}
    for name, thing in public.items():
        if not inspect.isclass(thing):
            found[name] = (thing, partial(of_function, name, thing))
            continue
        if parameters(thing):
            found[name] = (thing, partial(of_class, name, thing))
        for method in methods(thing):
            label, is_mechanism = f"{name}.{method}", name == "Mechanism"
            if label not in INNER:
                make = partial(of_mechanism, method) if is_mechanism else partial(of_method, label)
                found[label] = (getattr(thing, method), make)
    return {
        label: Call(made, tuple(p.name for p in parameters(thing)),
                    frozenset((a, kind) for (of, a), kinds in SKIPPED.items() if of == label
                              for kind in kinds))
        for label, (thing, made) in found.items()
        if FENICSX or not NEEDS & {label, label.partition(".")[0]}
    }  # fmt: skip
