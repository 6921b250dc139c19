"""The box with a removable component (BARC), free: solids in parts, reduced and joined."""

import tomllib
from dataclasses import dataclass, replace

import numpy as np
from measured.record import FOUND, Structure

import rom
from cases.paths import ROOT
from rom.body.inertia import InertiaIntegrals
from rom.components.families.family import BodyFamily, Share
from rom.components.updating.family_model import family_model
from rom.components.updating.models import modal
from rom.parametric import FamilyAssembly
from rom.updating import Channels, JointSpring, Responses

PARTS = {1: "box", 2: "left", 3: "right", 4: "beam"}
SQUARES = {"r_foot": 3.5e-3, "r_top": 5e-3}  # as wide as the heads of the bolts
# heads spread by a cone of 30 degrees through the sheet; under a foot such squares all but touch
CONES = {"r_foot": 4.4e-3, "r_top": 6.8e-3}
# joints: kind of the interfaces, and half-widths of what touches
JOINTS = {
    "glued": (rom.Polynomial(4), {}),
    "rigid squares": ("rbe2", SQUARES),
    "averaged squares": ("rbe3", SQUARES),
}
DOUBTFUL = 6.35e-3, 76.2e-3, 76.2e-3  # a corner of the cut that moves as no model has it [m]
ELSEWHERE = 38.1e-3, 130.175e-3, 50.8e-3  # on the beam, where nothing is told to be measured [m]
BOLT = (1e9,) * 3 + (1e4,) * 3  # stiffness of each at a factor of one [N/m, N m/rad]


def models(mesh, *, E=70e9, rho=2700.0, box=6.35e-3, sheet=3.175e-3, bolts=1.0, **patches):
    """{name: solid}; bolts hang on the box and on the beam, mesh in mm."""
    from mpi4py import MPI

    found, solid = {}, rom.Material(E=E, nu=0.33, rho=rho)
    sizes = {"lc": 1e-3 * mesh, "t_box": box, "t": sheet} | patches
    for number, name in PARTS.items():
        model = rom.fe.model(ROOT / "meshes" / "barc.geo", material=solid, comm=MPI.COMM_SELF,
                             parameters={"part": number} | sizes)  # fmt: skip
        each = {"box": 12e-3 if patches else 48e-3, "beam": 15e-3}.get(name)
        carried = [rom.Attachment(i, bolts * each) for i in model.interfaces if each]
        found[name] = replace(model, attachments=tuple(carried))
    return found


def parts(mesh, kind, n_modes=20, **parameters):
    """{name: reduced body}."""
    return {
        name: rom.reduce(model, method=rom.CraigBampton(n_modes), name=name, certify=False,
                         interfaces=dict.fromkeys(model.interfaces, kind))
        for name, model in models(mesh, **parameters).items()
    }  # fmt: skip


def families(bodies):
    """Parts with the modulus of each as a factor, which leaves their shapes alone."""
    found = {}
    for name, body in bodies.items():
        mass = InertiaIntegrals(**{key: getattr(body, key) for key in InertiaIntegrals.__slots__})
        modulus = {"E": rom.YoungsModulus(None, 0.8, 1.25)}
        found[name] = BodyFamily(body, modulus, (Share(None, mass, body.K),))
    return FamilyAssembly(found)


def touching(bodies):
    """Pairs of interfaces that touch."""
    return tuple(
        ((side, name), ("box" if "foot" in name else "beam", name))
        for side in ("left", "right") for name in bodies[side].markers
    )  # fmt: skip


def joined(bodies):
    """The assembly of the parts."""
    return rom.Assembly(bodies, touching(bodies))


def bolts(bodies):
    """Ten springs of one unknown factor between the squares of parts."""
    return JointSpring(*zip(*touching(bodies), strict=True), BOLT, 1e-3, 1e3)


def bolted(bodies, factor, rows=None):
    """Circular frequencies (m,), six of them zero, and shapes, of rows or of all coordinates."""
    n = sum(6 + body.n_modes for body in bodies.values())
    rows = np.eye(n) if rows is None else rows
    whole, springs = rom.Assembly(bodies, ()), {"bolts": bolts(bodies)}
    model = family_model(whole, (rows, rows[:0]), springs, {}, ())
    some = modal(model.at(np.log([factor])), ())
    return np.sqrt(some.lam), model.sensors @ some.Phi


@dataclass(frozen=True)
class Shapes:
    """Measured shapes (c, 6) at channels, (c,) of them at the place that no joint explains."""

    channels: Channels
    values: np.ndarray
    doubtful: np.ndarray

    @classmethod
    def read(cls):
        table = np.genfromtxt(FOUND / "barc_shapes.csv", delimiter=",", dtype=None, encoding="utf8")
        points = np.array([[1e-3 * row[k] for k in range(3)] for row in table])
        along = np.array([np.eye(3)["xyz".index(row[3])] for row in table])
        values = np.array([[row[k] for k in range(4, 10)] for row in table])
        return cls(Channels(points, along), values, np.abs(points - DOUBTFUL).max(axis=1) < 1e-4)

    @property
    def trusted(self):
        """Without that place."""
        kept = np.flatnonzero(~self.doubtful)
        return Shapes(self.channels.some(kept), self.values[kept], self.doubtful[kept])

    def mac(self, found):
        """(6, m) modal assurance criterion with other shapes (c, m)."""
        own = self.values
        return (own.T @ found) ** 2 / np.outer((own**2).sum(axis=0), (found**2).sum(axis=0))


def shares(bodies, factor):
    """(m,) of the elastic energy of each elastic mode that is in the springs, by Rayleigh."""
    low, high = (
        omega[6:] for omega, _ in (bolted(bodies, factor * (1 + x)) for x in (-0.01, 0.01))
    )
    return 2 * np.log(high / low) / np.log(1.01 / 0.99)


def rebuilt(families, shapes, f, factor=1.0, damping=0.03, error=0.05, floor=1.0):
    """Responses beside measured frequencies f (n,) [Hz], as far as a test by modes tells them.

    Frequencies and shapes are as measured; the size of each shape, all other modes and the rigid
    motions are those of the model. Damping is set, and so large that what counts is where modes
    are, not how high. The force acts where the least mode moves most.
    """
    bodies = families.nominal.bodies
    rows = shapes.channels.rows(bodies, "sensor")
    omega, own = bolted(bodies, factor, rows)
    for k, frequency in enumerate(f, 6):
        u = shapes.values[:, k - 6]
        own[:, k] = u * (own[:, k] @ u) / (u @ u)
        omega[k] = 2 * np.pi * frequency
    sizes = np.abs(own[:, 6 : 6 + len(f)])
    driven = int((sizes / sizes.max(axis=0)).min(axis=1).argmax())
    lines = np.sort(np.ravel(np.outer(f, 1 + np.linspace(-0.04, 0.04, 9))))
    w = 2 * np.pi * lines[:, None]
    g = 1 / (omega**2 - w**2 + 2j * damping * (omega * w))
    H = np.einsum("sn,fn,n->fs", own, g, own[driven])[:, :, None]
    size, averages = np.abs(H), 1000
    square = error**2 * (1 + (floor * size.max(axis=1, keepdims=True) / size) ** 2)
    known = 1 / (1 + 2 * averages * square)  # coherence of errors of this size
    return Responses(lines, H, shapes.channels, shapes.channels.some([driven]), known, averages)


def frequencies(mesh, **parameters):
    """The first twelve elastic ones, of each kind of joint [Hz]."""
    found = {}
    for joint, (kind, patches) in JOINTS.items():
        f = joined(parts(mesh, kind, **parameters, **patches)).frequencies(18)[6:]
        found |= {f"{joint}, mode {k} [Hz]": float(x) for k, x in enumerate(f, 1)}
    return found


BARC = Structure(
    "barc",
    frequencies,
    {"E": (70e9, 1.4e9), "rho": (2700.0, 27.0), "box": (6.35e-3, 5e-5), "sheet": (3.175e-3, 5e-5),
     "bolts": (1.0, 0.1)},
    (12, 6),
    "The support is not stated: free. Bolts weigh 15 g on the beam and 12 g on the box, as points. "
    "What holds the parts together is not known: whole faces, or squares around the bolts that are "
    "rigid or averaged; nobody knows which of these a test will be near to.",
)  # fmt: skip


def bolted_frequencies(mesh, *, joint, **parameters):
    """The first eighteen elastic ones with springs in the joints, their stiffness as 10^joint."""
    omega, _ = bolted(parts(mesh, "rbe2", **parameters, **CONES), 10**joint / BOLT[0])
    return {f"bolted, mode {k} [Hz]": float(x) for k, x in enumerate(omega[6:24] / 2 / np.pi, 1)}


BARC_JOINT = Structure(
    "barc_joint",
    bolted_frequencies,
    {"E": (70e9, 1.4e9), "rho": (2700.0, 27.0), "box": (6.35e-3, 2e-4), "sheet": (3.175e-3, 1e-4),
     "bolts": (1.0, 0.25), "joint": (8.786, 0.4)},
    (12, 6),
    "One stiffness of all ten bolts, 10^joint N/m and 1e-5 m^2 of it in N m/rad, between rigid\n"
    "squares as wide as the cones of pressure, fitted to the measured modes 1 to 3; all further\n"
    "modes are predicted. The spreads are wider than those of the first prediction, by what modes\n"
    "4 to 6 then taught: walls as mills roll them, masses of bolts that nobody weighed.",
)  # fmt: skip


def damping():
    """(6,) measured ratios [1]."""
    return np.array(tomllib.loads((FOUND / "barc_joint.toml").read_text())["damping"])
