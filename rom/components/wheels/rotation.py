"""What rotation does to a sector: stress that stiffens, spin that softens, Coriolis forces.

In axes that turn with the wheel, small vibrations about its steady state obey::

    M u'' + Omega G u' + (K + Omega^2 C) u = f,    G = 2 M (I (x) S),    C = K_geo - M (I (x) P)

with S = skew(e) of the axis e, P = I - e e^T, and K_geo the geometric stiffness of the stress that
centrifugal force leaves at one rad/s. Coriolis and softening matrices follow from the mass matrix
alone, because equal functions interpolate all three directions.
"""

from dataclasses import replace
from typing import Annotated

import numpy as np
from scipy.linalg import LinAlgError, eigh
from scipy.sparse import csr_matrix, identity, kron
from scipy.sparse.linalg import LinearOperator, eigsh, splu

from rom.arguments import NotNegative, typed
from rom.components.wheels.sector import CyclicSector, Matrix, stresses_of
from rom.eigen.search import MAX_DENSE_DOFS
from rom.eigen.verbs import pins
from rom.eigen.workers import held_solution
from rom.errors import ConfigError, InterfaceError, ModelError
from rom.model import Array, FEModel, Index, Interface
from rom.rotation import skew

Rate = Annotated[float, NotNegative("N/m")]  # of a spring
EIGENVECTOR_RTOL = 1e-7  # residual of eigenvectors; the error of separate eigenvalues is its square
NONE_POSITIVE = 1e-4  # of the largest size: round-off of solutions with slender solids


@typed
def rotating_sector(sector: CyclicSector, model: FEModel) -> CyclicSector:
    """The sector with the matrices of its rotation, for all speeds.

    The wheel turns about the axis of the sector, made from the model by `CyclicSector.from_model`;
    its centrifugal stress is that of the linear solid, and grows with the square of the speed.

    Raises:
        ConfigError: if the model has no finite elements, or carries attachments.

    Source:
        Friswell, Penny, Garvey and Lees, Dynamics of Rotating Machines (2010); see
        docs/theory/rotating_solids.md.
    """
    stresses = stresses_of(model)
    refuse_attachments(model)
    K_geo = stresses.prestress(centrifugal_displacement(sector))
    coriolis, softening = rotation_matrices(sector.M, sector.axis)
    return replace(sector, coriolis=coriolis, centrifugal=csr_matrix(K_geo - softening))


def refuse_attachments(model: FEModel) -> None:
    """Nobody knows how what is attached turns."""
    if model.attachments:
        text = f"the model carries {len(model.attachments)} attachments, of which none turns"
        raise ConfigError(f"{text}; mesh them as a region of their own density.")


def rotation_matrices(M: Matrix, axis: Array) -> tuple[csr_matrix, csr_matrix]:
    """Coriolis matrix per rad/s and softening M (I (x) P) per (rad/s)^2, (n, n) each [kg].

    M (n, n) is the mass of a solid, the same for all directions [kg], the axis (3,) a unit vector
    [1].

    Source:
        See docs/theory/rotating_solids.md for G and the softening.
    """
    nodes = identity(M.shape[0] // 3)
    turn, across = skew(axis), np.eye(3) - np.outer(axis, axis)
    G, P = (csr_matrix(M @ kron(nodes, A, format="csr")) for A in (turn, across))
    return csr_matrix(G - G.T), 0.5 * (P + P.T)


def centrifugal_displacement(sector: CyclicSector) -> Array:
    """(n,) displacement of the sector in a wheel that turns at 1 rad/s [m].

    Raises:
        ConfigError: if the matrices of the sector do not fit each other.

    Source:
        See docs/theory/rotating_solids.md for the linear solid in steady rotation.
    """
    T = sector.harmonic(0)
    load = sector.M @ arms(sector, sector.points).ravel()
    waves = T.T @ sector.K @ T, T.T @ sector.M @ T
    return T @ held_solution(sector.workers, waves, axial_pins(sector), T.T @ load)


def arms(sector: CyclicSector, points: Array) -> Array:
    """(k, 3) vectors from the axis of rotation to points, across it [m]."""
    x = points - sector.at
    return x - np.outer(x @ sector.axis, sector.axis)


def axial_pins(sector: CyclicSector) -> Index:
    """Independent dofs that keep a free wheel from moving along its axis and turning about it.

    Loads that are the same in all sectors and balance each other leave them without force.
    """
    return pins(sector.rigid(0)[sector.free].real)


def divergence_speed(sector: CyclicSector, diameter: int) -> float:
    """Speed [rad/s] at which rotation has used up the stiffness; infinite if it never does.

    The smallest Omega with a singular K + Omega^2 C at this number of nodal diameters, Coriolis
    forces left out, of a supported sector with matrices of rotation.

    Raises:
        ModelError: if nothing holds the wheel even at rest.

    Source:
        See docs/theory/rotating_solids.md for the matrices of rotation.
    """
    T = sector.harmonic(sector.checked(diameter))
    H = T.conj().T
    most = largest_ratio(csr_matrix(-(H @ sector.centrifugal @ T)), csr_matrix(H @ sector.K @ T))
    return float(1 / np.sqrt(most)) if most > 0 else np.inf


def largest_ratio(C: csr_matrix, K: csr_matrix) -> float:
    """Largest eigenvalue mu of C x = mu K x, zero if none is positive.

    C (n, n) is symmetric or Hermitian, and so is K, which must be positive definite.
    """
    if K.shape[0] <= MAX_DENSE_DOFS:
        try:
            return max(float(eigh(C.toarray(), K.toarray(), eigvals_only=True)[-1]), 0.0)
        except LinAlgError as error:
            text = "nothing holds the wheel, even at rest: see fixed= and rom.supported_sector."
            raise ModelError(text) from error
    inverse = LinearOperator(K.shape, matvec=splu(K.tocsc()).solve, dtype=K.dtype)
    start = np.sin(1.0 + np.arange(K.shape[0])).astype(K.dtype)
    how = {"Minv": inverse, "v0": start, "return_eigenvectors": False}
    size = float(abs(eigsh(C, 1, K, which="LM", tol=0.1, **how)[0]))
    if size == 0.0:
        return 0.0
    # where none is positive they crowd at zero, which has no relative accuracy; one has
    most = float(eigsh(C / size + K, 1, K, which="LA", tol=EIGENVECTOR_RTOL, **how)[0]) - 1.0
    return most * size if most > NONE_POSITIVE else 0.0


@typed
def supported_sector(
    sector: CyclicSector, face: Interface, *, across: Rate = 0.0, along: Rate = 0.0
) -> CyclicSector:
    """The sector of a wheel or rotor that rests on springs, spread evenly over a face of it.

    Springs that are the same for all directions across the axis look the same from axes that turn
    with the wheel: this is an isotropic bearing. Give a rotor its matrices of rotation before.

    Args:
        sector: with or without matrices of rotation.
        face: interface of the model the sector was made from, where it rests.
        across: stiffness of the whole wheel's support across the axis [N/m].
        along: along the axis [N/m].

    Raises:
        ConfigError: if the stiffness is not positive in any direction, or negative in one.
        InterfaceError: if the sector has no such nodes.

    Source:
        Isotropic bearings seen from the rotor: Friswell, Penny, Garvey and Lees, Dynamics of
        Rotating Machines (2010); see docs/theory/rotating_solids.md.
    """
    if across + along == 0.0:
        raise ConfigError("springs of 0 N/m across and along the axis hold nothing; give one.")
    if sector.points is None or face.dofs.max() >= sector.n:
        raise InterfaceError(f"{face.name!r} is no interface of the model of the sector.")
    e = sector.axis
    each = across * (np.eye(3) - np.outer(e, e)) + along * np.outer(e, e)
    share = kron(face.surface_mass / face.area, each / sector.n_sectors, format="coo")
    at = face.dofs
    K = csr_matrix((share.data, (at[share.row], at[share.col])), shape=sector.K.shape)
    return replace(sector, K=csr_matrix(sector.K + K), motions=None, sprung=True)
