"""Large deflection of a reduced body against that of its finite elements.

Each component of the load range alone, of either sign, and several together in proportions that no
shape was made for: at steps of the load the state of the full model, its displacement, and its
frequencies about that state, and how far each interface yields there to what else acts on it.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.linalg import eigh

from rom.body.flexible import FlexibleBody
from rom.body.nonlinear.cauchy import CauchyRecovery
from rom.body.nonlinear.full import N_TANGENT, HeldSolid, nearest_rotation
from rom.body.nonlinear.ranges import (
    Geometric,
    axis_point,
    further_loads,
    held_motions,
    nodal_forces,
)
from rom.body.nonlinear.statics import follow, free_motions
from rom.body.projection import cauchy_recovery
from rom.checks.draft import COMPARISON_STAGE, Draft
from rom.eigen.verbs import own_rows
from rom.errors import ModelError
from rom.model import Array, Row
from rom.rows import row

DISPLACEMENT_RTOL = 5e-3  # of the largest load, in the mean square over the mass
TANGENT_RTOL = 2e-2  # small errors of stress are large ones of the stiffness it gives a thin body
COMPLIANCE_RTOL = 5e-2  # to forces and moments of all directions, beside the range as well
STRESS_RTOL = 5e-2  # over all of the surface, of the mean square; it has the errors of slopes
MESH_RTOL = 5e-3  # of the energy; a bent line is then stiffer by half as much again
COMPARED = (  # of each step: attribute, words, limit
    ("displacement", "displacement", DISPLACEMENT_RTOL),
    ("frequencies", "frequencies about it", TANGENT_RTOL),
    ("compliance", "compliance of interfaces about it", COMPLIANCE_RTOL),
    ("stress", "stress", STRESS_RTOL),
)
SMALL_SHARE = 1e-3  # of the largest load, under which nothing turns
STEP_SHARES = (0.35, 0.7, 1.0)  # of the largest load
UNTRAINED_RATIO = np.sqrt(2) - 1  # of a component to the one before, as trained nowhere


def compare_deflections(draft: Draft) -> None:
    """Compare states under the loads of a range: a stage of a reduction for large deflection.

    The certificate gets rows, one of them about the mesh itself, which no comparison with the full
    model judges; the provenance of the body gets "large deflection", a table {load case: its loads,
    errors and how far it holds}: for each "case", the share of each component of the range; "share"
    of the load at the steps compared, and there "displacement" and "frequencies", relative errors;
    "holds to", the share up to which all steps hold; "energy" [J] of the body there, and "turn"
    [rad] of the interface that has turned most.
    """
    draft.watch.begin(COMPARISON_STAGE)
    geometric, model, ops, body = draft.nonlinear, draft.model, draft.ops, draft.body
    held, hyperelastic = held_motions(geometric, model.interfaces), geometric.sampling is not None
    full = HeldSolid.of(model, draft.connection, body.reference, held, neo_hookean=hyperelastic)
    quartic, still, ends = body.energy(), body.mean_rows(geometric.fixed), list[Array]()
    about = axis_point(geometric, model, body.reference)
    loads = geometric.components(), further_loads(geometric, held)
    units, F = (full.whole(nodal_forces(some, model, ops, about)) for some in loads)
    E = full.whole(draft.E)
    tangent = Tangent(body, still, E.T @ F)
    rows, table = list[Row](), dict[str, Any]()
    for name, case in load_cases(geometric).items():
        W = units @ case
        try:
            straight, *path = follow(quartic, np.outer((SMALL_SHARE, *STEP_SHARES), W @ E), still)
        except ModelError as error:
            error.where = f"load {name!r} of the range"
            raise
        ends += [straight, path[-1]]
        steps = []
        for share, q in zip(STEP_SHARES, path, strict=True):
            u = E @ q
            a = full.state(u, share * W)
            if a is None:
                break
            step = _compared(full, tangent, F, (u, q, a))
            if isinstance(body.stress, CauchyRecovery):
                u_full = own_rows(ops, full.T @ a)[:, None]
                known = cauchy_recovery(model, u_full).field(np.ones(1))
                gap = np.linalg.norm(body.stress.field(q) - known) / np.linalg.norm(known)
                step = replace(step, stress=float(gap))
            steps.append(step)
        rows += case_rows(name, steps)
        gaps = ((step.displacement, step.frequencies) for step in steps)
        holds = [u <= DISPLACEMENT_RTOL and f <= TANGENT_RTOL for u, f in gaps]
        n_held = [*holds, False].index(False)
        table[name] = {
            "case": case.tolist(),
            "share": list(STEP_SHARES[: len(steps)]),
            "displacement": [step.displacement for step in steps],
            "frequencies": [step.frequencies for step in steps],
            "holds to": STEP_SHARES[n_held - 1] if n_held else 0.0,
            "energy": quartic.energy(path[n_held - 1]) if n_held else 0.0,
            "turn": _turn(body, path[n_held - 1]) if n_held else 0.0,
        }
    # a mesh that is too coarse for a turn stiffens, and so does the full model
    unresolved = model.stresses.large_strain().unresolved(draft.E @ np.array(ends).T)
    straight, bent = unresolved.reshape(-1, 2).T
    coarse = (bent - straight).max()
    rows.append(row("energy that cells add, too coarse to bend so far", coarse, MESH_RTOL))
    most = np.degrees(max(case["turn"] for case in table.values()))
    rows.append(Row("turn of an interface that holds [degrees]", most, "information", True))
    draft.rows = (*draft.rows, *rows)
    body.provenance["large deflection"] = table


def _turn(body: FlexibleBody, q: Array) -> float:
    """Largest rotation [rad] of an interface against the frame, nearest to all its points."""
    angles = [0.0]
    for marker in body.markers.values():
        if marker.covariance is not None:
            R = nearest_rotation(marker.covariance @ np.r_[1.0, q])
            angles.append(float(np.arccos(np.clip(0.5 * (np.trace(R) - 1), -1.0, 1.0))))
    return max(angles)


@dataclass(frozen=True)
class Step:
    """A state of the body against that of the full model."""

    displacement: float  # distance of the two, relative, in the mean square over the mass [1]
    reached: float  # displacement of the body along that of the full model, as a share of it [1]
    frequencies: float  # largest relative error of the lowest frequencies about it [1]
    # the same of displacements of the interfaces of the range, each by a small further force or
    # moment along itself [1]
    compliance: float | None = None
    # distance of the stress on the surface, relative, in the mean square [1]
    stress: float | None = None


def _compared(full: HeldSolid, body: "Tangent", F: Array, at: tuple[Array, ...]) -> Step:
    """The body at u (n,), q (r,) against the full model in equilibrium at a (m,).

    F: (n, k) forces under which both yield.
    """
    u, q, a = at
    soft = full.softness(a)
    with np.errstate(divide="ignore", invalid="ignore"):  # the full model may have no stiffness
        gaps = np.abs(body.frequencies(q) / full.frequencies(soft) - 1)
        yields = np.abs(body.compliances(q) / full.compliances(soft, F) - 1)
    worst = float(gaps.max()), float(yields.max(initial=0.0))
    return Step(full.distance(u, a), full.reached(u, a), *worst)


def case_rows(name: str, steps: list[Step]) -> list[Row]:
    """Lines of a load case, the worst of its steps; one more where the basis locks."""
    n = len(STEP_SHARES)
    rows = [row(f"{name}: full states found, of {n}", len(steps), n - 0.5, above=True)]
    for of, quantity, limit in COMPARED:
        if values := [x for step in steps if (x := getattr(step, of)) is not None]:
            rows.append(row(f"{name}: {quantity}", max(values), limit))
    reached = min((step.reached for step in steps), default=1.0)
    if reached < 1 - DISPLACEMENT_RTOL:
        why = f"{name}: share of the full deflection; the body is too stiff, it has too few shapes"
        rows.append(row(why, reached, 1 - DISPLACEMENT_RTOL, above=True))
    return rows


def load_cases(geometric: Geometric) -> dict[str, Array]:
    """{name: share of each component of the range (l,)}.

    Where there are several components, two cases have all of them, in falling proportion and in
    rising proportion with alternating signs.
    """
    components = geometric.components()
    cases, n = dict[str, Array](), len(components)
    for load, unit in zip(components, np.eye(n), strict=True):
        cases |= {"-"[sign > 0 :] + load.name: sign * unit for sign in load.signs}
    if n > 1:
        falling = UNTRAINED_RATIO ** np.arange(n)
        falling /= np.linalg.norm(falling)
        signs = [(-1.0) ** k if -1 in load.signs else 1.0 for k, load in enumerate(components)]
        cases["all, the first most"] = falling
        cases["all, the last most"] = falling[::-1] * signs
    return cases


class Tangent:
    """Small vibrations of a body of large deflection about states on its supports.

    Held are motions (h, r); under forces F (r, k) it yields.
    """

    def __init__(self, body: FlexibleBody, held: Array, F: Array):
        self.energy, self.F = body.energy(), F
        self.N = free_motions(held)
        self.M = self.N.T @ body.M @ self.N

    def frequencies(self, q: Array) -> Array:
        """(k,) lowest frequencies about the state q (r,) [rad/s]."""
        K = self.N.T @ self.energy.tangent(q) @ self.N
        lam = eigh(K, self.M, eigvals_only=True)[:N_TANGENT]
        return np.sqrt(np.maximum(lam, 0.0))

    def compliances(self, q: Array) -> Array:
        """(k,) displacements of unit forces along themselves about the state q (r,) [m/N]."""
        F, K = self.N.T @ self.F, self.N.T @ self.energy.tangent(q) @ self.N
        return np.asarray((F * np.linalg.solve(K, F)).sum(axis=0))
