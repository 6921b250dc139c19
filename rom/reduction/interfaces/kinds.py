"""Kinds of interfaces: how a few coordinates c = L u govern the dofs u of a surface."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.linalg import qr
from scipy.sparse import identity, kron

from rom.eigen.connection import Tie
from rom.eigen.supports import full_kind
from rom.eigen.verbs import mean_motion
from rom.errors import ConfigError, InterfaceError, ResourceError
from rom.model import Array, Interface
from rom.names import is_whole
from rom.reduction.interfaces.characteristic import CharacteristicFunctions
from rom.reduction.interfaces.polynomial import FourierLegendre, Polynomial, interface_functions
from rom.reduction.interfaces.snapshots import Snapshots, snapshot_functions

RBE3_DOFS = 6000  # an averaging interface couples all its dofs: 6000 of them fill 0.3 GB
RECORDS = (Polynomial, FourierLegendre, Snapshots, CharacteristicFunctions)
KNOWN_KINDS = (
    '"full", "rbe2", "rbe3", rom.Polynomial(order) or "polynomial:3", '
    'rom.FourierLegendre(harmonics, order) or "fourier:3,2", rom.Snapshots(values, n=…)'
)
SIX_LABELS = ("ux", "uy", "uz", "rx", "ry", "rz")
NO_DOFS = np.zeros(0, dtype=np.int64)


def tie(interface: Interface, kind: Any) -> Tie:
    """The tie of an interface of that kind."""
    kind = parsed(interface.name, kind)
    if kind == "full":
        names = _full_names(interface)
        itself, nothing = identity(interface.dofs.size, format="csr"), np.zeros((0, 0))
        return Tie(full_kind(interface), names, itself, NO_DOFS, nothing, NO_DOFS, nothing)
    if kind == "rbe2":
        R = interface.rigid_motions(interface.origin)
        return _stiff(interface, "rbe2", SIX_LABELS, mean_motion(interface), R)
    if kind == "rbe3":
        return _averaged(interface)
    if interface.rotations is not None:
        text = f"interface {interface.name!r} has nodes that turn, and functions only displace"
        raise InterfaceError(f'{text}; give it "rbe2", "rbe3" or "full".')
    if isinstance(kind, Snapshots):
        return _found(interface, "snapshots", snapshot_functions(kind, interface))
    if isinstance(kind, CharacteristicFunctions):
        return _found(interface, "characteristic", kind.functions(interface))
    Q = interface_functions(kind, interface)
    names = tuple(f"{axis}{j + 1}" for j in range(Q.shape[1]) for axis in "xyz")
    L = kron((interface.surface_mass @ Q).T, identity(3), format="csr")
    label = f"polynomial:{kind.order}"
    if isinstance(kind, FourierLegendre):
        label = f"fourier:{kind.harmonics},{kind.order}"
    return _stiff(interface, label, names, L, kron(Q, identity(3), format="csr"))


def _full_names(interface: Interface) -> tuple[str, ...]:
    names = [f"node {k // 3} u{'xyz'[k % 3]}" for k in range(interface.points.size)]
    if (turning := interface.rotations) is not None:
        of_node = np.arange(turning.nodes.size) - np.searchsorted(turning.nodes, turning.nodes)
        names += [f"node {k} r{j + 1}" for k, j in zip(turning.nodes, of_node, strict=True)]
    return tuple(names)


def _stiff(
    interface: Interface, label: str, names: tuple[str, ...], coordinates: Any, shapes: Any
) -> Tie:
    """All dofs of the surface follow from its coordinates."""
    none = np.zeros((shapes.shape[0], 0))
    return Tie(label, names, coordinates, interface.dofs, shapes, NO_DOFS, none)


def _found(interface: Interface, word: str, Q: Array) -> Tie:
    """Computed functions with all three directions, the six rigid motions first."""
    mean_motion(interface)  # refuses surfaces whose rotation is undetermined
    names = tuple(f"{'rigid' if j < 7 else word} {j}" for j in range(1, Q.shape[1] + 1))
    L = (kron(interface.surface_mass, identity(3), format="csr") @ Q).T
    return _stiff(interface, f"{word}:{Q.shape[1]}", names, L, Q)


def _averaged(interface: Interface) -> Tie:
    """Six well-chosen dofs of the surface follow from the mean motion and the other dofs.

    C_d u_d + C_r u_r = c gives u_d = C_d^-1 c - C_d^-1 C_r u_r; pivoted QR chooses d so that C_d
    is well conditioned.
    """
    if interface.dofs.size > RBE3_DOFS:
        text = f"averaging couples all {interface.dofs.size} dofs of interface {interface.name!r}"
        hint = 'Use "rbe2", or a coarser mesh on this surface.'
        raise ResourceError(f"{text}, which is refused above {RBE3_DOFS}.", hint=hint)
    C = mean_motion(interface)
    size = np.ptp(interface.points, axis=0).max()
    scaled = C * np.r_[np.ones(3), np.full(3, size)][:, None]
    _, _, pivots = qr(scaled, mode="economic", pivoting=True)
    d, r = np.sort(pivots[:6]), np.sort(pivots[6:])
    inverse = np.linalg.inv(C[:, d])
    dofs = interface.dofs
    return Tie("rbe3", SIX_LABELS, C, dofs[d], inverse, dofs[r], -inverse @ C[:, r])


def by_name(interfaces: Any) -> dict[str, Any]:
    """The kinds of interfaces as a dictionary."""
    if not isinstance(interfaces, Mapping):
        hint = 'Give a dictionary, for example {"bore": "rbe2"}.'
        raise ConfigError(f"interfaces = {interfaces!r} tells no interface its kind.", hint=hint)
    return dict(interfaces)


def parsed(name: str, kind: Any) -> Any:
    """The kind of an interface as a record, or one of the words "full", "rbe2", "rbe3"."""
    if isinstance(kind, RECORDS) or kind in ("full", "rbe2", "rbe3"):
        return kind
    if kind == "polynomial":
        return Polynomial()
    if isinstance(kind, str):
        word, _, numbers = kind.partition(":")
        family = {"polynomial": (Polynomial, 1), "fourier": (FourierLegendre, 2)}.get(word)
        values = numbers.split(",")
        if family and len(values) == family[1] and all(is_whole(v.strip()) for v in values):
            return family[0](*map(int, values))
    raise ConfigError(f"interface {name!r} has the kind {kind!r}; known kinds: {KNOWN_KINDS}.")
