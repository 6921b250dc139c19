"""A gear unit as a mechanism, and where it rests: shafts and housing are in frames that are held.

All motions of a shaft are small in axes that do not spin, its rigid ones too. They are elastic
coordinates of a body whose frame does not move: modes y of the part with its drive and its thrust
bearing, q = V y. Films and teeth lie between such bodies as between any others.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.linalg import eigh

from rom.body.flexible import FlexibleBody
from rom.body.records import Marker
from rom.body.spread import SpreadLoad
from rom.components.round_bodies.spins import SPINS_FAMILY, Spin
from rom.components.transmission.unit import Rest, Transmission
from rom.errors import RomError, SolverError
from rom.mbs.analysis.equilibrium import equilibrium
from rom.mbs.analysis.local_equations import snapshot
from rom.mbs.mechanism import Mechanism
from rom.mbs.results.solution import Solution
from rom.mbs.results.state import State
from rom.model import Array

NAMES = ("pinion", "gear", "housing")
FRAME_NAME = "frame"
Z_AXIS = np.array([0.0, 0.0, 1.0])
Rows = Mapping[str, tuple[Array, Array]]


def rest(
    unit: Transmission,
    theta: float = 0.0,
    *,
    start: Array | None = None,
    loads: tuple[float, ...] = (1.0,),
) -> Rest:
    """Static equilibrium, found from the unloaded datum.

    Args:
        unit: the transmission.
        theta: angle of the pinion [rad].
        start: (n,) coordinates of an equilibrium nearby [m, rad]; then the load is not raised.
        loads: shares of the load on the way [1].

    Raises:
        SolverError: if films or teeth cannot carry the load; ``error.solution`` is what was reached
            at the share of it before.

    Source:
        Gears and films in one: Fargere and Velex, J. Vib. Acoust. 135 (2013) 061014.
    """
    q = np.zeros(unit.load.size) if start is None else start
    for share in loads if start is None else (1.0,):
        x, y = (share * g for g in unit.gravity)
        there = replace(unit, torque=share * unit.torque, gravity=(x, y))
        found = _settled(unit if share == 1.0 else there, theta, q)
        q = found.q
    return found


def _settled(unit: Transmission, theta: float, q: Array) -> Rest:
    """Where a unit rests, found from other coordinates (n,)."""
    mech = mechanism_of(unit, q, 0.0 * q)
    try:
        return _rest_of(unit, theta, mech, equilibrium(mech, t=theta / unit.speed))
    except RomError as error:
        text = f"the unit does not come to rest under {unit.torque} N m at {unit.speed:.1f} rad/s"
        hint = "Raise speed or viscosity, lower the torque, or move the oil inlets."
        near = error.solution and _rest_of(unit, theta, mech, error.solution)
        raise SolverError(f"{text}: {error.message}", hint=hint, solution=near) from error


def _rest_of(unit: Transmission, theta: float, mech: Mechanism, state: State) -> Rest:
    """A state of the mechanism in the coordinates of the unit, with films and teeth."""
    still = snapshot(mech, state)
    (q,), (v,) = coordinates_of(unit, still)
    seen = [
        still.journal_bearing(name).motion[0] * (1.0, 1.0, turn, turn)
        for name, (_, _, turn) in zip(mech.journal_bearings, unit.journals, strict=True)
    ]
    size = np.sqrt(unit.load @ np.linalg.solve(unit.matrices[0], unit.load))
    forces = unit.forces(q, v, theta, seen=np.array(seen))
    return Rest(unit, q, theta, forces, float(np.linalg.norm(still.a) / size))


def mechanism_of(unit: Transmission, q: Array, v: Array) -> Mechanism:
    """The unit as a mechanism, which starts at coordinates q (n,) with rates v (n,).

    Its time is the angle of the drive over the speed. Films are called ``pinion 0`` by shaft and
    node, the teeth ``teeth``.
    """
    mech, matrices = Mechanism(gravity=(0.0, 0.0, 0.0)), unit.matrices
    places, origins = places_of(unit)
    for k, at in enumerate(unit.parts[: len(places)]):
        M, K, G = (A[at, at] for A in matrices)
        body, V = _held(NAMES[k], M, K, unit.loss, places[k])
        y, yd = (V.T @ M @ x[at] for x in (q, v))
        part = mech.add_flexible(NAMES[k], body, at=origins[k], q=y, qd=yd)
        mech.fixed(f"frame of {NAMES[k]}", mech.ground.marker(origins[k]), part.marker(FRAME_NAME))
        if k < 2:
            # modes have no surface to tell gyroscopic forces -G v from: they are given
            mech.parts[NAMES[k]] = replace(part, spin=unit.spins[k] * Z_AXIS)
            spin = -np.pad(V.T @ G @ V, (3, 0))
            mech.add(f"spin of {NAMES[k]}", Spin(NAMES[k], spin, 0.0 * G), SPINS_FAMILY)
            shapes = (V.T @ unit.load[at])[:, None, None] * np.eye(3) / 3
            load = SpreadLoad(np.zeros(3), np.zeros((3, 3)), shapes)
            mech.spread_load(f"load of {NAMES[k]}", part, load, frame="world")
    _add_contacts(mech, unit)
    return mech


def _add_contacts(mech: Mechanism, unit: Transmission) -> None:
    """Films and teeth."""
    mesh, wheels = unit.mesh, []
    film = partial(mech.journal_bearing, reference=(1, 0, 0), oil=unit.viscosity)
    for name, rotor, turn in (("pinion", unit.pinion, 1.0), ("gear", unit.gear, -1.0)):
        wheels.append(mech.part(name).marker(f"node {rotor.wheel}"))
        for node, bearing in rotor.bearings.items():
            seat = mech.part(name).marker(f"node {node}")
            bush = mech.ground.marker(mech.design_point(seat))
            if unit.housing is not None:
                bush = mech.part("housing").marker(f"{name} {node}")
            film(f"{name} {node}", seat, bush, axis=turn * Z_AXIS, bearing=bearing)
    teeth = partial(mech.gear_mesh, pair=mesh.pair, stiffness=mesh.stiffness, cells=mesh.cells)
    teeth = partial(teeth, correction=mesh.correction, damping=mesh.damping, conservative=False)
    teeth("teeth", *wheels, axis=Z_AXIS, entry=0.0)


def coordinates_of(unit: Transmission, solution: Solution) -> tuple[Array, Array]:
    """(n_t, n) coordinates and rates of the unit in a motion of its mechanism."""
    bodies = solution.packed.system.bodies
    q, v = [], []
    for i, k, r, at in zip(bodies.q_at, bodies.v_at, bodies.r, unit.parts, strict=False):
        V = _modes(*(A[at, at] for A in unit.matrices[:2]))[1]
        q.append(solution.q[:, i + 7 : i + 7 + r] @ V.T)
        v.append(solution.v[:, k + 6 : k + 6 + r] @ V.T)
    return np.hstack(q), np.hstack(v)


def _modes(M: Array, K: Array) -> tuple[Array, Array]:
    """(n,) squares of frequencies [rad^2/s^2] and (n, n) shapes of unit mass."""
    squares, V = eigh(K, M)
    return np.maximum(squares, 0.0), V


def places_of(unit: Transmission) -> tuple[list[Rows], list[Array]]:
    """Of each part its places by name: (3,) points, and (6, n) rows of motion; and its origin."""
    along: list[dict[int, float]] = []
    places: list[Rows] = []
    for one in (unit.pinion, unit.gear):
        rows = {node: one.shaft.rows(node) for node in (*one.bearings, one.wheel)}
        along.append({node: float((B @ one.shaft.rigid())[0, 4]) for node, B in rows.items()})
        places.append({f"node {n}": (along[-1][n] * Z_AXIS, B) for n, B in rows.items()})
    beside = along[0][unit.pinion.wheel] - along[1][unit.gear.wheel]
    origins = [np.zeros(3), np.array([unit.mesh.pair.distance, 0.0, beside])]
    if unit.housing is not None:
        origins.append(np.zeros(3))
        bushes = ((k, n, rows) for k in (0, 1) for n, rows in unit.housing.bushes[k].items())
        at = {f"{NAMES[k]} {n}": (origins[k] + along[k][n] * Z_AXIS, rows) for k, n, rows in bushes}
        places.append(at)
    return places, origins


def _held(name: str, M: Array, K: Array, loss: float, places: Rows) -> tuple[FlexibleBody, Array]:
    """A body of modes in a frame that will be held, and (n, n) coordinates per mode.

    The frame has no part in the motion; by its mass one counts how far modes move: none moves a
    place farther than the mechanism is long where it counts as one.
    """
    squares, V = _modes(M, K)
    r, still = squares.size, np.zeros((3, squares.size))
    markers = {FRAME_NAME: Marker(FRAME_NAME, np.zeros(3), still, still, "rbe2", np.eye(6, 6 + r))}
    for key, (point, rows) in places.items():
        shift, turn = np.split(rows @ V, 2)
        hold = np.hstack([np.eye(6), np.vstack([shift, turn])])
        markers[key] = Marker(key, point, shift, turn, "rbe2", hold)
    mass = 1.0 / max(np.abs(marker.translation).max() for marker in markers.values()) ** 2
    reach = max(float(np.linalg.norm(marker.point)) for marker in markers.values())
    J, K, omega = mass * reach**2 * np.eye(3), np.diag(squares), np.sqrt(squares)
    I, S_kl = np.zeros((3, 3, r)), np.einsum("ab,kl->abkl", np.eye(3) / 3, np.eye(r))
    labels = tuple(f"mode {k + 1}" for k in range(r))
    body = FlexibleBody(
        name, mass, np.zeros(3), J, still, I, S_kl, K, loss * K, markers, omega, labels
    )
    return body, V
