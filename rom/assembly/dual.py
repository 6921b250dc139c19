"""Substructures coupled by interface forces: MacNeal, Rubin and dual Craig-Bampton.

A free body follows u = R alpha + Phi eta + G g: rigid motions, some elastic free-free modes, and
what these leave of its static answer to forces g on its interfaces. Coupled interfaces feel equal
and opposite forces lambda; with B for their differences::

    Gamma = sum B G B^T,  Psi = B [R, Phi],  H = sum B G^T M G B^T

    macneal  K = diag(0, Lambda) + Psi^T Gamma^-1 Psi,  M = 1
    rubin    the same K,  M = 1 + Psi^T Gamma^-1 H Gamma^-1 Psi
    dual     [ diag(0, Lambda)  Psi^T  ]       [ 1     ]
             [ Psi              -Gamma ],  M = [    H  ]

The first two meet exactly; Rubin's is a Ritz method, never below the exact frequencies. Dual
Craig-Bampton keeps the forces as unknowns, so that substructures can be exchanged one by one; its
interfaces meet weakly, and it has a negative eigenvalue per force, which belongs to no motion.

Source:
    MacNeal, Comput. Struct. 1 (1971) 581; Rubin, AIAA J. 13 (1975) 995; Rixen, A dual
    Craig-Bampton method for dynamic substructuring, J. Comput. Appl. Math. 168 (2004) 383.
"""

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import block_diag, eigh, null_space

from rom.arguments import one_of, typed
from rom.assembly.coupling import SAME_PLACE, Place, refuse_gap, rows_of_parts, unlike
from rom.checks.draft import COMPARISON_STAGE, Draft, run, wanted
from rom.eigen.connection import Connection
from rom.errors import InterfaceError
from rom.model import Array, FEModel, Index, Report, Row
from rom.names import check_known
from rom.reduction.bases.free_interface import Rubin, free_modes, residual_flexibility
from rom.rows import FREQUENCY_RTOL, N_COMPARED, frequency_rows, row
from rom.stages.bodies import connect

KINDS = ("macneal", "rubin", "dual")
# of the whole one: residual flexibility below is none, the modes describe all
FLEXIBILITY_RTOL = 1e-11


@typed
@dataclass(frozen=True, slots=True)
class FreeSubstructure:
    """A free body as its interfaces see it.

    Attributes:
        parts: {interface: (k,) rows in the arrays below}.
        origins: {interface: (3,) where it is [m]}.
        rigid: (n_b, 6) interface coordinates of M-orthonormal rigid motions [kg^-1/2].
        omega: (m,) elastic free-free frequencies [rad/s].
        shapes: (n_b, m) interface coordinates of the mass-normalised modes [kg^-1/2].
        flexibility: (n_b, n_b) residual flexibility G [m/N].
        mass: (n_b, n_b) kinetic energy of the residual shapes, G^T M G [kg m^2/N^2].
        certificate: frequencies with one interface held against the full model, or None.
    """

    parts: dict[str, Index]
    origins: dict[str, Array]
    rigid: Array
    omega: Array
    shapes: Array
    flexibility: Array
    mass: Array
    certificate: Report | None = None


def free_substructure(
    connection: Connection, origins: dict[str, Array], n_modes: int
) -> FreeSubstructure:
    """What a coupling by forces needs of a body in interface coordinates; see the class.

    Args:
        connection: the body in the coordinates of its interfaces.
        origins: {interface: (3,) where it is [m]}.
        n_modes: number of elastic free-free modes.

    Raises:
        ConfigError: for more modes than there are dofs.
        InterfaceError: if the interfaces leave a rigid motion free.

    Source:
        Rixen, A dual Craig-Bampton method for dynamic substructuring, J. Comput. Appl. Math. 168
        (2004) 383; see docs/theory/other_bases.md.
    """
    ops, b = connection.ops, connection.boundary
    R, omega, Phi = free_modes(ops, n_modes)
    G = residual_flexibility(ops, b, R, omega, Phi)
    F, H = ops.rows(G, b), ops.gram(G, ops.apply_M(G))
    return FreeSubstructure(
        parts=connection.parts,
        origins=origins,
        rigid=ops.rows(R, b),
        omega=omega,
        shapes=ops.rows(Phi, b),
        flexibility=0.5 * (F + F.T),
        mass=0.5 * (H + H.T),
    )


@typed
@dataclass(frozen=True)
class DualAssembly:
    """Free substructures whose interfaces are held together by forces.

    Attributes:
        bodies: {name: substructure}, all in one system of coordinates.
        couplings: ((body, interface), (body, interface)) pairs that move together; coordinates of
            conforming "full" interfaces are paired in their order.

    Raises:
        ConfigError: if a body, or in the methods the kind, is unknown.
        InterfaceError: if an interface is unknown, or two differ in size or lie apart; of the
            methods, if forces on interfaces are redundant.
    """

    bodies: dict[str, FreeSubstructure]
    couplings: tuple[tuple[Place, Place], ...]

    def __post_init__(self) -> None:
        for one, other in self.couplings:
            sizes = [self._rows(place).size for place in (one, other)]
            if sizes[0] != sizes[1]:
                raise unlike(f"{one} has {sizes[0]} coordinates and {other} has {sizes[1]}")
            x, y = (self.bodies[body].origins[name] for body, name in (one, other))
            size = max(np.linalg.norm(x), np.linalg.norm(y))
            refuse_gap((one, other), x - y, SAME_PLACE * float(size))

    @cached_property
    def certificate(self) -> Report:
        """The certificates of the bodies, and what it changes that the forces are unknowns."""
        rows, n_rigid = rows_of_parts(self.bodies), self._n_rigid(())
        n = n_rigid + N_COMPARED
        with suppress(InterfaceError):  # modes that leave forces no flexibility: the kinds are one
            weak, exact = (self.frequencies(n, kind=kind)[n_rigid:] for kind in ("dual", "rubin"))
            n = min(weak.size, exact.size)
            worst = np.abs(weak[:n] / exact[:n] - 1).max(initial=0.0)
            what = f"dual: largest change of {n} frequencies by interfaces that meet weakly"
            rows.append(row(what, worst, FREQUENCY_RTOL))
        return Report("certificate of the dual assembly", tuple(rows))

    def frequencies(
        self, n: int | None = None, *, kind: str = "dual", fixed: tuple[Place, ...] = ()
    ) -> Array:
        """(k,) natural frequencies of the whole [Hz], lowest first.

        Args:
            n: how many; None for all.
            kind: "macneal", "rubin" or "dual".
            fixed: (body, interface) pairs that are held.
        """
        lam = self.eigenvalues(kind=kind, fixed=fixed)
        lam = lam[lam > -1e-9 * np.abs(lam).max()] if kind == "dual" else lam
        omega = np.sqrt(np.maximum(lam, 0.0))
        omega[: self._n_rigid(fixed)] = 0.0
        return omega[:n] / (2 * np.pi)

    def eigenvalues(self, *, kind: str = "dual", fixed: tuple[Place, ...] = ()) -> Array:
        """(k,) all eigenvalues [rad^2/s^2], ascending, with those below zero of a dual assembly.

        Args:
            kind: "macneal", "rubin" or "dual".
            fixed: (body, interface) pairs that are held.
        """
        K, M = self.matrices(kind=kind, fixed=fixed)
        scale = 1 / np.sqrt(np.diag(M))
        return eigh(*(scale[:, None] * A * scale for A in (K, M)), eigvals_only=True)

    def matrices(self, *, kind: str = "dual", fixed: tuple[Place, ...] = ()) -> tuple[Array, Array]:
        """Stiffness and mass of the whole in modal coordinates, and forces for "dual".

        Args:
            kind: "macneal", "rubin" or "dual".
            fixed: (body, interface) pairs that are held.

        Returns:
            (k, k) stiffness [rad^2/s^2] and (k, k) mass [1], for coordinates whose modes have mass
            one; of "dual" those that belong to forces are in flexibility [m/N] and its mass.

        Raises:
            InterfaceError: see the class.
        """
        one_of("kind", kind, KINDS)
        Lam, Psi, Gamma, H = self._coupled(fixed)
        elastic = np.diag(Lam) > 0
        by_modes = Psi[:, elastic] / np.sqrt(np.diag(Lam)[elastic])
        whole = np.linalg.norm(by_modes @ by_modes.T + Gamma, 2) if Gamma.size else 0.0
        hard = np.linalg.eigvalsh(Gamma) < FLEXIBILITY_RTOL * whole  # no flexibility beside modes
        if kind == "dual":
            if hard.any():
                text = f"{np.count_nonzero(hard)} interface forces find no residual flexibility"
                raise InterfaceError(f"{text}; ask for fewer modes, and couple no place twice.")
            K = np.block([[Lam, Psi.T], [Psi, -Gamma]])
            return K, block_diag(np.eye(len(Lam)), H)
        gamma, Q = np.linalg.eigh(Gamma)
        soft = Q[:, ~hard] / gamma[~hard]
        closing_forces = soft @ (Q[:, ~hard].T @ Psi)  # forces that close the gaps
        K, M = Lam + Psi.T @ closing_forces, np.eye(len(Lam))
        if kind == "rubin":
            M = M + closing_forces.T @ H @ closing_forces
        N = null_space(Q[:, hard].T @ Psi) if hard.any() else np.eye(len(Lam))
        return N.T @ K @ N, N.T @ M @ N

    def _coupled(self, fixed: tuple[Place, ...]) -> tuple[Array, Array, Array, Array]:
        """Modal stiffness, gaps of the modes, flexibility and residual mass of the forces."""
        bodies = list(self.bodies.values())
        n_rigid = [b.rigid.shape[1] for b in bodies]
        diagonal = [np.r_[np.zeros(k), b.omega**2] for k, b in zip(n_rigid, bodies, strict=True)]
        B = self._differences(fixed)
        Psi = B @ block_diag(*(np.hstack([b.rigid, b.shapes]) for b in bodies))
        both = zip(*((b.flexibility, b.mass) for b in bodies), strict=True)
        Gamma, H = (B @ block_diag(*parts) @ B.T for parts in both)
        return np.diag(np.concatenate(diagonal)), Psi, Gamma, H

    def _differences(self, fixed: tuple[Place, ...]) -> Array:
        """(c, n_b of all) signed selection of interface coordinates that must vanish."""
        starts = np.cumsum([0, *(len(b.rigid) for b in self.bodies.values())])
        first = dict(zip(self.bodies, starts, strict=False))
        blocks = [np.zeros((0, starts[-1]))]
        for term in (*self.couplings, *((place,) for place in fixed)):
            blocks.append(np.zeros((self._rows(term[0]).size, starts[-1])))
            for place, sign in zip(term, (1.0, -1.0), strict=False):
                columns = first[place[0]] + self._rows(place)
                blocks[-1][np.arange(columns.size), columns] = sign
        return np.vstack(blocks)

    def _n_rigid(self, fixed: tuple[Place, ...]) -> int:
        """Rigid motions that couplings and supports leave free."""
        R = block_diag(*(b.rigid for b in self.bodies.values()))
        gaps = self._differences(fixed) @ R
        if not gaps.size:
            return R.shape[1]
        return R.shape[1] - int(np.linalg.matrix_rank(gaps, tol=1e-9 * np.linalg.norm(gaps, 2)))

    def _rows(self, place: Place) -> Index:
        body, interface = place
        check_known(body, self.bodies, f"no body {body!r}; the assembly has")
        parts, what = self.bodies[body].parts, f"body {body!r} has no interface {interface!r}"
        check_known(interface, parts, f"{what}; it has", InterfaceError)
        return parts[interface]


@typed
def substructure(
    model: FEModel, *, n_modes: int, interfaces: dict[str, Any], certify: bool = True
) -> FreeSubstructure:
    """A free body for coupling by interface forces: MacNeal, Rubin, dual Craig-Bampton.

    Args:
        model: the full model, free-free.
        n_modes: number of elastic free-free modes.
        interfaces: {name: kind} as for `reduce`.
        certify: compare with the full model; costs one more factorisation per interface.

    Raises:
        InterfaceError, ConfigError: for a wrong interface, kind or number of modes.

    Source:
        Rixen, A dual Craig-Bampton method for dynamic substructuring, J. Comput. Appl. Math.
        168 (2004) 383; see docs/theory/other_bases.md.
    """
    draft = Draft(model=model, method=Rubin(n_modes), interfaces=interfaces)
    return run(wanted((True, connect), (True, release), (certify, hold_in_turn)), draft)


def release(draft: Draft) -> None:
    """Find the free modes, and what they leave of the flexibility of the interfaces."""
    draft.watch.begin("shapes")
    origins = {name: draft.model.interfaces[name].origin for name in draft.connection.parts}
    draft.body = free_substructure(draft.connection, origins, draft.method.n_modes)


def hold_in_turn(draft: Draft) -> None:
    """Compare the substructure, held by each interface, with the full model, by Rubin's method."""
    draft.watch.begin(COMPARISON_STAGE)
    connection, rows = draft.connection, list[Row]()
    alone = DualAssembly({"body": draft.body}, ())
    if not connection.ops.affordable:
        rows = [Row("dofs; full modes are too dear", connection.ops.n, "--", True)]
    for name in connection.parts if connection.ops.affordable else ():
        found = alone.frequencies(kind="rubin", fixed=(("body", name),))
        n_rigid = np.count_nonzero(found == 0.0)
        reduced = found[n_rigid : n_rigid + N_COMPARED]
        held = connection.held((name,))
        full = connection.ops.modes(held, n_rigid + reduced.size)[0][n_rigid:] / (2 * np.pi)
        table = {"reduced": reduced.tolist(), "full": full.tolist()}
        rows += frequency_rows(f"{name} held", table) if reduced.size else []
    report = Report("certificate of the substructure", tuple(rows))
    report.warn_of_failures("the certificate of the substructure")
    draft.body = replace(draft.body, certificate=report)
