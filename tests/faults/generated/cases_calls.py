"""Public functions called with arguments of the wrong kind: the argument is blamed by name.

A row is a call, the argument that is wrong, and which kind of value it takes.
"""

from functools import cache

import numpy as np
from scipy.sparse import identity

import rom
from generated.case import case
from generated.stock import KINDS, body, family, model, origin, pendulum
from rom.errors import (
    ConfigError,
    FileFormatError,
    InterfaceError,
    MaterialError,
    ModelError,
    ParameterError,
    QualityGateError,
)

BLAMED = (ConfigError, ModelError, MaterialError, InterfaceError, ParameterError, FileFormatError)
TYPED = {  # what is no value of a kind, for any argument of this kind
    "number": ("five", np.nan, np.inf, [1.0, 2.0], 1j, {}),
    "positive": ("five", np.nan, -1.0, [1.0, 2.0], 1j),
    "count": (1.5, -1, "three", np.nan, [2], True),
    "point": ("here", (1, 2), (1, 2, np.nan), 5.0, [[1, 2, 3]]),
    "numbers": ("here", [np.nan], [[1, 2], [3]], {}),
    "record": (None, 5, "that one"),
    "word": (5, "nonsense", None),
    "flag": ("yes", 2, [True]),
    "table": (5, "root", ["root"]),
    "law": (5.0, "sin", None),
    "path": (5, None, [], b"\xff"),
}


@cache
def stone():
    """A body, a mechanism and its motion, made once."""
    mech = pendulum()
    return mech, rom.simulate(mech, t_end=0.05, dt=0.01)


def two_stones():
    mech = rom.Mechanism()
    for name in ("a", "b"):
        mech.add_rigid(name, mass=1.0, inertia=(1e-3,) * 3, at=(0, 0, 0))
    return mech


@cache
def beam():
    return body()


@cache
def block():
    return model()


@cache
def parameters():
    return family()


def simulate(**k):
    return rom.simulate(**({"mechanism": pendulum(), "t_end": 0.05, "dt": 0.01} | k))


def reduce(**k):
    good = {"model": block(), "method": rom.Guyan(), "interfaces": KINDS, "certify": False}
    return rom.reduce(**(good | k))


def rigid(**k):
    good = {"name": "a", "mass": 1.0, "inertia": (1e-3,) * 3, "at": (0, 0, 0)}
    return rom.Mechanism().add_rigid(**(good | k))


def flexible(**k):
    return rom.Mechanism().add_flexible(**({"name": "a", "body": beam()} | k))


def joint(kind, axes, **k):
    mech = rom.Mechanism()
    bob = mech.add_rigid("a", mass=1.0, inertia=(1e-3,) * 3, at=(0, 0, 0), markers={"c": (0, 0, 0)})
    good = {"name": "j", "m1": origin(mech), "m2": bob.marker("c")} | axes
    return getattr(mech, kind)(**(good | k))


def on_pendulum(kind, good, **k):
    mech = pendulum()
    good = {
        name: f(mech) if callable(f) and name.startswith("m") else f for name, f in good.items()
    }
    return getattr(mech, kind)(**({"name": "x"} | good | k))


def verb(name, **good):
    """A function of rom on the pendulum."""
    return lambda **k: getattr(rom, name)(**({"mechanism": pendulum()} | good | k))


def pin(mech):
    return mech.part("bob").marker("pin")


def written(name, path, **k):
    return getattr(rom, name)(**({"solution": stone()[1], "path": path} | k))


def craig_bampton(**k):
    good = {"K": block().K, "M": block().M, "boundary": list(range(12)), "n_modes": 2}
    return rom.craig_bampton(**(good | k))


def second_order(**k):
    eye = np.eye(4)
    good = {"K": eye, "M": eye, "D": 0.1 * eye, "B": eye[:, :1], "C": eye[:1], "r": 2}
    return rom.second_order_balanced_truncation(**(good | k))


def spring(**k):
    return on_pendulum("spring_damper", {"m1": origin, "m2": pin, "stiffness": 1.0}, **k)


def turning_spring(**k):
    return on_pendulum("rotational_spring", {"joint": "hinge", "stiffness": 1.0}, **k)


def force(**k):
    return on_pendulum("force", {"marker": pin, "vector": (0, 0, 1)}, **k)


def drive(**k):
    return on_pendulum("drive", {"joint": "hinge", "function": np.sin}, **k)


def user_force(**k):
    return on_pendulum("user_force", {"m1": pin, "function": lambda t, a: None}, **k)


def parametric(**k):
    good = {"model": block(), "parameters": {"rho": rom.Density(None, 0.5, 2.0)}, "tol": 0.5,
            "method": rom.CraigBampton(1), "interfaces": KINDS}  # fmt: skip
    return rom.reduce_parametric(**(good | k))


CALLS = [  # call, name, argument, kind of its value, further values that are wrong
    (simulate, "simulate", "mechanism", "record"),
    (simulate, "simulate", "t_end", "positive"),
    (simulate, "simulate", "dt", "positive"),
    (simulate, "simulate", "rho_inf", "number"),
    (simulate, "simulate", "tolerance", "positive"),
    (simulate, "simulate", "rtol", "positive"),
    (simulate, "simulate", "save_every", "count"),
    (simulate, "simulate", "method", "word"),
    (simulate, "simulate", "t_start", "number"),
    (lambda **k: simulate(method="bdf", **k), "simulate by bdf", "order", "count"),
    (lambda state: simulate(state=state or 0), "simulate from", "state", "record"),
    (reduce, "reduce", "model", "record"),
    (reduce, "reduce", "method", "record"),
    (reduce, "reduce", "interfaces", "table"),
    (reduce, "reduce", "reference", "word"),
    (reduce, "reduce", "stress", "flag"),
    (lambda damping: reduce(damping=damping or 0), "reduce with", "damping", "record"),
    (lambda **k: rom.modes(**({"model": block(), "n": 3} | k)), "modes", "model", "record"),
    (lambda **k: rom.modes(**({"model": block(), "n": 3} | k)), "modes", "n", "count"),
    (lambda fixed: rom.modes(block(), 3, fixed=fixed), "modes", "fixed", "word"),
    (rigid, "add_rigid", "mass", "positive"),
    (rigid, "add_rigid", "inertia", "point"),
    (rigid, "add_rigid", "at", "point"),
    (lambda velocity: rigid(velocity=velocity), "add_rigid", "velocity", "point"),
    (lambda omega: rigid(omega=omega), "add_rigid", "omega", "point"),
    (lambda markers: rigid(markers=markers), "add_rigid", "markers", "table"),
    (flexible, "add_flexible", "body", "record"),
    (flexible, "add_flexible", "at", "point"),
    (flexible, "add_flexible", "q", "numbers"),
    *((lambda kind=kind, axes=axes, **k: joint(kind, axes, **k), kind, name, "point")
      for kind, axes in (("revolute", {"axis": (0, 0, 1)}), ("prismatic", {"axis": (0, 0, 1)}),
                         ("planar", {"normal": (0, 0, 1)})) for name in axes),
    (lambda **k: joint("screw", {"axis": (0, 0, 1), "pitch": 0.1}, **k), "screw", "pitch", "number"),
    (lambda **k: joint("spherical", {}, **k), "spherical", "m2", "record"),
    (spring, "spring_damper", "stiffness", "number"),
    (spring, "spring_damper", "damping", "number"),
    (spring, "spring_damper", "m2", "record"),
    (turning_spring, "rotational_spring", "stiffness", "number"),
    (turning_spring, "rotational_spring", "joint", "word"),
    (force, "force", "vector", "point"),
    (force, "force", "frame", "word"),
    (force, "force", "marker", "record"),
    (drive, "drive", "function", "law"),
    (drive, "drive", "joint", "word"),
    (user_force, "user_force", "function", "law"),
    (lambda gravity: rom.Mechanism(gravity=gravity), "Mechanism", "gravity", "point"),
    (verb("equilibrium"), "equilibrium", "mechanism", "record"),
    (verb("equilibrium"), "equilibrium", "steps", "count"),
    (verb("equilibrium"), "equilibrium", "spin", "point"),
    (verb("linearize"), "linearize", "mechanism", "record"),
    (verb("linearize"), "linearize", "t", "number"),
    (verb("linearize"), "linearize", "frame", "word"),
    (verb("inverse_dynamics"), "inverse_dynamics", "t", "numbers"),
    (verb("campbell"), "campbell", "speeds", "numbers"),
    (verb("campbell", speeds=[1.0, 2.0]), "campbell", "axis", "point"),
    (verb("release"), "release", "state", "record"),
    (lambda frequencies: (lambda m: rom.frequency_response(m, None, frequencies, force=pin(m), motion=pin(m)))(pendulum()),
     "frequency_response", "frequencies", "numbers"),
    (lambda force: (lambda m: rom.frequency_response(m, None, [1.0], force=force, motion=pin(m)))(pendulum()),
     "frequency_response", "force", "record"),
    (lambda solution: rom.audit(solution), "audit", "solution", "record"),
    (lambda body: rom.check(body), "check", "body", "record"),
    (lambda **k: written("write_history", "a.csv", **k), "write_history", "solution", "record"),
    (lambda **k: written("write_history", "a.csv", **k), "write_history", "every", "count"),
    (lambda **k: written("write_animation", "a.glb", **k), "write_animation", "solution", "record"),
    (lambda **k: written("write_animation", "a.glb", **k), "write_animation", "frames", "count"),
    (lambda **k: written("write_animation", "a.glb", **k), "write_animation", "magnify", "number"),
    (lambda up: written("write_animation", "a.glb", up=up), "write_animation", "up", "point"),
    (lambda path: written("write_history", path), "write_history", "path", "path"),
    (lambda path: rom.load(path), "load", "path", "path"),
    (lambda path: rom.load_state(path), "load_state", "path", "path"),
    (lambda path: rom.read_component(path), "read_component", "path", "path"),
    (lambda path: rom.save(beam(), path), "save", "path", "path"),
    (lambda body: rom.save(body, "a.npz"), "save", "body", "record"),
    (lambda state: rom.save_state(state, "a.npz"), "save_state", "state", "record"),
    (lambda body: rom.export(body, "a.vtu"), "export", "body", "record"),
    (lambda to: rom.export(beam(), "a.vtu", to=to or 0), "export", "to", "word"),
    (craig_bampton, "craig_bampton", "n_modes", "count"),
    (craig_bampton, "craig_bampton", "boundary", "numbers"),
    (craig_bampton, "craig_bampton", "K", "record"),
    (second_order, "second_order_balanced_truncation", "r", "count"),
    (parametric, "reduce_parametric", "tol", "positive"),
    (parametric, "reduce_parametric", "parameters", "table"),
    (lambda rho: parameters().at(rho=rho), "BodyFamily.at", "rho", "number"),
    (lambda n: beam().frequencies(n or "all"), "FlexibleBody.frequencies", "n", "count"),
    (lambda fixed: beam().frequencies(2, fixed=fixed), "FlexibleBody.frequencies", "fixed", "word"),
    (lambda reference: beam().with_reference(reference), "with_reference", "reference", "word"),
    *((lambda method=method, **k: method(**k), method.__name__, "n_modes", "count")
      for method in (rom.CraigBampton, rom.Rubin, rom.Herting, rom.FreeFree)),
    (lambda f_max: rom.CraigBampton(f_max=f_max), "CraigBampton", "f_max", "positive"),
    (lambda order: rom.Polynomial(order), "Polynomial", "order", "count"),
    (lambda frequencies: rom.MomentMatching(frequencies, 2), "MomentMatching", "frequencies", "numbers"),
    (lambda E: rom.Material(E=E, nu=0.3, rho=1e3), "Material", "E", "positive"),
    (lambda nu: rom.Material(E=1e9, nu=nu, rho=1e3), "Material", "nu", "number"),
    (lambda rho: rom.Material(E=1e9, nu=0.3, rho=rho), "Material", "rho", "positive"),
    (lambda ratio: reduce(damping=rom.ModalDamping(ratio)), "ModalDamping", "ratio", "number"),
    (lambda low: rom.Density(None, low, 2.0), "Density", "low", "positive"),
]  # fmt: skip
LEGAL = {  # None or a shape that an argument takes although its kind does not
    ("simulate", "rho_inf"): (), ("modes", "fixed"): (None,), ("with_reference", "reference"): (None,),
    ("reduce", "reference"): (None,), ("ModalDamping", "ratio"): ([1.0, 2.0],),
    ("FlexibleBody.frequencies", "fixed"): (None,),
}  # fmt: skip


def shown(value):
    """The argument is blamed by its name, or by what was given."""
    text = repr(value)
    return (text, f"{value:g}") if isinstance(value, float) else (text, str(value)[:20])


def cases():
    for call, name, argument, kind in CALLS:
        for value in TYPED[kind]:
            if any(
                value is x or (isinstance(x, list) and x == value)
                for x in LEGAL.get((name, argument), ())
            ):
                continue

            def act(folder, call=call, argument=argument, value=value):
                return call(**{argument: value})

            words = (argument, argument.replace("_", " "), name, *shown(value))
            yield case(f"{name}, {argument} = {value!r}", act, BLAMED, words)


UNKNOWN = {  # names that are not there, and a word of what is known
    "interface of a reduction": (lambda: reduce(interfaces={"rot": "rbe2"}), "rot", "root"),
    "kind of an interface": (lambda: reduce(interfaces={"root": "rbe4"}), "rbe4", "rbe2"),
    "support of modes": (lambda: rom.modes(block(), 3, fixed=("rot",)), "rot", "root"),
    "support of a body": (lambda: beam().frequencies(2, fixed=("rot",)), "rot", "root"),
    "frame of a body": (lambda: beam().with_reference("tipp"), "tipp", "tip"),
    "marker of a part": (lambda: pendulum().part("bob").marker("pn"), "pn", "pin"),
    "part of a mechanism": (lambda: pendulum().part("bb"), "bb", "bob"),
    "joint of a drive": (lambda: drive(joint="hing"), "hing", "hinge"),
    "position of a motion": (lambda: stone()[1].position("bb"), "bb", "bob"),
    "marker of a motion": (lambda: stone()[1].position("bob", "pn"), "pn", "pin"),
    "reaction of a motion": (lambda: stone()[1].reaction("hing"), "hing", "hinge"),
    "elastic body of a motion": (lambda: stone()[1].elastic("bb"), "bb", "bob"),
    "format": (lambda: rom.export(beam(), "a.vtu", to="fbx"), "fbx", "vtu"),
    "method": (lambda: simulate(method="newmark"), "newmark", "bdf"),
    "parameter": (lambda: parameters().at(rhoo=1.0), "rhoo", "rho"),
    "drive": (
        lambda: (lambda m: rom.transmissibility(m, None, [1.0], drive="mot", motion=pin(m)))(
            pendulum()
        ),
        "mot",
    ),
}
DOUBLED = {
    "a body": lambda m: m.add_rigid("bob", mass=1.0, inertia=(1e-3,) * 3, at=(0, 0, 0)),
    "a joint": lambda m: m.spherical("hinge", origin(m), pin(m)),
    "a force": lambda m: (m.force("f", pin(m), (0, 0, 1)), m.force("f", pin(m), (0, 0, 1))),
}
GATES = (*BLAMED, QualityGateError)
CASES = [
    *cases(),
    *(case(f"an unknown {what}", lambda folder, f=f: f(), BLAMED, *words)
      for what, (f, *words) in UNKNOWN.items()),
    *(case(f"{what} of a name in use", lambda folder, f=f: f(pendulum()), ConfigError,
           ("bob", "hinge", "'f'")) for what, f in DOUBLED.items()),
    case("a marker of another mechanism",
         lambda folder: on_pendulum("force", {"marker": rom.Mechanism().add_rigid(
             "z", mass=1.0, inertia=(1e-3,) * 3, at=(0, 0, 0), markers={"c": (0, 0, 0)}).marker("c"),
             "vector": (0, 0, 1)}), BLAMED, "z"),
    case("a joint of a body with itself", lambda folder: (lambda m: m.spherical("j", pin(m), pin(m)))(pendulum()),
         BLAMED, ("bob", "'j'")),
    case("matrices that do not fit", lambda folder: craig_bampton(M=identity(3, format="csr")), GATES,
         "36"),
    case("a state of another mechanism",
         lambda folder: rom.simulate(two_stones(), state=stone()[1].final, t_end=1.0, dt=0.1),
         BLAMED, "state"),
]  # fmt: skip
