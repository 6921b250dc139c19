"""Point masses and rigid bodies carried by an interface.

A rigid body has the same kinetic energy as six point masses m/6 on its principal axes
(equimomental system). Carried along by the mean motion of an interface they enter the mass matrix
and all inertia integrals as six more nodes, with no formula of their own.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix

from rom.arguments import positive
from rom.eigen.verbs import coupled, mean_motion, rigid_motions
from rom.errors import InterfaceError, MaterialError
from rom.model import Array, Attachment, FEModel, Interface
from rom.names import check_known
from rom.plausible import REACH, warn_outside


def point_masses(attachment: Attachment, origin: Array) -> tuple[Array, Array]:
    """Points (6, 3) [m] and masses (6,) [kg] with the mass, centre and inertia of the attachment.

    The origin (3,) is where the mass centre is when ``attachment.at`` is None [m].
    """
    m, J = attachment.mass, np.asarray(attachment.inertia, dtype=float)
    at = origin if attachment.at is None else np.asarray(attachment.at, dtype=float)
    positive(f"mass of the attachment on {attachment.interface!r} [kg]", m, error=MaterialError)
    second, axes = np.linalg.eigh(0.5 * np.trace(J) * np.eye(3) - J)  # integral of rho x x^T
    if J.shape != (3, 3) or second.min() < -1e-9 * max(second.max(), 1e-300):
        text = f"attachment on {attachment.interface!r}: no body has this inertia; each principal"
        raise MaterialError(f"{text} moment must be at most the sum of the two others.")
    arms = axes * np.sqrt(3 * np.maximum(second, 0.0) / m)
    return at + np.vstack([arms.T, -arms.T]), np.full(6, m / 6)


@dataclass(frozen=True, slots=True)
class Carried:
    """Point masses on an interface: points (p, 3), masses (p,), N (3 p, 3 k) from its dofs."""

    interface: Interface
    points: Array
    masses: Array
    N: Array


def carried_displacements(attachment: Attachment, model: FEModel) -> Carried:
    """Six point masses, and how they move with the dofs of the interface.

    One node that cannot turn carries one point mass.

    Raises:
        InterfaceError: if the interface is unknown or does not know its rotation.
        MaterialError: if the mass is not positive or no body has the inertia.
    """
    name = attachment.interface
    text = f"an attachment names the interface {name!r}; the model has"
    check_known(name, model.interfaces, text, InterfaceError)
    interface = model.interfaces[name]
    points, masses = point_masses(attachment, interface.origin)
    reach, size = np.abs(points - interface.origin).max(), np.ptp(model.points, axis=0).max()
    warn_outside(REACH, float(reach / size), f"the attachment on {interface.name!r}")
    if interface.nodes.size == 1 and interface.rotations is None:
        if np.abs(points - interface.points).max() > 0.0:
            text = f"the one node of {name!r} cannot turn, so it carries no inertia and no offset"
            raise InterfaceError(f"{text}; hang them on an interface of several nodes.")
        return Carried(interface, interface.points, np.array([attachment.mass]), np.eye(3))
    N = rigid_motions(points - interface.origin) @ mean_motion(interface)
    return Carried(interface, points, masses, N)


def added_mass(model: FEModel, first: int, n_local: int) -> csr_matrix | None:
    """Sparse (n_local, n) mass of all attachments, the rows of this process; None without any."""
    if not model.attachments:
        return None
    shape = (n_local, model.n_dofs)
    added = csr_matrix(shape)
    for attachment in model.attachments:
        c = carried_displacements(attachment, model)
        block = c.N.T @ (np.repeat(c.masses, 3)[:, None] * c.N)
        added = added + coupled(shape, first, c.interface.dofs, block)
    return added
