"""Names that are not there, names in use, and things that do not fit: blamed by name."""

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


def on_pendulum(kind, good, **k):
    mech = pendulum()
    good = {
        name: f(mech) if callable(f) and name.startswith("m") else f for name, f in good.items()
    }
    return getattr(mech, kind)(**({"name": "x"} | good | k))


def pin(mech):
    return mech.part("bob").marker("pin")


def craig_bampton(**k):
    good = {"K": block().K, "M": block().M, "boundary": list(range(12)), "n_modes": 2}
    return rom.craig_bampton(**(good | k))


def drive(**k):
    return on_pendulum("drive", {"joint": "hinge", "function": np.sin}, **k)


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
    *(case(f"a parameter of {value!r}", lambda folder, x=value: parameters().at(rho=x), BLAMED, "rho")
      for value in ("five", np.nan, np.inf, [1.0, 2.0], 1j, {})),
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
