"""A-priori interface functions: the shapes a surface may take are chosen before anything is solved.

A surface of k nodes follows m orthogonal functions per direction, u_b = (Q (x) I_3) a. The
constraint modes are then 3 m solutions instead of 3 k, and nothing of the full size is formed.

Source:
    Carassale and Maurici, Interface reduction in Craig-Bampton component mode synthesis by
    orthogonal polynomial series, J. Eng. Gas Turbines Power 140 (2018); in our own reconstruction:
    polynomials in the three ambient coordinates, orthonormal on the actual nodes with the surface
    mass, dependent ones dropped. That needs no parametrisation of a curved surface.
"""

from dataclasses import dataclass
from itertools import product
from typing import Annotated

import numpy as np
from numpy.polynomial.legendre import legvander

from rom.arguments import Count, typed
from rom.eigen.verbs import DEPENDENT_RTOL, on_a_line, orthonormal_in
from rom.errors import ConfigError, InterfaceError
from rom.model import Array, Interface

ON_AXIS = 1e-6  # distance from an axis, of the size, where the angle about it is round-off
EXTENT_RTOL = 1e-9  # extent of a surface that counts as none, of its largest one
MOST_VALUES = 10**8  # of all functions at all nodes: 0.8 GB


@typed
@dataclass(frozen=True, slots=True)
class Polynomial:
    """All polynomials up to a total degree.

    On a plane that makes (p+1)(p+2)/2 functions, on cylinders, spheres and other quadrics (p+1)^2,
    on any other surface (p+1)(p+2)(p+3)/6, per direction.

    Attributes:
        order: total degree p >= 1; with p = 1 the surface moves rigidly or strains uniformly.
            Without a number the lowest one is chosen that meets the band and the tolerance of
            ``CraigBampton(f_max=…, tol=…)``.

    Example:
        >>> steel = rom.Material(E=210e9, nu=0.3, rho=7850.0)
        >>> beam = rom.fe.model("meshes/beam.geo", material=steel)
        >>> kinds = {"root": "rbe2", "tip": rom.Polynomial(order=1)}  # 3 functions, 3 directions
        >>> rom.reduce(beam, method=rom.Guyan(), interfaces=kinds, certify=False).n_modes
        9
    """

    order: Annotated[int, Count(1)] | None = None

    def functions(self, interface: Interface) -> Array:
        """(k, n) functions [1] at the nodes, from low to high degree; some may depend on others.

        Raises:
            ConfigError: if the order is still open, or far beyond what the nodes can tell apart.
        """
        if self.order is None:
            text = f"the order of the polynomials on {interface.name!r} is open."
            hint = "Give one: only rom.reduce with CraigBampton(f_max=…, tol=…) chooses it."
            raise ConfigError(text, hint=hint)
        p = self.order
        _refuse_many((p + 1) * (p + 2) * (p + 3) // 6, interface, f"order {p}")
        x = _local(interface)
        values = [legvander(column, p) for column in x.T]
        every = product(range(p + 1), repeat=3)
        degrees = sorted((degree for degree in every if sum(degree) <= p), key=sum)
        return np.column_stack(
            [values[0][:, i] * values[1][:, j] * values[2][:, k] for i, j, k in degrees]
        )


@typed
@dataclass(frozen=True, slots=True)
class FourierLegendre:
    """Harmonics around an axis times Legendre polynomials along it, for cylindrical seats.

    Attributes:
        harmonics: highest harmonic n >= 1 in cos(n theta) and sin(n theta).
        order: highest degree along the axis, >= 0.

    Example:
        >>> rom.FourierLegendre(harmonics=4, order=2)  # of a bore that an oil film bends
        FourierLegendre(harmonics=4, order=2)
    """

    harmonics: Annotated[int, Count(1)]
    order: Annotated[int, Count(0)]

    def functions(self, interface: Interface) -> Array:
        """(k, n) functions [1] at the nodes; linear ones first, so that rigid motions are exact.

        Raises:
            ConfigError: if there are far more of them than the nodes can tell apart.
            InterfaceError: if the surface is not one around an axis.
        """
        asked = f"{self.harmonics} harmonics and order {self.order}"
        _refuse_many((2 * self.harmonics + 1) * (self.order + 1), interface, asked)
        theta, zeta = cylinder_coordinates(interface)
        around = [np.ones_like(theta)]
        for n in range(1, self.harmonics + 1):
            around += [np.nan_to_num(wave(n * theta)) for wave in (np.cos, np.sin)]
        along = legvander(zeta, self.order).T
        products = [ring * line for line in along for ring in around]
        return np.column_stack([np.ones_like(theta), _local(interface), *products])


def interface_functions(kind: Polynomial | FourierLegendre, interface: Interface) -> Array:
    """(k, m) functions with Q^T S Q = I, S the surface mass; dependent ones are left out."""
    S, V = interface.surface_mass, kind.functions(interface)
    size = np.sqrt(S.sum())  # of the constant function; all others reach one
    norms = np.sqrt(np.einsum("km,km->m", V, S @ V))
    # cosines of right angles are round-off
    Q = orthonormal_in(S, V[:, norms > DEPENDENT_RTOL * size])
    linear = np.linalg.matrix_rank(_local(interface), tol=1e-6)
    if linear < 2 or Q.shape[1] < 3:
        raise on_a_line(interface)
    return Q


def cylinder_coordinates(interface: Interface) -> tuple[Array, Array]:
    """(k,) angle about the axis of a surface of revolution, and (k,) place along it in [-1, 1].

    On the axis itself the angle is NaN, and harmonics are zero.

    The axis is that of the geometry where it is known; else the principal direction of the area
    whose moment differs from the two others, through the centroid. The angle counts from the
    ambient axis farthest from it.
    """
    x = interface.points - (_centroid(interface) if interface.axis is None else interface.origin)
    axis = _principal_axis(interface, x) if interface.axis is None else interface.axis
    size = np.round(np.abs(axis), 6)  # bodies that share the surface must choose alike
    axis = axis * np.sign(axis[np.argmax(size)])
    e = np.eye(3)[np.argmin(size)]
    e = (e - (e @ axis) * axis) / np.linalg.norm(e - (e @ axis) * axis)
    along = x @ axis - 0.5 * ((x @ axis).max() + (x @ axis).min())
    reach = np.abs(along).max()
    flat = reach <= EXTENT_RTOL * np.ptp(interface.points, axis=0).max()
    across = x @ e, x @ np.cross(axis, e)
    theta = np.arctan2(across[1], across[0])
    theta[np.hypot(*across) < ON_AXIS * np.ptp(interface.points, axis=0).max()] = np.nan
    return theta, along * 0.0 if flat else along / reach


def _principal_axis(interface: Interface, x: Array) -> Array:
    """(3,) direction of the area of nodes at x (k, 3) from the centroid that stands out."""
    moments, axes = np.linalg.eigh((interface.surface_mass @ x).T @ x)
    gaps = np.diff(moments)
    if gaps.max() < 1e-3 * moments[-1]:
        text = f"interface {interface.name!r} has no axis: it is spread alike in all directions"
        raise InterfaceError(f"{text}; use `Polynomial` on it.")
    return axes[:, 2] if gaps[1] > gaps[0] else axes[:, 0]


def _centroid(interface: Interface) -> Array:
    weight = np.asarray(interface.surface_mass.sum(axis=1)).ravel()
    return weight @ interface.points / weight.sum()


def _local(interface: Interface) -> Array:
    """(k, 3) nodes from the centroid of the area, each coordinate scaled to [-1, 1].

    The axes are those of the geometry: principal ones of a disc or a square hang on round-off, and
    two bodies that meet on one surface would choose different functions.
    """
    x = interface.points - _centroid(interface)
    reach = np.abs(x).max(axis=0)
    thin = reach <= EXTENT_RTOL * reach.max()
    return np.where(thin, 0.0, x / np.where(thin, 1.0, reach))


def _refuse_many(n: int, interface: Interface, asked: str) -> None:
    """More functions than nodes are dropped in the end, but all are evaluated before."""
    if n * interface.nodes.size > MOST_VALUES:
        text = f"{asked} on interface {interface.name!r} mean {n:.3g} functions for its nodes"
        raise ConfigError(f"{text}; orders above ten add nothing to most surfaces.")
