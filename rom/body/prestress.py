"""Geometric stiffness of a meshed body from the stress of its unit loads.

Every load is balanced by the inertia of the free body (inertia relief), so that no support carries
a part of it, and its stress comes from the full finite element equations: the tension of a
spinning bar is exact even when no mode kept stretches it. The inertia of its shapes is balanced for
itself. Acceleration and angular acceleration of a free body need no stress; they act through the
forces at its interfaces.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from rom.body.records import Marker
from rom.body.recovery import CENTRIFUGAL_LOADS, centrifugal, with_elements
from rom.body.stiffening import elastic_loads, interface_loads
from rom.eigen.attachments import Carried, carried_displacements
from rom.eigen.connection import Connection
from rom.eigen.verbs import (
    Operators,
    dofs_of,
    given_rigid_motions,
    mean_motion,
    own_points,
    owned,
    pins,
    rigid_motions,
)
from rom.model import Array, FEModel, Index, Interface, refuse_springs

Felt = Callable[[Array], Array]  # at points (p, 3), (3 p, k)
MAX_PAIRS = 3  # of interfaces: each costs the assembly of a matrix


@dataclass(frozen=True)
class UnitLoads:
    """Centrifugal force and interface loads of a model, and the stress they leave in it."""

    model: FEModel  # with finite elements
    mesh: Operators  # operators of the mesh alone, nodal dofs
    whole: Operators  # the same with attachments
    connection: Connection  # the model in interface coordinates

    def __post_init__(self) -> None:
        with_elements(self.model, "geometric stiffness", ", or reduce with stiffening=False")

    def geometric_stiffness(self, E: Array, markers: dict[str, Marker]) -> dict[str, Array]:
        """{load: (r, r)} of the shapes E (n_local, r) in their mean-axis frame."""
        refuse_springs(self.model, "stiffening knows elements alone; reduce with stiffening=False")
        carried = [carried_displacements(a, self.model) for a in self.model.attachments]
        of_interfaces = (load for m in markers for load in interface_loads(m))
        names = [*CENTRIFUGAL_LOADS, *of_interfaces, *elastic_loads(E.shape[1])]
        balanced, wrenches = self._balanced(carried, tuple(markers))
        wrenches = np.hstack([wrenches, np.zeros_like(E)])
        forces = self.mesh.apply_M(np.hstack([balanced(self._points), -E]))
        felt = [
            np.hstack([balanced(c.points), -c.N @ self.mesh.rows(E, c.interface.dofs)])
            for c in carried
        ]
        F = forces + wrenches + self._carried_load(carried, felt, len(names))
        ops = self.connection.ops  # the free body answers balanced loads, up to rigid motion
        U = ops.expand(ops.hold(self._six_dofs())(ops.restrict(F)))
        K = self.model.stresses.geometric_stiffness(U, E)
        K += self._surfaces(U, forces, E, markers, carried)
        for c, accelerations in zip(carried, felt, strict=True):
            arms = c.points - c.interface.origin
            f = c.masses[:, None] * accelerations.reshape(len(arms), -1)
            moment = np.einsum("pal,pb->lab", f.reshape(len(arms), 3, -1), arms)
            K -= _turning(moment, self._rotation(c.interface, E))
        return dict(zip(names, 0.5 * (K + K.transpose(0, 2, 1)), strict=True))

    def buckling_loads(
        self, E: Array, omega: Array, markers: dict[str, Marker]
    ) -> list[tuple[str, str, float]]:
        """Pairs of interfaces, and the force [N] that buckles the body between them on hinges."""
        pairs = list(combinations([m for m in markers.values() if m.patch is None], 2))
        lines = [(one, two, two.point - one.point) for one, two in pairs]
        pressed = [
            (one, two, line / np.linalg.norm(line))
            for one, two, line in lines
            if len(pairs) <= MAX_PAIRS and line.any()
        ]
        if not pressed or not omega.size:
            return []
        forces = [(one.translation - two.translation).T @ e for one, two, e in pressed]
        U = E @ (np.array(forces) / omega**2).T
        K = self.model.stresses.geometric_stiffness(U, E)
        K += self._surfaces(U, 0.0, E, markers, [])
        shares = np.linalg.eigvalsh(-K / np.outer(omega, omega))[:, -1]
        named = zip(pressed, shares, strict=True)
        return [(one.name, two.name, float(1 / x)) for (one, two, _), x in named if x > 0.0]

    @property
    def _points(self) -> Array:
        return own_points(self.mesh, self.model.points)

    def _balanced(self, carried: list[Carried], names: Sequence[str]) -> tuple[Felt, Array]:
        """Accelerations of body forces as a function of points, and nodal interface loads."""
        R = rigid_motions(self._points)
        wrenches = np.zeros((self.mesh.n_local, 6 + 6 * len(names)))
        for k, name in enumerate(names, start=1):
            interface = self.model.interfaces[name]
            self._add(wrenches[:, 6 * k : 6 * k + 6], interface, mean_motion(interface).T)

        def unbalanced(points: Array) -> Array:
            fields = centrifugal(points)
            return np.hstack([fields, np.zeros((fields.shape[0], 6 * len(names)))])

        load = self.mesh.apply_M(unbalanced(self._points)) + wrenches
        felt = [unbalanced(c.points) for c in carried]
        load += self._carried_load(carried, felt, load.shape[1])
        rigid = np.linalg.solve(self.whole.gram(R, self.whole.apply_M(R)), self.mesh.gram(R, load))
        return lambda points: unbalanced(points) - rigid_motions(points) @ rigid, wrenches

    def _carried_load(self, carried: list[Carried], felt: list[Array], n: int) -> Array:
        """(n_local, n) forces of what is carried under the accelerations that its points feel."""
        load = np.zeros((self.mesh.n_local, n))
        for c, accelerations in zip(carried, felt, strict=True):
            f = np.repeat(c.masses, 3)[:, None] * accelerations
            self._add(load, c.interface, c.N.T @ f)
        return load

    def _add(self, out: Array, interface: Interface, rows: Array) -> None:
        """Add rows of the dofs of an interface to those this process has."""
        mine = owned(self.mesh, interface.dofs)
        out[interface.dofs[mine] - self.mesh.first] += rows[mine]

    def _six_dofs(self) -> Index:
        """Six dofs that stop every rigid motion and, as loads are balanced, carry nothing."""
        ops, candidates, x = self.connection.ops, self.connection.boundary, self.model.points
        if candidates.size == 0:
            candidates = dofs_of(np.unique(np.r_[x.argmin(axis=0), x.argmax(axis=0)]))
        return np.sort(candidates[pins(ops.rows(given_rigid_motions(ops), candidates))])

    def _surfaces(
        self,
        U: Array,
        forces: Array | float,
        E: Array,
        markers: dict[str, Marker],
        carried: list[Carried],
    ) -> Array:
        """What the forces on interfaces add when their surfaces turn as a whole.

        Points go on circles, by theta x (theta x r) / 2, which no linear map u = T a contains.
        """
        tractions, total = self.mesh.apply_K(U) - forces, np.zeros((U.shape[1], *2 * E.shape[1:]))
        for name in dict.fromkeys([*markers, *(c.interface.name for c in carried)]):
            interface = self.model.interfaces[name]
            p = self.mesh.rows(tractions, interface.dofs).reshape(-1, 3, U.shape[1])
            moment = np.einsum("nal,nb->lab", p, interface.points - interface.origin)
            total += _turning(moment, self._rotation(interface, E))
        return total

    def _rotation(self, interface: Interface, E: Array) -> Array:
        if interface.nodes.size == 1:  # what it carries has no arm
            return np.zeros((3, E.shape[1]))
        return mean_motion(interface)[3:] @ self.mesh.rows(E, interface.dofs)


def _turning(moment: Array, theta: Array) -> Array:
    """(l, r, r) sum of f . theta_k x (theta_l x arm), from the sums of f arm^T (l, 3, 3)."""
    along = np.einsum("ak,lab,bm->lkm", theta, moment, theta, optimize=True)
    square = np.einsum("laa,km->lkm", moment, theta.T @ theta)
    return 0.5 * (along + along.transpose(0, 2, 1)) - square
