"""Evidence for bodies that stand for one solid together: a mechanism of them at rest against it."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from rom import rotation
from rom.arguments import typed
from rom.assembly.pieces import Pieces
from rom.body.nonlinear.full import N_TANGENT, HeldSolid
from rom.body.nonlinear.ranges import Geometric, Load
from rom.checks.deflection import STEP_SHARES, Step, case_rows, load_cases
from rom.checks.glued import GluedSolid
from rom.errors import ConfigError, ModelError, SolverError
from rom.mbs.analysis.equilibrium import equilibrium
from rom.mbs.analysis.linearize import linearize
from rom.mbs.analysis.local_equations import snapshot
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.state import State
from rom.model import Array, FEModel, Report, Row
from rom.names import named, offered

EQUILIBRIUM_STEPS = 8  # of load on the way to the first state


@typed
def certify_pieces(
    pieces: Pieces, models: Mapping[str, FEModel], *, nonlinear: Geometric
) -> Pieces:
    """The pieces with a certificate: welded to each other they bend as the whole solid does.

    The whole is glued from the models, whose nodes meet at the cuts, and solved at finite strain.
    At steps of each load and of several together, displacement of the surface and frequencies
    about the state are compared, as they are for one body. Moments turn with their sections on
    either side.

    Args:
        pieces: of `reduce_pieces`.
        models: {name: piece} of which they were made.
        nonlinear: the range; loads on interfaces. Forces keep their direction, moments their axis.

    Raises:
        ConfigError: for a range with centrifugal force or supports beside the reference; for models
            of other pieces.
        ModelError: if nodes of two pieces do not meet at their cut.

    Example:
        >>> beam = {"material": rom.Material(E=2e11, nu=0, rho=7850), "parameters": {"lc": 0.1}}
        >>> halves = rom.fe.pieces("meshes/beam.geo", n=2, axis=(1, 0, 0), **beam)
        >>> loads = rom.Geometric(loads={"tip": (0, 0, 9e3, 0, 0, 0)}, n_modes=1, n_steps=2)
        >>> pieces = rom.reduce_pieces(halves, reference="root", nonlinear=loads, certify=False)
        >>> rom.certify_pieces(pieces, halves, nonlinear=loads).certificate.ok
        True
    """
    reference = _refuse(pieces, models, nonlinear)
    holder = next(model for model in models.values() if reference in model.interfaces)
    place = holder.interfaces[reference].origin
    solid = GluedSolid.of(models, pieces.joints)
    components = nonlinear.components()
    bent = list(dict.fromkeys(load.interface for load in components if load.component > 2))
    held, sections = [solid.motion(Load(reference, k)) for k in range(6)], map(solid.section, bent)
    full = HeldSolid(solid, solid.M, held, sections=list(sections))
    units = np.array([_load(solid, bent, load) for load in components]).T
    rows = list[Row]()
    for name, case in load_cases(nonlinear).items():
        rest = _AtRest(pieces, (reference, place), components, case)
        steps, a = list[Step](), np.zeros(solid.n)
        for share in STEP_SHARES:
            W = share * (units @ case)
            found = full.state(a, W)
            if found is None or not rest.moved_to(share):
                break
            a = found
            steps.append(_compared(rest, solid, full, (a, W)))
        rows += case_rows(name, steps)
    return replace(pieces, certificate=Report("certificate of pieces", tuple(rows)))


def _load(solid: GluedSolid, bent: list[str], load: Load) -> Array:
    """(n + 3 s,) a component at its largest: nodal forces, then moments on the sections."""
    moments = np.zeros((len(bent), 3))
    if load.component > 2:
        moments[bent.index(load.interface), load.component - 3] = load.largest
        return np.r_[np.zeros(solid.n), moments.ravel()]
    return np.r_[load.largest * solid.motion(load), moments.ravel()]


class _AtRest:
    """Pieces on their support under a growing load case."""

    def __init__(
        self, pieces: Pieces, support: tuple[str, Array], components: list[Load], case: Array
    ):
        self.pieces = pieces
        self.state: State | None = None
        self.mech = Mechanism(gravity=(0, 0, 0))
        markers = pieces.add_to(self.mech, "whole")
        self.mech.fixed("support", self.mech.ground.marker(support[1]), markers[support[0]])
        for k, (load, x) in enumerate(zip(components, case, strict=True)):
            most = x * load.largest * np.eye(3)[load.component % 3]
            act = self.mech.torque if load.component > 2 else self.mech.force
            act(f"load {k}", markers[load.interface], lambda t, most=most: t * most)

    def moved_to(self, share: float) -> bool:
        """Whether there is an equilibrium at a share of the load; it is the state from then on."""
        try:
            steps = EQUILIBRIUM_STEPS if self.state is None else 1
            self.state = equilibrium(self.mech, self.state, t=share, steps=steps)
        except (ModelError, SolverError):
            return False
        return True

    def displacements(self) -> dict[str, Array]:
        """{piece: (p, 3) displacement of its surface in the world [m]}."""
        assert self.state is not None
        still, found = snapshot(self.mech, self.state), {}
        for key, body in self.pieces.bodies.items():
            name, surface = f"whole {key}", body.surface
            assert surface is not None  # of finite elements
            x = surface.points
            moved = x + (surface.shape @ still.elastic(name)[0]).reshape(-1, 3)
            A = rotation.matrix(still.orientation(name)[0])
            place = self.pieces.places.get(key, np.zeros(3))
            found[key] = still.position(name)[0] + moved @ A.T - x - place
        return found


def _compared(rest: _AtRest, solid: GluedSolid, full: HeldSolid, at: tuple[Array, Array]) -> Step:
    """The pieces against the whole at a displacement (n,) under a load."""
    (a, W), found, known = at, [], []
    for key, u in rest.displacements().items():
        surface = solid.models[key].surface
        assert surface is not None
        known.append(a[solid.dofs[key]].reshape(-1, 3)[surface.nodes])
        found.append(u)
    u, v = np.vstack(found), np.vstack(known)
    size = float((v * v).sum())
    omega = 2 * np.pi * linearize(rest.mech, rest.state, n=N_TANGENT).frequencies[:N_TANGENT]
    turning = bool(W[a.size :].any())
    gaps = np.abs(omega / full.frequencies(full.softness(a, W), symmetric=not turning) - 1)
    distance = float(np.sqrt(((u - v) ** 2).sum() / size))
    return Step(distance, float((u * v).sum()) / size, float(gaps.max()))


def _refuse(pieces: Pieces, models: Mapping[str, FEModel], nonlinear: Geometric) -> str:
    """The interface on which the pieces are held; see `certify_pieces` for what is refused."""
    if set(models) != set(pieces.bodies):
        text = f"the models are {named(models)}, the pieces {named(pieces.bodies)}"
        raise ConfigError(f"{text}; give the models of which the pieces were made.")
    if without := [key for key, model in models.items() if model.stresses is None]:
        raise ConfigError(
            f"the models {named(without)} have no finite elements, from which alone large strain "
            "follows.",
            hint="Make them with rom.fe.pieces.",
        )
    free = {name for body in pieces.bodies.values() for name in body.markers} - {*pieces.joints}
    if unknown := [name for name in nonlinear.loads if name not in free]:
        raise ConfigError(f"the range names {named(unknown)}; the pieces have {offered(free)}.")
    turning = [load.name for load in nonlinear.components() if not load.interface]
    if turning or nonlinear.fixed:
        raise ConfigError(
            f"pieces are certified for loads on interfaces; the range has {named(turning)}, and "
            f"holds {nonlinear.fixed!r}.",
            hint="Give a range of loads on interfaces that lead to like deflections.",
        )
    (reference,) = {body.reference for body in pieces.bodies.values()} & free
    return reference
