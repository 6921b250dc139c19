"""Pieces of a solid, cut along faces of its cells, as the solid again."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.sparse import csr_matrix, identity
from scipy.spatial import cKDTree

from rom.body.nonlinear.full import TurningSection
from rom.body.nonlinear.ranges import Load
from rom.eigen.verbs import Matrix, dofs_of, mean_motion
from rom.errors import ModelError
from rom.model import Array, FEModel, Index, Interface

MEETING_RTOL = 1e-6  # of the size of a section: how far nodes that meet may lie apart


@dataclass(frozen=True)
class GluedSolid:
    """The whole solid at finite strain."""

    models: Mapping[str, FEModel]  # the pieces
    dofs: dict[str, Index]  # {piece: (n_k,) numbers of its dofs in the whole}
    n: int  # number of dofs of the whole

    @classmethod
    def of(
        cls, models: Mapping[str, FEModel], joints: Mapping[str, tuple[str, str]]
    ) -> "GluedSolid":
        """Pieces glued at the nodes of their joints, which have to meet."""
        hangs = {other: (joint, one) for joint, (one, other) in joints.items()}
        number, n = dict[str, Index](), 0
        for key in [k for k in models if k not in hangs] + [other for _, other in joints.values()]:
            nodes = np.full(len(models[key].points), -1)
            if key in hangs:
                joint, one = hangs[key]
                mine, other = (models[k].interfaces[joint] for k in (key, one))
                nodes[mine.nodes] = number[one][other.nodes[_meeting(mine, other)]]
            new = nodes < 0
            nodes[new] = n + np.arange(np.count_nonzero(new))
            number[key], n = nodes, n + int(np.count_nonzero(new))
        return cls(models, {key: dofs_of(nodes) for key, nodes in number.items()}, 3 * n)

    def force(self, u: Array) -> Array:
        """(n,) forces that hold the solid at a displacement (n,) [N]."""
        return sum(P.T @ solid.force(P @ u) for _, solid, P in self._parts)

    def tangent(self, u: Array) -> csr_matrix:
        """(n, n) derivative of the forces at a displacement (n,) [N/m]."""
        return csr_matrix(sum(P.T @ solid.tangent(P @ u) @ P for _, solid, P in self._parts))

    @cached_property
    def M(self) -> csr_matrix:
        """(n, n) mass [kg]."""
        return csr_matrix(sum(P.T @ _mass(model) @ P for model, _, P in self._parts))

    def motion(self, load: Load) -> Array:
        """(n,) row of the mean motion of an interface on which a unit load works [1, 1/m]."""
        row = np.zeros(self.n)
        for key, model in self.models.items():
            if load.interface in model.interfaces:
                interface = model.interfaces[load.interface]
                row[self.dofs[key][interface.dofs]] = mean_motion(interface)[load.component]
        return row

    def section(self, name: str) -> TurningSection:
        """An interface of one piece, for moments that turn with it."""
        (key,) = (key for key, model in self.models.items() if name in model.interfaces)
        interface = self.models[key].interfaces[name]
        return TurningSection.of(interface, self.dofs[key][interface.dofs])

    @cached_property
    def _parts(self) -> list[tuple[FEModel, Any, csr_matrix]]:
        """Each piece, itself at finite strain, and the (n_k, n) selection of its dofs."""
        one = identity(self.n, format="csr")
        found = ((model, one[self.dofs[key]]) for key, model in self.models.items())
        return [(model, model.stresses.finite_strain(), P) for model, P in found]


def _mass(model: FEModel) -> Matrix:
    return model.operators.gathered(model.operators.M) if model.operators else model.M


def _meeting(one: Interface, other: Interface) -> Index:
    """(k,) number of the node of the other interface at each node of one."""
    distance, at = cKDTree(other.points).query(one.points)
    size = np.ptp(one.points, axis=0).max()
    if one.nodes.size != other.nodes.size or distance.max() > MEETING_RTOL * size:
        raise ModelError(
            f"{one.nodes.size} and {other.nodes.size} nodes of two pieces do not meet at "
            f"{one.name!r}: they lie up to {distance.max():.3g} m apart.",
            hint="Cut one mesh (rom.fe.pieces): of pieces with meshes of their own the whole is "
            "not known.",
        )
    return np.asarray(at)
