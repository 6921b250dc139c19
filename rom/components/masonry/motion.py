"""Stones in motion: from step to step, with loads, moving supports and earthquakes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
import numpy.typing as npt

from rom.arguments import Count, Positive, finite, typed
from rom.components.masonry.actions import Action, driver
from rom.components.masonry.block_contact import OPEN, SLIDES, Contacts, contacts
from rom.components.masonry.discontinuous_deformation import advance, work
from rom.components.masonry.stones import SHEAR_STIFFNESS_RATIO, Masonry, polygon_moments
from rom.errors import ConfigError, SolverError
from rom.model import Array, Index

Time = Annotated[float, Positive("s")]


@dataclass(frozen=True)
class Motion:
    """Stones in motion.

    Attributes:
        masonry: the stones.
        t: (n,) times [s].
        q, v: (n, B, 3 + R) coordinates and rates: mass centre [m], angle [rad], elastic.
        energy: (n,) kinetic, elastic, potential, and of the contacts [J].
        contacts: those at the end.
        cuts: how often a step was cut.
        broken: (n,) how many contacts of glued joints have broken.
    """

    masonry: Masonry
    t: Array
    q: Array
    v: Array
    energy: Array
    contacts: Contacts
    cuts: int
    broken: Index

    def outlines(self, k: int = -1) -> list[Array]:
        """The (corners, 2) outline of each stone at time k [m]."""
        return [
            x[:2] + (s.outline - s.centre + s.shapes @ x[3 : 3 + len(s.K)]) @ _turned(x[2]).T
            for s, x in zip(self.masonry.stones, self.q[k], strict=True)
        ]

    def stress(self, k: int = -1) -> Array:
        """(B, 3) stress xx, yy, xy in body axes of stones with uniform strain [Pa m], per depth."""
        stones = self.masonry.stones
        areas = [polygon_moments(s.outline)[0] for s in stones]
        found = [s.K @ x[3 : 3 + len(s.K)] for s, x in zip(stones, self.q[k], strict=True)]
        return np.array(found) / np.array(areas)[:, None]

    def joints(self) -> dict[tuple[int, int], tuple[Array, Array]]:
        """For each pair of stones that touch at the end: centre of pressure, force on the first.

        Both (2,) [m], [N]; the centres along an arch are its line of thrust. Joints that pull as
        much as they press have no centre: NaN.
        """
        C, shear = self.contacts, SHEAR_STIFFNESS_RATIO * self.masonry.stiffness
        sums: dict[tuple[int, int], tuple[Array, Array, float]] = {}
        corners = np.vstack(self.outlines())
        for k in range(C.used[0]):
            if C.state[k] == OPEN or C.force[k] == 0:
                continue
            (i, a, j), normal = C.who[k, :3], C.along[k, 1:3]
            slide = C.way[k] * C.friction[k] * C.force[k]
            drag = slide if C.state[k] == SLIDES else shear * C.slip[k]
            force = C.force[k] * normal - drag * np.array([-normal[1], normal[0]])
            pair, force = (min(i, j), max(i, j)), force if i < j else -force
            x, f, total = sums.get(pair, (np.zeros(2), np.zeros(2), 0.0))
            sums[pair] = x + C.force[k] * corners[a], f + force, total + C.force[k]
        return {
            pair: (x / total if total > 0 else np.full(2, np.nan), f)
            for pair, (x, f, total) in sorted(sums.items())
        }


def _turned(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s], [s, c]])


@typed
def simulate(  # noqa: PLR0913  all that a run needs
    masonry: Masonry,
    *,
    t_end: Time,
    dt: Time,
    actions: Sequence[Action] = (),
    damping: Any = 0.0,
    save_every: Annotated[int, Count(1)] = 1,
    q: npt.ArrayLike | None = None,
    v: npt.ArrayLike | None = None,
) -> Motion:
    """Let the stones move.

    Args:
        masonry: the stones.
        t_end: duration [s].
        dt: step [s]; cut where contacts change too much.
        actions: what acts besides weight: loads, motions of supports, motion of the ground.
        damping: rate c at which motion relative to the ground dies away, by forces -c M v [1/s]: 0
            for dynamics; 10 to 50 to come to rest; np.inf for statics, each step from rest. Stones
            that rock feel it: with 1 / s a pulse must last a fifth longer to tip a block of 2 m.
        save_every: steps between two saved ones.
        q: (B, 3 + R) coordinates at the start [m, rad]; None for where the outlines are.
        v: (B, 3 + R) rates at the start [m/s, rad/s]; None for rest.

    Raises:
        ConfigError: if times or shapes do not fit, or an action cannot be.
        SolverError: if contacts do not settle even in the shortest steps; ``error.solution`` is the
            motion before.

    Source:
        After Shi (1988), as in `rom.components.masonry.discontinuous_deformation`.
    """
    B, law, n = masonry.blocks(), masonry.law, round(t_end / dt)
    if n < 1 or not damping >= 0:
        needed = "needed are a step or more, and a damping that does not drive the stones, >= 0"
        raise ConfigError(f"{n} steps with damping = {damping} 1/s: {needed}.")
    W, acting = work(B), driver(masonry, actions)
    for name, given, target in (("q", q, W.q), ("v", v, W.v)):
        start = masonry.start() * (name == "q") if given is None else given
        target[:] = finite(name, start, target.shape)
    C, old = (contacts(8 * len(B.corner), B.load.shape[1], len(B.size)) for _ in range(2))
    cuts, kept = np.zeros(1, dtype=np.int64), np.array([0, *range(save_every, n + 1, save_every)])
    Q, V = np.zeros((2, kept.size, *W.q.shape))
    energy, broken = np.full(kept.size, np.nan), np.zeros(kept.size, dtype=np.int64)
    found = Motion(masonry, dt * kept, Q, V, energy, C, 0, broken)
    Q[0], V[0] = W.q, W.v
    for k in range(1, len(kept)):
        driven = acting(dt * np.arange(kept[k - 1], kept[k] + 1))
        energy[k] = advance(B, law, C, old, W, dt, driven, float(damping), cuts)
        Q[k], V[k], broken[k] = W.q, W.v, np.sum(law.bonds.intact == 0)
        if not np.isfinite(energy[k]):
            least, before = f"{dt / 3**8:.2g} s", _first(found, k, int(cuts[0]))
            text = f"contacts do not settle near t = {found.t[k]:.6g} s, even in steps of {least}."
            hint = "Use softer contacts, or a smaller dt."
            raise SolverError(text, hint=hint, solution=before)
    return _first(found, len(kept), int(cuts[0]))


def _first(found: Motion, k: int, cuts: int) -> Motion:
    rows = {name: getattr(found, name)[:k] for name in ("t", "q", "v", "energy", "broken")}
    return replace(found, **rows, cuts=cuts)
