"""What the benchmarks measure without FEniCSx: a bar of bricks, and mechanisms."""

from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import bmat, csr_matrix, identity, kron

from rom.errors import ConfigError
from rom.model import FEModel, Interface, Material
from rom.places import FOLDER_ABOVE

KINDS = {"root": "rbe2", "tip": "rbe2"}

STEEL = Material(E=210e9, nu=0.3, rho=7850.0)
TITANIUM = Material(E=114e9, nu=0.33, rho=4430.0)
CRANK_SPEED = 300.0  # [rad/s]


def bar(size: tuple[float, ...], cells: tuple[int, ...], material: Material = STEEL) -> FEModel:
    """A straight bar of bricks with 27 nodes; its ends are the interfaces "root" and "tip".

    On a grid, integrals over the bar are Kronecker products of integrals along its edges.
    """
    along = [_line(length, n) for length, n in zip(size, cells, strict=True)]
    lines = [np.linspace(0.0, length, 2 * n + 1) for length, n in zip(size, cells, strict=True)]
    points = np.array(np.meshgrid(*lines, indexing="ij")).reshape(3, -1).T

    def integral(c: int | None = None, d: int | None = None) -> Any:
        """Of N_i N_j, the first derived along axis c and the second along d."""
        mx, my, mz = (line[int(a == c), int(a == d)] for a, line in enumerate(along))
        return kron(kron(mx, my), mz)

    lam, mu = material.stiffness[0, 1], material.stiffness[3, 3]
    shear = mu * sum(integral(c, c) for c in range(3))
    blocks = [
        [lam * integral(c, d) + mu * integral(d, c) + (c == d) * shear for d in range(3)]
        for c in range(3)
    ]
    node_by_node = np.arange(points.size).reshape(3, -1).T.ravel()
    K = csr_matrix(bmat(blocks))[node_by_node][:, node_by_node]
    M = material.rho * kron(integral(), identity(3))
    face = kron(along[1][0, 0], along[2][0, 0])
    numbers = np.arange(len(points)).reshape(-1, face.shape[0])
    ends = {
        name: Interface(name, nodes, points[nodes], csr_matrix(face), points[nodes].mean(axis=0))
        for name, nodes in (("root", numbers[0]), ("tip", numbers[-1]))
    }
    return FEModel(0.5 * (K + K.T), csr_matrix(M), points, ends)


def _line(length: float, cells: int) -> dict[tuple[int, int], Any]:
    """Integrals of the products of quadratic shape functions and their derivatives on a line.

    Returns:
        {(p, q): (2 cells + 1,) * 2 sparse matrix of the integrals of N_i^(p) N_j^(q)}.
    """
    h = length / cells
    slope = np.array([[-3, -4, 1], [4, 0, -4], [-1, 4, 3]]) / 6
    elements = {
        (0, 0): np.array([[4, 2, -1], [2, 16, 2], [-1, 2, 4]]) * h / 30,
        (1, 0): slope,
        (0, 1): slope.T,
        (1, 1): np.array([[7, -8, 1], [-8, 16, -8], [1, -8, 7]]) / (3 * h),
    }
    whole = {key: np.zeros((2 * cells + 1,) * 2) for key in elements}
    for key, element in elements.items():
        for first in range(0, 2 * cells, 2):
            whole[key][first : first + 3, first : first + 3] += element
    return {key: csr_matrix(matrix) for key, matrix in whole.items()}


def slider_crank(rod: Any = None) -> Any:
    """Crank of 40 mm at full speed, a flexible rod or a rigid one of 160 mm, a slider of 0.3 kg."""
    from rom.mbs.mechanism import Mechanism

    mech, radius = Mechanism(gravity=(0, -9.81, 0)), 0.04
    ends = {"root": np.array([-0.08, 0, 0]), "tip": np.array([0.08, 0, 0])}
    if rod is not None:
        ends = {name: rod.marker(name).point for name in ends}
    a, b = ends["root"], ends["tip"]
    turning = np.array([0, 0, -CRANK_SPEED * radius / (b - a)[0]])  # the slider stands still
    rising = np.array([0, CRANK_SPEED * radius, 0]) - np.cross(turning, a)
    moving: dict[str, Any] = {"velocity": rising, "omega": turning}
    crank = mech.add_rigid(
        "crank",
        mass=1.0,
        inertia=(6e-4, 9e-4, 6e-4),
        at=(0, 0, 0),
        omega=(0, 0, CRANK_SPEED),
        markers={"pin": (radius, 0, 0)},
    )
    at = np.array([radius, 0, 0]) - a
    if rod is None:
        shape: dict[str, Any] = {"mass": 0.3, "inertia": (1e-5, 7e-4, 7e-4), "markers": ends}
        bar = mech.add_rigid("rod", at=at, **shape, **moving)
    else:
        bar = mech.add_flexible("rod", rod, at=at, **moving)
    end = np.array([radius, 0, 0]) + b - a
    slider = mech.add_rigid("slider", mass=0.3, inertia=(1e-4,) * 3, at=end)
    z, origin = (0, 0, 1), (0.0, 0.0, 0.0)
    mech.revolute("main", mech.ground.marker(origin), crank.marker(origin), axis=z)
    mech.revolute("crank pin", crank.marker("pin"), bar.marker("root"), axis=z)
    mech.revolute("wrist pin", bar.marker("tip"), slider.marker(origin), axis=z)
    mech.prismatic("guide", mech.ground.marker(end), slider.marker(origin), axis=(1, 0, 0))
    mech.drive("motor", "main", lambda t: CRANK_SPEED * t)
    return mech


def rigid_chain(n: int) -> Any:
    """So many rigid links of half a metre in a row along x, hinged about z."""
    from rom.mbs.mechanism import Mechanism

    mech, ends = Mechanism(gravity=(0, -9.81, 0)), {"a": (-0.25, 0, 0), "b": (0.25, 0, 0)}
    before = mech.ground.marker((0.0, 0.0, 0.0))
    for k in range(n):
        kept: dict[str, Any] = {"mass": 1.0, "inertia": (1e-3, 0.02, 0.02), "markers": ends}
        link = mech.add_rigid(f"link {k}", at=(0.25 + 0.5 * k, 0, 0), **kept)
        mech.revolute(f"pin {k}", before, link.marker("a"), axis=(0, 0, 1))
        before = link.marker("b")
    return mech


def top() -> Any:
    """A top of 15 kg on its tip, which spins with 150 rad/s a metre away from it.

    Source:
        Bruels, Cardona, Arnold, Mech. Mach. Theory 48 (2012) 121.
    """
    from rom.mbs.mechanism import Mechanism

    mech, centre, omega = Mechanism(gravity=(0, 0, -9.81)), (0.0, 1.0, 0.0), (0.0, 150.0, -4.61538)
    kept: dict[str, Any] = {"mass": 15.0, "inertia": (0.234375, 0.46875, 0.234375), "omega": omega}
    velocity = np.cross(omega, centre)
    body = mech.add_rigid("top", at=centre, velocity=velocity, markers={"tip": (0, -1, 0)}, **kept)
    mech.spherical("tip", mech.ground.marker((0.0, 0.0, 0.0)), body.marker("tip"))
    return mech


def geometry(name: str) -> Path:
    """Path of a geometry that comes with the source tree.

    Raises:
        ConfigError: if the package was installed without it.
    """
    path = FOLDER_ABOVE / "meshes" / f"{name}.geo"
    if not path.is_file():
        raise ConfigError(
            f"{path} does not exist: benchmarks need the source tree.", hint="Clone the project."
        )
    return path


def shaft_in_films(cavitation: Any) -> Any:
    """A free shaft with an unbalance in two oil films of 120 x 8 cells."""
    from rom.components.journal_bearing.films.bearing import Groove, JournalBearing
    from rom.mbs.mechanism import Mechanism

    mech, z = Mechanism(gravity=(0, -9.81, 0)), (0, 0, 1)
    shaft = mech.add_rigid("shaft", mass=40.0, inertia=(1.0, 1.0, 0.1), at=(0, 0, 0),
                           omega=(0, 0, 300.0))  # fmt: skip
    film = JournalBearing(0.1, 0.05, 1e-4, [Groove(np.pi / 2, 0.35)], cavitation=cavitation)
    for k, side in enumerate((-0.3, 0.3)):
        ends = shaft.marker((2e-5, 0, side)), mech.ground.marker((0, 0, side))
        mech.journal_bearing(f"film {k}", *ends, axis=z, bearing=film, oil=0.03)
    return mech


def planetary_train(**more: Any) -> Any:
    """Three planets between a driven sun and a ring on springs; a wheel pair and its stiffness.

    The carrier is braked.

    Args:
        more: what else the meshes are given.
    """
    from rom.components.gear_mesh.gears.geometry import GearPair
    from rom.mbs.mechanism import Mechanism

    sun_pair = GearPair((24, 24), 2e-3, 0.02, thinning=2e-5)
    ring_pair = GearPair((24, -72), 2e-3, 0.02, thinning=2e-5)
    mech, z, origin = Mechanism(gravity=(0, 0, 0)), (0, 0, 1), (0.0, 0.0, 0.0)
    law: dict[str, Any] = {"stiffness": 1.3e10, "damping": 2e-5} | more
    wheels = {}
    for name, inertia in (("sun", 1e-4), ("ring", 2e-3), ("carrier", 5e-4)):
        part = mech.add_rigid(name, mass=0.2, inertia=(inertia,) * 3, at=origin)
        mech.revolute(f"{name} axle", mech.ground.marker(origin), part.marker(origin), axis=z)
        wheels[name] = part
    sun, ring, carrier = (wheels[name] for name in ("sun", "ring", "carrier"))
    mech.rotational_spring("housing", "ring axle", stiffness=1e6, damping=20.0)
    mech.drive("motor", "sun axle", lambda t: 80.0 * t, rate=lambda t: 80.0 + 0 * t)
    mech.torque("brake", carrier.marker(origin), (0, 0, -40.0))
    for k, angle in enumerate(2 * np.pi * np.arange(3) / 3):
        at = sun_pair.distance * np.array([np.cos(angle), np.sin(angle), 0.0])
        planet = mech.add_rigid(f"planet {k}", mass=0.2, inertia=(5e-5,) * 3, at=at)
        mech.revolute(f"pin {k}", carrier.marker(at), planet.marker(origin), axis=z)
        middle = planet.marker(origin)
        mech.gear_mesh(f"sun {k}", sun.marker(origin), middle, axis=z, pair=sun_pair, **law)
        mech.gear_mesh(f"ring {k}", middle, ring.marker(origin), axis=(0, 0, -1), pair=ring_pair,
                       **law)  # fmt: skip
    return mech, sun_pair, law["stiffness"]
