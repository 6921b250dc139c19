"""Odd models: of any size, free, spoilt, or with interfaces that can carry too little."""

from dataclasses import replace

import numpy as np

import rom
from cases.solid import block
from generated.case import Works, case, require
from generated.stock import KINDS, body, model


def scaled(size):
    """The same relative frequencies at any size."""
    small = replace(model(), points=model().points * size, K=model().K * size, M=model().M * size**3,
                    interfaces={n: replace(i, points=i.points * size, origin=i.origin * size,
                                           surface_mass=i.surface_mass * size**2)
                                for n, i in model().interfaces.items()})  # fmt: skip
    return lambda folder: require(
        np.allclose(rom.modes(small, 10).frequencies[6:] * size, rom.modes(model(), 10).frequencies[6:],
                    rtol=1e-8), "other frequencies")  # fmt: skip


def matrices(**how):
    def act(folder):
        made = model()
        changed = {name: f(getattr(made, name)) for name, f in how.items()}
        return rom.reduce(replace(made, **changed), method=rom.CraigBampton(2), interfaces=KINDS)

    return act


def spoilt(A, value=np.nan):
    A = A.copy()
    A.data[7] = value
    return A


def skewed(A):
    A = A.tolil()
    A[0, 5] += 0.1 * abs(A).max()
    return A.tocsr()


def interface(nodes, kind, **how):
    """A reduction whose interface has these nodes."""

    def act(folder):
        made = model((4, 1, 1))
        other = replace(made.interfaces["root"], nodes=np.array(nodes), points=made.points[nodes],
                        surface_mass=np.eye(len(nodes)), origin=made.points[nodes].mean(axis=0))  # fmt: skip
        return rom.reduce(replace(made, interfaces={"root": other}), interfaces={"root": kind},
                          certify=False, **how)  # fmt: skip

    return act


def complete(folder):
    """Modes of a free body: six of rigid motion and no other lost, whatever the number."""
    made = block(cells=(4, 2, 2))
    for m in (6, 7, 8, 12):
        found = rom.modes(made, m).frequencies
        require((found[:6] < 1e-2).all() and (found[6:] > 1).all(), f"{found}")
    few, many = (rom.modes(made, m).frequencies[6:] for m in (8, 12))
    require(np.allclose(few, many[:2]), "")


def explicit(folder):
    """A stiff spring and an explicit method, which chooses its step itself."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    bob = mech.add_rigid("bob", mass=1e-6, inertia=(1e-9,) * 3, at=(1, 0, 0)).marker((0, 0, 0))
    mech.spring_damper("spring", mech.ground.marker((0, 0, 0)), bob, stiffness=1e9, free_length=0.9)
    sol = rom.simulate(mech, t_end=1e-6, dt=1e-7, method="dop853")
    require(np.abs(sol.position("bob")).max() < 2, "it grew")


def rigid_modes(folder):
    """A body whose elastic coordinates can move it as a whole."""
    made = body()
    S = np.hstack([made.S, made.mass * np.eye(3)])
    r = made.K.shape[0]
    grown = {"S": S, "K": np.pad(made.K, (0, 3)), "D": np.pad(made.D, (0, 3)),
             "S_kl": np.pad(made.S_kl, [(0, 0), (0, 0), (0, 3), (0, 3)]),
             "Ibar_kl": np.pad(made.Ibar_kl, [(0, 0), (0, 0), (0, 3)])}  # fmt: skip
    for a in range(3):
        grown["S_kl"][a, a, r + a, r + a] = made.mass
        grown["S_kl"][a, a, r + a, :r] = grown["S_kl"][a, a, :r, r + a] = made.S[a]
        grown["Ibar_kl"][:, a, r + a] = made.first_moment
    markers = {n: replace(m, translation=np.hstack([m.translation, np.eye(3)]),
                          rotation=np.pad(m.rotation, ((0, 0), (0, 3))),
                          hold=np.pad(m.hold, ((0, 0), (0, 3)))) for n, m in made.markers.items()}  # fmt: skip
    labels = (*made.labels, "x", "y", "z")
    wrong = replace(made, **grown, markers=markers, labels=labels, surface=None,
                    omega=np.concatenate([made.omega, np.zeros(3)]))  # fmt: skip
    return rom.Mechanism().add_flexible("rod", wrong)


def unresolved(folder):
    """An order of polynomials beyond what the nodes can tell apart."""
    made = rom.reduce(model(), method=rom.Guyan(), certify=False,
                      interfaces={"root": rom.Polynomial(3), "tip": "rbe2"})  # fmt: skip
    require(made.n_modes == 12 and np.linalg.eigvalsh(made.K)[0] > 0, "more shapes than dofs")


CASES = [
    case("a small one", scaled(1e-9), Works),
    case("a large one", scaled(1e6), Works),
    case("an interface of all nodes", interface(range(20), "full", method=rom.Guyan()), Works),
    case("one node and modes", interface([0], "full", method=rom.CraigBampton(2)), rom.InterfaceError, "root"),
    case("two nodes and a line", interface([0, 1], rom.Polynomial(1), method=rom.Guyan(), reference="free"),
         rom.InterfaceError, "root"),
    case("a free one", complete, Works),
    case("too many polynomials", unresolved, Works),
    *(case(what, matrices(**how), (rom.SolverError, rom.QualityGateError, rom.ModelError), *how)
      for what, how in {"nan": {"K": spoilt}, "skew": {"M": skewed},
                        "inf": {"M": lambda A: spoilt(A, np.inf)}}.items()),
    case("a stiff spring", explicit, Works),
    case("modes of rigid motion", rigid_modes, (rom.ConfigError, rom.ModelError), "rod"),
]  # fmt: skip
