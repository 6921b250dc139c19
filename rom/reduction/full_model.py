"""The full model: its operators, its mass, and its natural modes with interfaces of any kind."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rom.arguments import one_given, typed, whole
from rom.eigen.attachments import added_mass
from rom.eigen.band import modes_up_to
from rom.eigen.scipy import SciPyOperators
from rom.eigen.supports import Fixed, Springs, refuse_loose, spring_matrices, supports
from rom.eigen.verbs import Operators, column_blocks, given_rigid_motions, held_rows
from rom.model import Array, FEModel, Index, Modes
from rom.process.progress import MANY_DOFS, stages
from rom.reduction.interfaces.connection import connect
from rom.reduction.interfaces.kinds import by_name
from rom.rotation import axial


def mesh_operators(model: FEModel) -> Operators:
    """The operator verbs on the finite elements of a model, attachments left out."""
    if model.operators is not None:
        return model.operators
    return SciPyOperators(model.K, model.M, model.rigid_motions())


def operators(model: FEModel) -> Operators:
    """The operator verbs on a model with everything it carries."""
    ops = mesh_operators(model)
    dM = added_mass(model, ops.first, ops.n_local)
    return ops if dM is None else ops.plus_mass(dM)


@dataclass(frozen=True, slots=True)
class MassProperties:
    """What a rigid body needs to know of a solid."""

    mass: float  # [kg]
    centre: Array  # (3,) of mass [m]
    inertia: Array  # (3, 3) about the mass centre, axes of the geometry [kg m^2]


@typed
def mass_properties(model: FEModel) -> MassProperties:
    """Mass, mass centre and inertia of a finite element model with all it carries.

    From the rigid part R^T M R of the mass matrix; under mpirun to be called on all ranks.

    Example:
        >>> steel = rom.Material(E=210e9, nu=0.3, rho=7850.0)
        >>> beam = rom.fe.model("meshes/beam.geo", material=steel)  # 1 m x 50 mm x 30 mm
        >>> rigid = rom.mass_properties(beam)
        >>> round(float(rigid.inertia[2, 2] / (rigid.mass * (1.0 + 0.05**2) / 12)), 6)
        1.0
    """
    ops = operators(model)
    R = given_rigid_motions(ops)
    M = ops.gram(R, ops.apply_M(R))
    mass = float(np.trace(M[:3, :3])) / 3
    centre = axial(M[3:, :3]) / mass
    steiner = mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    return MassProperties(mass, centre, 0.5 * (M[3:, 3:] + M[3:, 3:].T) - steiner)


@typed
def modes(
    model: FEModel,
    n: int | None = None,
    *,
    f_max: float | None = None,
    fixed: Fixed = (),
    springs: Springs | None = None,
    interfaces: dict[str, Any] | None = None,
    tol: float = 1e-3,
) -> Modes:
    """Lowest natural modes of the full model, so many or up to a frequency.

    Args:
        model: the body.
        n: number of modes; without support the six rigid motions come first and count.
        f_max: alternatively, all modes up to this frequency [Hz], by
            `rom.eigen.substructured_modes`, counted first, in one process.
        fixed: names of the interfaces held, or {name: directions}: {"root": "yz"} slides along x,
            {"cut": "x"} on a plane normal to x is one of symmetry; "xyz rx" with rotations where
            the interface is rigid or averaged.
        springs: {interface: (3,) or (6,) stiffness to the ground}, translations, then rotations
            [N/m, N m/rad], on its mean motion unless it is rigid.
        interfaces: {name: kind} to give interfaces the kind they have in a reduced body, so that
            like is compared with like; an interface that is only held keeps all its dofs.
        tol: with f_max, how large the bound ``error`` of a frequency may be [1]; with n the search
            goes down to round-off.

    Raises:
        InterfaceError: if an interface is unknown, or has no such coordinates; naming the motion
            that supports leave to the whole body.
        ConfigError: if not one of n and f_max is given, or it is not positive.
        ModesMissedError: if a count says that a mode was skipped.
        ParallelError: with f_max under mpirun.

    Example:
        >>> steel = rom.Material(E=210e9, nu=0.3, rho=7850.0)
        >>> beam = rom.fe.model("meshes/beam.geo", material=steel)  # 1 m x 50 mm x 30 mm
        >>> found = rom.modes(beam, 1, fixed=("root",)).frequencies  # Euler-Bernoulli: 25.06 Hz
        >>> round(float(found[0]))
        25
    """
    one_given("modes", n=n, f_max=f_max)
    if n is not None:
        whole("n", n, 1)
    kinds = by_name(interfaces or {})
    stiffness = spring_matrices(springs, model.interfaces, "the model")
    kinds = dict.fromkeys(stiffness, "rbe3") | dict(model.kinds) | kinds
    kinds |= {f: "full" for f in supports(fixed, model.interfaces) if f not in kinds}
    connection = connect(operators(model), model, kinds)
    held = connection.held(fixed)
    if stiffness:
        connection = connection.on_springs(stiffness)
    else:
        refuse_loose(connection.ops, held)
    with stages(2, long=connection.ops.n > MANY_DOFS) as begin:
        sought = f"{n} modes" if f_max is None else f"modes up to {f_max:g} Hz"
        begin(f"{sought} of {connection.ops.n} dofs")
        if f_max is None:
            found = Modes(*connection.ops.modes(held, n))
        else:
            found = modes_up_to(connection.ops, held, f_max, tol)
        begin(f"residuals of {found.omega.size} modes")
        residual = _residual(connection.ops, held, *found)
    return replace(found, shapes=connection.ops.expand(found.shapes), residual=residual)


def _residual(ops: Operators, held: Index, omega: Array, Phi: Array) -> Array:
    """norm(K phi - lambda M phi) / (lambda norm(M phi)) on the free dofs."""
    free, norms = ~held_rows(ops, held)[:, None], np.zeros((2, omega.size))
    for few in column_blocks(omega.size):
        inertia = ops.apply_M(Phi[:, few])
        residual = ops.apply_K(Phi[:, few]) - inertia * omega[few] ** 2
        seen = residual * free, inertia * free
        norms[:, few] = [np.sqrt(np.diag(ops.gram(X, X))) for X in seen]
    scale = np.maximum(omega, omega[omega > 0].min(initial=np.inf)) ** 2
    scale[~np.isfinite(scale)] = 1.0
    return norms[0] / (scale * norms[1])
