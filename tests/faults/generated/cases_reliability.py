"""The odd cases of the table of faults, each by its number there.

Those that stand in another class as well are left to it.
"""

import os
import re
from dataclasses import replace
from pathlib import Path

import numpy as np

import rom
from cases.command import rom as command
from cases.files.cells import blocks_of, solid, write_msh
from cases.solid import block
from generated.case import Silent, Warned, Works, case, edit, require
from generated.stock import KINDS, STEEL, body, model, origin, pendulum
from rom.cli.main import main
from rom.errors import ConfigError, InterfaceError, ModelError, SolverError, TagError
from rom.fe.mesh.read import read_mesh

BOX, THIN = solid(), solid(counts=(10, 10, 1), size=(1.0, 1.0, 1e-2))
BLOCKS, NAMES = blocks_of(BOX)
MODES = f"modes box.msh {STEEL} -n 7"


def boxes(points=BOX.points, blocks=BLOCKS, names=NAMES):
    """The box as a mesh file."""
    return lambda folder: write_msh(folder / "box.msh", points, blocks, names)


def orphan(folder):
    """A node of no cell: the same mesh."""
    boxes(np.vstack([BOX.points, [[9, 9, 9]]]))(folder)
    require(len(read_mesh(folder / "box.msh").points) == 36, "another mesh")


def elsewhere(folder):
    """Paths in a file start where the file is."""
    (folder / "other").mkdir()
    os.chdir(folder / "other")
    code = main(["reduce", "../part.toml", "-o", "../a.npz", "-q"])
    os.chdir(folder)
    require(code == 0 and (folder / "a.npz").is_file(), f"exit code {code}")


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
        nodes_ = np.arange(len(made.points)) if nodes is None else np.asarray(nodes)
        other = replace(made.interfaces["root"], nodes=nodes_, points=made.points[nodes_],
                        surface_mass=np.eye(nodes_.size), origin=made.points[nodes_].mean(axis=0))  # fmt: skip
        return rom.reduce(replace(made, interfaces={"root": other}), interfaces={"root": kind},
                          **({"method": rom.Guyan(), "certify": False} | how))  # fmt: skip

    return act


def complete(folder):
    """Modes of a free body: six of rigid motion and no other lost, whatever the number."""
    made = block(cells=(4, 2, 2))
    for m in (6, 7, 8, 12):
        found = rom.modes(made, m).frequencies
        require((found[:6] < 1e-2).all() and (found[6:] > 1).all(), f"{found}")
    few, many = (rom.modes(made, m).frequencies[6:] for m in (8, 12))
    require(np.allclose(few, many[:2]), "")


def read_only(folder):
    """A home that cannot be written is no obstacle."""
    os.environ |= {"HOME": "/proc", "XDG_CACHE_HOME": "/proc/none", "NUMBA_CACHE_DIR": "/proc/none"}
    done = command("check", "good.npz")
    require(done.returncode == 0, done.stderr[-500:])


def drawn(folder):
    """pyvista after dolfinx in one process."""
    done = command("view", "solid.toml", "-o", "a.png", "-q")
    require(done.returncode == 0, done.stderr[-500:])


def explicit(folder):
    """A step beyond the stability of the explicit scheme, or one it chooses itself."""
    mech = rom.Mechanism(gravity=(0, 0, 0))
    bob = mech.add_rigid("bob", mass=1e-6, inertia=(1e-9,) * 3, at=(1, 0, 0)).marker((0, 0, 0))
    mech.spring_damper("spring", origin(mech), bob, stiffness=1e9, free_length=0.9)
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


def peak():
    """Most memory that was resident [kB]."""
    return int(re.search(r"VmHWM:\s*(\d+)", Path("/proc/self/status").read_text())[1])


def growth(folder):
    """Memory of many steps of which few are kept: below a kilobyte a step."""
    rom.simulate(pendulum(), t_end=1.0, dt=1e-3, save_every=100)
    Path("/proc/self/clear_refs").write_text("5")  # the peak begins anew
    before = peak()
    rom.simulate(pendulum(), t_end=50.0, dt=1e-3, save_every=10_000)
    grown = (peak() - before) / 50_000
    require(grown < 1, f"{grown} kB a step")


def unresolved(folder):
    """An order of polynomials beyond what the nodes can tell apart."""
    made = rom.reduce(model(), method=rom.Guyan(), certify=False,
                      interfaces={"root": rom.Polynomial(3), "tip": "rbe2"})  # fmt: skip
    require(made.n_modes == 12 and np.linalg.eigvalsh(made.K)[0] > 0, "more shapes than dofs")


CASES = [
    case("A11", elsewhere, Works),
    case("B07", "mesh box.msh", Silent, fe=True),
    case("B09", "mesh box.msh", (Warned, TagError, Silent), "group", given=boxes(blocks=BLOCKS[:1], names=[]), fe=True),
    case("B13", "mesh box.geo", (TagError, Silent), "'left'", fe=True,
         given=edit("box.geo", "Mesh.", 'Physical Surface("left", 12) = {1};\nMesh.')),
    case("C09", orphan, Works, fe=True),
    case("C13 small", scaled(1e-9), Works),
    case("C13 large", scaled(1e6), Works),
    case("C17", f"modes box.msh {STEEL} --degree 1 -n 7", Warned, "lock", fe=True,
         given=lambda folder: write_msh(folder / "box.msh", THIN.points, *blocks_of(THIN))),
    case("D05", MODES.replace("0.3", "0.4999999"), (Warned, rom.MaterialError), "nu", fe=True),
    case("E03", interface(None, "full"), (Silent, Warned), "interior"),
    case("E05", interface([0], "full"), (InterfaceError, Silent, Warned), "root"),
    case("E07", interface([0], "full", method=rom.CraigBampton(2)), (InterfaceError, Warned), "root"),
    case("E09", complete, Works),
    case("E11", unresolved, Works),
    case("E13", interface([0, 1], rom.Polynomial(1), reference="free"), (InterfaceError, Warned, ConfigError), "root"),
    *(case(f"F03 {what}", matrices(**how), (SolverError, rom.QualityGateError, ModelError), *how)
      for what, how in {"nan": {"K": spoilt}, "skew": {"M": skewed},
                        "inf": {"M": lambda A: spoilt(A, np.inf)}}.items()),
    case("H07", read_only, Works),
    case("H11", drawn, Works, fe=True),
    case("I01", explicit, (SolverError, Silent), "bob"),
    case("I07", rigid_modes, (ConfigError, ModelError), "rod"),
    case("I13", growth, Works),
]  # fmt: skip
