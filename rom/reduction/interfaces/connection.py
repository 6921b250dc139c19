"""Interfaces as coordinates: which few numbers stand for the many dofs of a surface.

Each kind is a sparse map u = T a that is applied to K and M once. Everything after it (reduction,
modes, certificate) sees an ordinary model whose interface coordinates are dofs of their own.
"""

from collections.abc import Iterable
from itertools import combinations
from typing import Any

import numpy as np
from scipy.sparse import coo_matrix, csr_matrix

from rom.eigen.connection import Connection, Tie
from rom.eigen.verbs import Operators, given_rigid_motions, held_rows, owned
from rom.errors import InterfaceError
from rom.model import FEModel, Index, Interface
from rom.names import check_all_known, named
from rom.reduction.interfaces.kinds import tie


def connect(ops: Operators, model: FEModel, interfaces: dict[str, Any]) -> Connection:
    """Write a model in the coordinates of its interfaces, {name: kind}.

    "full" keeps every dof, "rbe2" makes the surface rigid (six coordinates), "rbe3" adds six
    coordinates that follow the area-weighted mean motion of the surface and leave it deformable;
    `Polynomial`, `FourierLegendre` and `Snapshots` let the surface follow orthogonal functions.
    Those that the model ties by itself are tied, named or not.
    """
    interfaces = interfaces | {k: v for k, v in model.kinds.items() if k not in interfaces}
    chosen = found(model, interfaces)
    for other, one in combinations(chosen, 2):
        if shared := np.intersect1d(one.nodes, other.nodes).size:
            text = f"interfaces {other.name!r} and {one.name!r} share {shared} nodes; leave a gap"
            hint = "between the surfaces, or make them one physical surface"
            if own := sorted({one.name, other.name} & model.kinds.keys()):
                text, hint = text.partition(";")[0], f"; the model ties {own[0]!r}: use that one"
            raise InterfaceError(f"{text}{hint}." if own else f"{text} {hint}.")
    ties = {i.name: tie(i, interfaces[i.name]) for i in chosen}
    if not any(t.removed.size for t in ties.values()):
        return _connection(ops, ties, [interface.dofs for interface in chosen])
    transformed, numbers = _transform(ops, chosen, ties)
    return _connection(transformed, ties, numbers)


def found(model: FEModel, names: Iterable[str]) -> list[Interface]:
    """The interfaces of these names."""
    names = list(names)
    check_all_known(names, model.interfaces, "the model has no interface", InterfaceError)
    if wrong := [name for name in names if model.interfaces[name].name != name]:
        other = named(model.interfaces[name].name for name in wrong)
        text = f"interface {named(wrong)} of the model calls itself {other}"
        raise InterfaceError(f"{text}; rename it as well: dataclasses.replace(it, name=...).")
    return [model.interfaces[name] for name in names]


def _transform(
    ops: Operators, chosen: list[Interface], ties: dict[str, Tie]
) -> tuple[Operators, list[Index]]:
    """The model in new coordinates, and the numbers that those of each interface have there.

    Kept dofs keep their order and their rank; masters come last, on the last rank.
    """
    removed = np.sort(np.concatenate([t.removed for t in ties.values()]))
    stays, first_master = ~held_rows(ops, removed), ops.n - removed.size
    n_columns = first_master + sum(t.n_masters for t in ties.values())
    kept = np.flatnonzero(stays)
    rows, columns, values = [kept], [_renumber(ops.first + kept, removed)], [np.ones(kept.size)]
    numbers = []
    for interface in chosen:
        t = ties[interface.name]
        here = owned(ops, t.removed)
        row = t.removed[here] - ops.first
        masters = first_master + np.arange(t.n_masters)
        numbers.append(masters if masters.size else _renumber(interface.dofs, removed))
        for block, column in ((t.by_masters, masters), (t.by_kept, _renumber(t.kept, removed))):
            part = coo_matrix(block[here])
            rows.append(row[part.row])
            columns.append(column[part.col])
            values.append(part.data)
        first_master += t.n_masters
    entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
    T = csr_matrix(coo_matrix(entries, shape=(ops.n_local, n_columns)))
    T.eliminate_zeros()
    rigid = [given_rigid_motions(ops)[stays]]
    if ops.last:
        moved = [i for i in chosen if ties[i.name].n_masters]
        rigid += [ties[i.name].coordinates @ i.rigid_motions() for i in moved]
    return ops.transform(T, np.vstack(rigid)), numbers


def _renumber(dofs: Index, removed: Index) -> Index:
    return dofs - np.searchsorted(removed, dofs)


def _connection(ops: Operators, ties: dict[str, Tie], numbers: list[Index]) -> Connection:
    parts, labels, first = {}, [], 0
    for (name, t), dofs in zip(ties.items(), numbers, strict=True):
        parts[name] = first + np.arange(dofs.size)
        labels += [f"{name} {t.label} {what}" for what in t.names]
        first += dofs.size
    boundary = np.concatenate(numbers) if numbers else np.zeros(0, dtype=np.int64)
    return Connection(ops, boundary, parts, tuple(labels), ties)
