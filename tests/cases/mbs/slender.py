"""Slender solids that bend far: cantilevers and half an arch, full and reduced."""

import numpy as np
from scipy.sparse import bmat, csc_matrix
from scipy.sparse.linalg import splu

import rom
from cases.boxes import box, distort

E_STEEL = 210e9
STEEL = rom.Material(E=E_STEEL, nu=0.3, rho=7850.0)
TIMBER = rom.Orthotropic((11e9, 0.9e9, 0.5e9), (0.3, 0.4, 0.5), (0.1e9, 0.7e9, 0.6e9), rho=450.0)
# at the crown of half an arch the other half lets it move up and down alone
SYMMETRIC = {"tip": "xyrxryrz"}


def assembled(size=(1.0, 0.1, 0.08), cells=(3, 1, 1), kind="hexahedron", degree=2, **options):
    """A box, its faces "root" and "tip"; `rise` bends it to an arch whose crown is the tip."""
    from rom.fe.elasticity import assemble

    mesh, faces = box(size, cells, kind)
    if options.pop("distorted", False):
        distort(mesh, 0.05)
    if rise := options.pop("rise", 0.0):
        x = mesh.geometry.x
        x[:, 2] += rise * (1 - (1 - x[:, 0] / size[0]) ** 2)
    material = options.pop("material", STEEL)
    assert not options
    facets = {"root": faces["x0"], "tip": faces["x1"]}
    return assemble(mesh, facet_tags=facets, material=material, degree=degree)


def slender(slenderness, cells, nu=0.0, **options):
    """A cantilever 1 m long of square section, and its bending stiffness [N m^2]."""
    h = 1.0 / slenderness
    material = rom.Material(E=E_STEEL, nu=nu, rho=7850.0)
    model = assembled((1.0, h, h), (cells, 1, 1), material=material, **options)
    return model, E_STEEL * h**4 / 12


def reduced(model, loads, *, n_modes=4, kinds="rbe3", certify=False, active=4, **options):
    """Seen from its root, for loads on its tip; options are those of its range, and of `reduce`."""
    method = options.pop("method", rom.CraigBampton(n_modes=n_modes))
    tip, reference = options.pop("tip", kinds), options.pop("reference", "root")
    stress = options.pop("stress", False)
    return rom.reduce(
        model,
        method=method,
        interfaces={"root": kinds, "tip": tip},
        reference=reference,
        nonlinear=rom.Geometric(loads={"tip": loads}, n_modes=active, **options),
        stress=stress,
        certify=certify,
    )


def cantilever(body):
    mech = rom.Mechanism(gravity=(0, 0, 0))
    part = mech.add_flexible("beam", body)
    mech.fixed("wall", mech.ground.marker(part.point(part.marker("root"))), part.marker("root"))
    return mech, part


def tip_of(body, q):
    """Slope [rad], shortening and deflection [m] of the tip."""
    tip = body.marker("tip")
    x, y, _ = tip.translation @ q
    return np.array([np.arcsin((tip.rotation @ q)[2]), -x, y])


class Full:
    """The finite elements at finite strain, "root" and motions of "tip" held in the mean."""

    def __init__(self, model, held=()):
        from rom.eigen.verbs import mean_motion

        self.model, self.solid = model, model.stresses.finite_strain()
        root, tip = (model.interfaces[name] for name in ("root", "tip"))
        self.motion = np.zeros((12, model.n_dofs))
        self.motion[:6, root.dofs], self.motion[6:, tip.dofs] = mean_motion(root), mean_motion(tip)
        self.C = self.motion[[*range(6), *(6 + k for k in held)]]

    def state(self, u, load, moved):
        """Displacement and forces of what is held, near u, under a load on the tip (6,)."""
        for _ in range(40):
            K, gap = self.solid.tangent(u), load @ self.motion[6:] - self.solid.force(u)
            scale = np.abs(K.diagonal()).mean() / np.abs(self.C).max()
            C, target = scale * self.C, scale * (moved - self.C @ u)
            found = splu(csc_matrix(bmat([[K, C.T], [C, None]]))).solve(np.r_[gap, target])
            step, u = found[: u.size], u + found[: u.size]
            if np.linalg.norm(step) < 1e-9 * np.linalg.norm(u):
                return u, -scale * found[u.size :]
        raise AssertionError("the full model does not converge")

    def under(self, load, shares=(0.25, 0.5, 0.75, 1.0)):
        """(12,) mean motion of root and tip under a dead load on the tip, reached in steps."""
        u = np.zeros(self.model.n_dofs)
        for share in shares:
            u, _ = self.state(u, share * np.asarray(load), np.zeros(len(self.C)))
        return self.motion @ u
