"""Interfaces as coordinates: which few numbers stand for the many dofs of a surface.

Each kind is a sparse map u = T a that is applied to K and M once. Everything after it (reduction,
modes, certificate) sees an ordinary model whose interface coordinates are dofs of their own.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import qr
from scipy.sparse import coo_matrix, csr_matrix

from rom.eigen import Operators, mean_motion, rigid_motions
from rom.errors import ConfigError, InterfaceError, ResourceError
from rom.model import Array, FEModel, Index, Interface

KINDS = ("full", "rbe2", "rbe3")
RBE3_DOFS = 6000  # an averaging interface couples all its dofs: 6000 of them fill 0.3 GB


@dataclass(frozen=True, slots=True)
class Connection:
    """A model written in interface coordinates.

    Attributes:
        ops: operators in the coordinates a of u = T a; ``ops.expand`` leads back.
        boundary: (n_b,) dof numbers in a of all interface coordinates, interface by interface.
        parts: {interface: positions in ``boundary``}.
        labels: (n_b,) what each coordinate is, e.g. "pin_a rbe2 uz".
        kinds: {interface: kind}.
    """

    ops: Operators
    boundary: Index
    parts: dict[str, Index]
    labels: tuple[str, ...]
    kinds: dict[str, str]

    def held(self, names: tuple[str, ...]) -> Index:
        """Dof numbers that are zero when these interfaces are held."""
        known = [self.parts[name] for name in names]
        return self.boundary[np.concatenate(known)] if known else np.zeros(0, dtype=np.int64)


@dataclass(frozen=True, slots=True)
class _Piece:
    """One interface: dofs that leave, and how they follow from masters and dofs that stay."""

    removed: Index  # (d,) dofs replaced
    by_masters: Array  # (d, m)
    kept: Index  # (s,) dofs that stay and take part
    by_kept: Array  # (d, s)
    rigid: Array  # (m, 6) rigid motions of the masters


def connect(ops: Operators, model: FEModel, interfaces: dict[str, Any]) -> Connection:
    """Write a model in the coordinates of its interfaces.

    Args:
        ops: operators of the model in nodal dofs.
        model: supplies the interfaces.
        interfaces: {name: kind}; "full" keeps every dof, "rbe2" makes the surface rigid (six
            coordinates), "rbe3" adds six coordinates that follow the area-weighted mean motion of
            the surface and leave it deformable.

    Raises:
        InterfaceError: if a name is unknown, or two interfaces share nodes.
        ConfigError: if a kind is unknown.
        ResourceError: if an averaging interface has too many dofs.
    """
    chosen = [(find(model, name), _kind(name, kind)) for name, kind in interfaces.items()]
    _refuse_shared_nodes([interface for interface, _ in chosen])
    pieces = [_piece(interface, kind) for interface, kind in chosen]
    if not any(piece.removed.size for piece in pieces):
        boundary = [interface.dofs for interface, _ in chosen]
        return _connection(ops, chosen, boundary)
    return _connection(_transform(ops, pieces), chosen, _numbers(ops.n, chosen, pieces))


def find(model: FEModel, name: str) -> Interface:
    """The interface of that name.

    Raises:
        InterfaceError: listing the names that exist.
    """
    if name not in model.interfaces:
        raise InterfaceError(
            f"there is no interface {name!r}; the model has {sorted(model.interfaces)}.",
            hint="Interfaces are the named physical surfaces of the geometry.",
        )
    return model.interfaces[name]


def _kind(name: str, kind: Any) -> str:
    if kind not in KINDS:
        raise ConfigError(f"interface {name!r} has the kind {kind!r}; known kinds: {list(KINDS)}.")
    return kind


def _refuse_shared_nodes(interfaces: list[Interface]) -> None:
    for i, one in enumerate(interfaces):
        for other in interfaces[:i]:
            shared = np.intersect1d(one.nodes, other.nodes).size
            if shared:
                raise InterfaceError(
                    f"interfaces {other.name!r} and {one.name!r} share {shared} nodes; "
                    "two rigid or averaged surfaces cannot both rule one node.",
                    hint="Leave a gap between the surfaces, or make them one physical surface.",
                )


def _piece(interface: Interface, kind: str) -> _Piece:
    none = np.zeros(0, dtype=np.int64)
    if kind == "full":
        return _Piece(none, np.zeros((0, 0)), none, np.zeros((0, 0)), np.zeros((0, 6)))
    rigid = rigid_motions(interface.origin[None])
    rigid = np.vstack([rigid, np.hstack([np.zeros((3, 3)), np.eye(3)])])
    if kind == "rbe2":
        R = rigid_motions(interface.points - interface.origin)
        return _Piece(interface.dofs, R, none, np.zeros((R.shape[0], 0)), rigid)
    return _averaged(interface, rigid)


def _averaged(interface: Interface, rigid: Array) -> _Piece:
    """Six well-chosen dofs of the surface follow from the mean motion and the other dofs.

    C_d u_d + C_r u_r = c gives u_d = C_d^-1 c - C_d^-1 C_r u_r; pivoted QR chooses d so that C_d
    is well conditioned.
    """
    if interface.dofs.size > RBE3_DOFS:
        raise ResourceError(
            f"interface {interface.name!r} has {interface.dofs.size} dofs; averaging couples all "
            f"of them, which is refused above {RBE3_DOFS}.",
            hint='Use "rbe2", or a coarser mesh on this surface.',
        )
    C = mean_motion(interface)
    size = np.ptp(interface.points, axis=0).max()
    _, _, pivots = qr(
        C * np.r_[np.ones(3), np.full(3, size)][:, None], mode="economic", pivoting=True
    )
    d, r = np.sort(pivots[:6]), np.sort(pivots[6:])
    inverse = np.linalg.inv(C[:, d])
    return _Piece(interface.dofs[d], inverse, interface.dofs[r], -inverse @ C[:, r], rigid)


def _transform(ops: Operators, pieces: list[_Piece]) -> Operators:
    """Kept dofs keep their order and their rank; masters come last, on the last rank."""
    removed = np.sort(np.concatenate([piece.removed for piece in pieces]))
    mine = np.arange(ops.first, ops.first + ops.n_local)
    stays = ~np.isin(mine, removed)
    n_masters = sum(piece.rigid.shape[0] for piece in pieces)
    n_kept = ops.n - removed.size
    rows, columns, values = [np.flatnonzero(stays)], [_renumber(mine[stays], removed)], []
    values.append(np.ones(rows[0].size))
    first_master = n_kept
    for piece in pieces:
        here = (piece.removed >= ops.first) & (piece.removed < ops.first + ops.n_local)
        row = piece.removed[here] - ops.first
        masters = first_master + np.arange(piece.rigid.shape[0])
        for block, column in (
            (piece.by_masters, masters),
            (piece.by_kept, _renumber(piece.kept, removed)),
        ):
            rows.append(np.repeat(row, column.size))
            columns.append(np.tile(column, row.size))
            values.append(block[here].ravel())
        first_master += piece.rigid.shape[0]
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    T = csr_matrix(coo_matrix(entries, shape=(ops.n_local, n_kept + n_masters)))
    T.eliminate_zeros()
    rigid = np.vstack([piece.rigid for piece in pieces]) if ops.last else np.zeros((0, 6))
    return ops.transform(T, np.vstack([ops.rigid[stays], rigid]))


def _renumber(dofs: Index, removed: Index) -> Index:
    return dofs - np.searchsorted(removed, dofs)


def _numbers(n: int, chosen: list, pieces: list[_Piece]) -> list[Index]:
    """Numbers of the interface coordinates after the removed dofs are gone."""
    removed = np.sort(np.concatenate([piece.removed for piece in pieces]))
    numbers, first_master = [], n - removed.size
    for interface, kind in chosen:
        if kind == "full":
            numbers.append(_renumber(interface.dofs, removed))
        else:
            numbers.append(first_master + np.arange(6))
            first_master += 6
    return numbers


def _connection(ops: Operators, chosen: list, numbers: list[Index]) -> Connection:
    parts, labels, first = {}, [], 0
    for (interface, kind), dofs in zip(chosen, numbers, strict=True):
        parts[interface.name] = first + np.arange(dofs.size)
        labels += [f"{interface.name} {kind} {what}" for what in _names(kind, dofs.size)]
        first += dofs.size
    boundary = np.concatenate(numbers) if numbers else np.zeros(0, dtype=np.int64)
    kinds = {interface.name: kind for interface, kind in chosen}
    return Connection(ops, boundary, parts, tuple(labels), kinds)


def _names(kind: str, n: int) -> list[str]:
    if kind == "full":
        return [f"node {k // 3} u{'xyz'[k % 3]}" for k in range(n)]
    return ["ux", "uy", "uz", "rx", "ry", "rz"]
