"""Wheels for tests: rings of masses, rings of beams, and solid bladed disks of bricks."""

import numpy as np
from scipy.sparse import csr_matrix, identity, kron

from cases.solid import quads_of
from rom.components.wheels.modes import cyclic_modes
from rom.components.wheels.sector import CyclicSector

# of a brick in a grid: its lower corners, then the upper ones
BRICK = [(*c, s) for s in (0, 1) for c in ((0, 0), (0, 1), (1, 1), (1, 0))]


def mass_ring(N, k=3.0e5, coupling=0.7e5, m=0.4):
    """Masses on springs to the ground, joined by springs: omega^2 = (k + 4 c sin^2(pi n/N)) / m.

    Each mass is cut in two halves, one on either face of its sector.
    """
    spring = coupling * np.array([[1.0, -1.0], [-1.0, 1.0]])
    K = csr_matrix(spring + 0.5 * k * np.eye(2))
    return CyclicSector(N, K, 0.5 * m * identity(2, format="csr"), np.array([1]), np.array([0]),
                        identity(1, format="csr"))  # fmt: skip


def bladed_ring(N, *, k_blade=4.3e5, m_blade=0.0114, k_disk=2.2e6, m_disk=0.43, coupling=3.0e6):
    """Blades on disk masses that are grounded and joined by springs; dofs disk, blade, disk.

    The disk mass is cut in two halves, dofs 0 and 2; the region "blade" is the blade's spring.
    """
    join = coupling * np.array([[1.0, 0, -1], [0, 0, 0], [-1, 0, 1]])
    blade = k_blade * np.array([[1.0, -1, 0], [-1, 1, 0], [0, 0, 0]])
    K = join + blade + 0.5 * k_disk * np.diag([1.0, 0, 1])
    M = np.diag([0.5 * m_disk, m_blade, 0.5 * m_disk])
    return CyclicSector(
        N, csr_matrix(K), csr_matrix(M), np.array([2]), np.array([0]), identity(1, format="csr"),
        regions={"blade": csr_matrix(blade)},
    )  # fmt: skip


def ring_frequency(n, EI, rho_A, R):
    """In-plane flexural circular frequency of a thin inextensible ring (Love)."""
    return np.sqrt(n**2 * (n**2 - 1) ** 2 / (n**2 + 1) * EI / (rho_A * R**4))


def beam_ring(N=24, per_sector=8, *, EA=1e9, EI=1.0, rho_A=1.0, R=1.0, rotary=1e-9):
    """Ring of straight beams in its plane, dofs u, v, theta per node; masses in the nodes."""
    phi = np.linspace(0.0, 2 * np.pi / N, per_sector + 1)
    points = R * np.column_stack([np.cos(phi), np.sin(phi), 0 * phi])
    n = 3 * points.shape[0]
    K, M = np.zeros((n, n)), np.zeros((n, n))
    for e in range(per_sector):
        arm = points[e + 1] - points[e]
        dofs = np.arange(3 * e, 3 * e + 6)
        L = np.linalg.norm(arm)
        K_e = _beam(L, np.arctan2(arm[1], arm[0]), EA, EI)
        M_e = np.diag([1.0, 1.0, rotary * L**2] * 2) * rho_A * L / 2
        K[np.ix_(dofs, dofs)] += K_e
        M[np.ix_(dofs, dofs)] += M_e
    G = np.zeros((3, 3))
    G[0, 1], G[1, 0] = -2.0, 2.0  # 2 e_z x v, of u and v
    alpha = 2 * np.pi / N
    turn = np.array([[np.cos(alpha), -np.sin(alpha), 0], [np.sin(alpha), np.cos(alpha), 0],
                     [0, 0, 1]])  # fmt: skip
    return CyclicSector(
        N, csr_matrix(K), csr_matrix(M), np.arange(n - 3, n), np.arange(3), csr_matrix(turn),
        coriolis=csr_matrix(M @ kron(identity(n // 3), G).toarray()),
        centrifugal=csr_matrix((n, n)),
    )  # fmt: skip


def _beam(L, angle, EA, EI):
    a, b = EA / L, EI / L**3
    K = np.array([
        [a, 0, 0, -a, 0, 0],
        [0, 12 * b, 6 * b * L, 0, -12 * b, 6 * b * L],
        [0, 6 * b * L, 4 * b * L**2, 0, -6 * b * L, 2 * b * L**2],
        [-a, 0, 0, a, 0, 0],
        [0, -12 * b, -6 * b * L, 0, 12 * b, -6 * b * L],
        [0, 6 * b * L, 2 * b * L**2, 0, -6 * b * L, 4 * b * L**2],
    ])  # fmt: skip
    c, s = np.cos(angle), np.sin(angle)
    T = np.kron(np.eye(2), [[c, s, 0], [-s, c, 0], [0, 0, 1]])
    return T.T @ K @ T


def bladed_mesh(  # noqa: PLR0913  one keyword per size
    N, sectors=1, *, bore=0.05, rim=0.10, tip=0.16, width=0.02, cells=(4, 3, 3, 2), blade=(1, 3),
    offset=0.0, twist=0.0,
):  # fmt: skip
    """Bricks of some sectors of a disk with straight blades, with the faces of what is cut.

    N sectors close the wheel, which is a ring if its tip is the rim. Cells are around, along the
    radius of the disk, of the blade, along the axis; a blade stands on lines of cells around, first
    and last. An offset shifts nodes inside each sector, so that its faces have other nodes; a twist
    [rad] turns the faces with z.
    """
    around, along, up, across = cells
    up = up if tip > rim else 0
    total, closed = around * sectors, sectors == N
    radii = np.r_[np.linspace(bore, rim, along + 1), np.linspace(rim, tip, up + 1)[1:]]
    columns = total if closed else total + 1
    i, j, k = np.meshgrid(
        np.arange(columns), np.arange(radii.size), np.arange(across + 1), indexing="ij"
    )
    z = width * (k / across - 0.5)
    share = np.arange(columns) / around
    z = z + offset * width * share[:, None, None] * (1 - (2 * k / across - 1) ** 2)
    phi = 2 * np.pi / N * i / around + twist * z / width
    r = radii[j]
    points = np.stack([r * np.cos(phi), r * np.sin(phi), z], axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(i.shape)
    cubes, regions = [], []
    for c in np.ndindex(total, radii.size - 1, across):
        on_blade = c[1] >= along
        if on_blade and not blade[0] <= c[0] % around < blade[1]:
            continue
        cubes.append([number[(c[0] + a) % columns, c[1] + b, c[2] + d] for a, b, d in BRICK])
        regions.append(2 if on_blade else 1)
    inside = number[:, 0]
    facets = {"bore": quads_of(np.vstack([inside, inside[:1]]) if closed else inside)}
    if not closed:
        facets |= {"cyclic_low": quads_of(number[0, : along + 1]),
                   "cyclic_high": quads_of(number[-1, : along + 1])}  # fmt: skip
    names = {1: "disk", 2: "blade"} if up else {1: "disk"}
    return _meshed(points, cubes, regions, names, facets)


def _meshed(points, cubes, regions, names, facets):
    """The bricks with the nodes that they use, tested."""
    from rom.fe.mesh.solid import SolidMesh
    from rom.fe.mesh.validate import checked

    used, cubes = np.unique(cubes, return_inverse=True)
    place = np.full(len(points), -1)
    place[used] = np.arange(used.size)
    facets = {name: place[quads] for name, quads in facets.items()}
    mesh = points[used], cubes.reshape(-1, 8), "hex8", np.array(regions), names, facets
    return checked(SolidMesh(*mesh))


def revolved_mesh(N, r, z, solid, faces):
    """Bricks of one sector of a body of revolution about z, one cell around.

    Radii r (a,) are of circles whose area polygons of N corners have. A solid is (radius, z of the
    middle of a cell) -> its region, or nothing; faces {name: (z, largest r)} are interfaces.
    """
    angle = 2 * np.pi / N
    i, j, k = np.meshgrid(np.arange(2), np.arange(len(r)), np.arange(len(z)), indexing="ij")
    R = np.asarray(r)[j] / np.sqrt(np.sin(angle) / angle)
    points = np.stack([R * np.cos(angle * i), R * np.sin(angle * i), np.asarray(z)[k]], axis=-1)
    number = np.arange(i.size).reshape(i.shape)
    made = {c: solid((r[c[0]] + r[c[0] + 1]) / 2, (z[c[1]] + z[c[1] + 1]) / 2)
            for c in np.ndindex(len(r) - 1, len(z) - 1)}  # fmt: skip
    there = [c for c, name in made.items() if name]
    names = dict(enumerate(sorted({made[c] for c in there}), start=1))
    tags = {name: tag for tag, name in names.items()}
    cubes = np.array([[number[a, j + b, k + d] for a, b, d in BRICK] for j, k in there])
    quad = [(0, 0), (1, 0), (1, 1), (0, 1)]
    facets = {
        name: np.array([[number[side, j + b, k + d] for b, d in quad] for j, k in there])
        for side, name in enumerate(("cyclic_low", "cyclic_high"))
    }
    for name, (at, outside) in faces.items():
        plane = int(np.argmin(abs(np.asarray(z) - at)))
        radial = [j for j in range(len(r) - 1) if r[j + 1] <= outside * (1 + 1e-9)]
        facets[name] = np.array([[number[a, j + b, plane] for a, b in quad] for j in radial])
    regions = [tags[made[c]] for c in there]
    return _meshed(points.reshape(-1, 3), cubes, regions, names, facets)


def bladed_model(N, sectors=1, degree=2, material=None, **sizes):
    """FEModel of `bladed_mesh`; Titanium-like material unless given."""
    return model_of(bladed_mesh(N, sectors, **sizes), degree=degree, material=material)


def model_of(mesh, degree=2, material=None):
    """FEModel of a mesh; Titanium-like material unless given."""
    from mpi4py import MPI

    import rom
    from rom.fe.elasticity import assemble
    from rom.fe.jit import compiling
    from rom.fe.mesh.read import to_dolfinx

    with compiling(MPI.COMM_SELF):
        grid, cell_tags, facet_tags = to_dolfinx(mesh, MPI.COMM_SELF)
    regions = {name: tag for tag, name in mesh.region_names.items()}
    return assemble(grid, cell_tags, facet_tags, degree=degree, regions=regions,
                    material=material or rom.Material(E=114e9, nu=0.33, rho=4430.0))  # fmt: skip


def tip_of(model):
    """First dof of a node farthest out."""
    return 3 * int(np.argmax(np.hypot(*model.points[:, :2].T)))


def response_of(sector, modes, force, sweep, *, engine_order, damping, at):
    """(sweep, sectors, dofs) motion of a wheel, of whose modes all have one damping ratio."""
    omega, Phi = modes
    phase = np.exp(1j * engine_order * sector.angle * np.arange(sector.n_sectors))
    load = Phi.T @ np.kron(phase, force[sector.free])
    gap = omega**2 - sweep[:, None] ** 2 + 2j * damping * sweep[:, None] * omega
    rows = np.searchsorted(sector.free, at)
    return ((load / gap) @ Phi.T).reshape(len(sweep), sector.n_sectors, -1)[:, :, rows]


def gathered(sector, n_modes, **speed):
    """All frequencies of a wheel [rad/s], ascending, each as often as the wheel has it."""
    families = [cyclic_modes(sector, n, n_modes, **speed) for n in sector.diameters]
    return np.sort(np.concatenate([np.repeat(f.omega, f.multiplicity) for f in families]))
