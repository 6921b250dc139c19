"""Mistakes in force laws of the user, found by asking them at many motions of their markers."""

import ctypes
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from rom import rotation
from rom.arguments import Count, typed
from rom.mbs.elements.law_calls import ENERGY_SIZE, MOTION_SIZE, answer_of, differences, motion_of
from rom.mbs.elements.laws import Law, UserForce
from rom.mbs.mechanism import Mechanism
from rom.model import Array, Mask, Report, Row
from rom.names import check_known

LAW_ENTRY = ctypes.CFUNCTYPE(None, ctypes.c_double, *[ctypes.c_void_p] * 4)
GUARD_SIZE, GUARD_VALUE = 64, -7.25e77  # numbers on either side of an array, which nobody writes
DIFFERENCE_STEP = 1e-5
MOST_SAMPLES = 1000
TANGENT_RTOL = 1e-6  # of the largest derivative: what central differences leave
ENERGY_RTOL = 1e-6  # of the powers that add up to nothing
ENERGY_DIGITS = 16 * np.finfo(float).eps  # of an energy: what a difference of two may be
SPREAD_SHARE, TURN_SPREAD = 0.1, 0.3  # of the probed motions: of the size of the mechanism; [rad]
AXIS_NAMES = "xyz"


@typed
def check_law(
    mechanism: Mechanism,
    name: str,
    *,
    t: float = 0.0,
    samples: Annotated[int, Count(1, MOST_SAMPLES)] = 5,
    rng: np.random.Generator | None = None,
) -> Report:
    """Ask a law at random motions around the start, and look for what would spoil a run.

    Checked are: numbers that are not finite; writing beyond its arrays, or into what it is only to
    read; other answers when it is asked again, or when it finds the memory it has just written;
    tangents of its own against central differences; and, of laws that account for their energy,
    that the power of the forces, the rate of the stored energy and the lost power add up to
    nothing. The worst entry is named.

    Args:
        mechanism: with the law.
        name: of the law.
        t: time [s].
        samples: number of motions, at most 1000.
        rng: source of the motions; None for always the same.

    Raises:
        ConfigError: for a name that no law has.
        Exception: whatever a law in Python raises.
    """
    laws = {key: one for key, one in mechanism.laws.items() if not isinstance(one, UserForce)}
    check_known(name, laws, f"name = {name!r}: no law; there are")
    law = laws[name]
    rng = np.random.default_rng(0) if rng is None else rng
    asked = _Asked(law, t)
    found = [_looked(asked, motion) for motion in _motions(mechanism, law, samples, rng)]
    rows = [max(row, key=lambda one: one.value / one.limit) for row in zip(*found, strict=True)]
    return Report(f"law {name!r} at {samples} motions", tuple(row.row for row in rows))


@dataclass(frozen=True)
class _Finding:
    """How much of something, where it was worst, and what is allowed."""

    what: str
    where: str
    value: float
    limit: float

    @property
    def row(self) -> Row:
        ok = bool(self.value <= self.limit)
        where = "" if ok or not self.where else f": {self.where}"
        return Row(f"{self.what}{where}", self.value, f"<= {self.limit:g}", ok)


class _Asked:
    """A law with guarded memory around all that it is given."""

    def __init__(self, law: Law, t: float):
        self.law, self.t = law, t
        n, m, o = law.sizes
        places = [(k, axis) for k in range(n) for axis in AXIS_NAMES]
        loads = [f"{what} on marker {k}, {a}" for what in ("force", "moment") for k, a in places]
        memory = [f"memory {k}" for k in range(m)]
        self.fields = [*loads, "energy", "lost power", *memory, *law.outputs]
        ways = ("way of marker {} along {}", "turn of marker {} about {}")
        self.motions = [way.format(k, a) for k in range(n) for way in ways for a in AXIS_NAMES]
        self.size = 6 * n + ENERGY_SIZE + m + o
        self.harm = 0.0  # numbers that were written where none may be

    def answer(self, motion: Array, memory: Array | None = None) -> Array:
        """What the law says of a motion."""
        out = np.zeros(self.size)
        n, m, _ = self.law.sizes
        memory = self.law.memory if memory is None else memory
        out[6 * n + ENERGY_SIZE : 6 * n + ENERGY_SIZE + m] = memory
        return self._call(0, motion, memory, out)

    def tangents(self, motion: Array) -> Array:
        """(2, 6 K, 6 K) what the law says of its derivatives."""
        n = 6 * len(self.law.markers)
        return self._call(1, motion, self.law.memory, np.zeros(2 * n * n)).reshape(2, n, n)

    def _call(self, which: int, motion: Array, memory: Array, out: Array) -> Array:
        entry, mine = self.law.compiled[which], slice(GUARD_SIZE, -GUARD_SIZE)
        arrays = [np.asarray(x, dtype=float) for x in (self.law.parameters, motion, memory, out)]
        given = [np.pad(x, GUARD_SIZE, constant_values=GUARD_VALUE) for x in arrays]
        before = [x.copy() for x in given]
        if entry is not None:
            LAW_ENTRY(entry.address)(self.t, *(x[GUARD_SIZE:].ctypes.data for x in given))
        else:
            n, m, _ = self.law.sizes
            parameters, motion, memory, out = (x[mine] for x in given)
            answer = answer_of(out, n, m)
            self.law.function(self.t, parameters, motion_of(motion, n), memory, answer)
        for x, y in zip(given[:3], before[:3], strict=True):
            self.harm += float((x != y).sum())
        self.harm += float((given[3] != GUARD_VALUE).sum() - (given[3][mine] != GUARD_VALUE).sum())
        return given[3][mine].copy()


def _motions(
    mechanism: Mechanism, law: Law, samples: int, rng: np.random.Generator
) -> Iterator[Array]:
    """Motions of the markers around the start, each (18 K,)."""
    points = np.array([mechanism.design_point(m) for m in law.markers])
    axes = np.array([rotation.matrix(mechanism.part(m.body).p) for m in law.markers])
    size = max(float(np.ptp(points, axis=0).max()), 1.0)
    for _ in range(samples):
        n = len(points)
        turns = [rotation.matrix(rotation.exp(TURN_SPREAD * rng.normal(size=3))) for _ in range(n)]
        moved = points + SPREAD_SHARE * size * rng.normal(size=(n, 3))
        turned = np.array(turns) @ axes
        yield np.concatenate([moved.ravel(), turned.ravel(), rng.normal(size=6 * n)])


def _looked(asked: _Asked, motion: Array) -> list[_Finding]:
    """All checks at one motion, in the same order each time."""
    law = asked.law
    n, m, _ = law.sizes
    answer = asked.answer(motion)
    bad = ~np.isfinite(answer)
    remembered = answer[6 * n + ENERGY_SIZE : 6 * n + ENERGY_SIZE + m]
    found = [_Finding("numbers that are not finite", _first(bad, asked.fields), bad.sum(), 0.5)]
    now = np.ones(answer.size, dtype=bool)  # all but what belongs to the way since the last instant
    now[6 * n + 1], now[6 * n + ENERGY_SIZE + m :] = False, False
    every = np.ones_like(now)
    looks = (("asked again", law.memory, every), ("it finds its own memory", remembered, now))
    for what, again, which in looks:
        other = ~np.isclose(asked.answer(motion, again), answer, rtol=1e-9, equal_nan=True) & which
        text = f"answers that change when {what}"
        found.append(_Finding(text, _first(other, asked.fields), other.sum(), 0.5))
    if law.compiled[1] is not None:
        found += _slopes(asked, motion)
    if law.stores:
        found.append(_balance(asked, motion, answer))
    found.append(_Finding("numbers written where none may be", "", asked.harm, 0.5))
    return found


def _first(which: Mask, names: list[str]) -> str:
    return names[int(np.argmax(which))] if np.any(which) else ""


def _slopes(asked: _Asked, motion: Array) -> list[_Finding]:
    """Tangents of the law against central differences, the worst entry named."""
    own, found = asked.tangents(motion), []
    moved = motion_of(motion, len(asked.law.markers))
    other = differences(lambda x: asked.answer(np.concatenate([*map(np.ravel, x)])), moved)
    for k, what in enumerate(("stiffness", "damping")):
        n = own.shape[1]
        miss = np.abs(own[k] - other[k])
        scale = max(np.abs(other[k]).max(), np.abs(own[k]).max(), 1e-300)
        i, j = np.unravel_index(np.argmax(miss), miss.shape)
        n_force = 3 * (n // 6)
        field = asked.fields[(i // 3 % 2) * n_force + 3 * (i // 6) + i % 3]
        where = f"{field}, by {asked.motions[j]}: {own[k][i, j]:.6g}, not {other[k][i, j]:.6g}"
        text = f"error of the {what} / largest"
        found.append(_Finding(text, where, float(miss.max() / scale), TANGENT_RTOL))
    return found


def _balance(asked: _Asked, motion: Array, answer: Array) -> _Finding:
    """Power of the forces, rate of the stored energy and lost power, which add up to nothing."""
    n, m, _ = asked.law.sizes
    moved, answered = motion_of(motion, n), answer_of(answer, n, m)
    power = float((answered.force * moved.velocity).sum() + (answered.moment * moved.omega).sum())
    h = DIFFERENCE_STEP
    energies = [answer_of(asked.answer(_later(motion, s)), n, m).energy[0] for s in (h, -h)]
    rate, lost = (energies[0] - energies[1]) / (2 * h), float(answered.lost[0])
    unseen = ENERGY_DIGITS * max(map(abs, energies)) / h / ENERGY_RTOL
    scale = max(abs(power), abs(rate), abs(lost), unseen, 1e-300)
    where = f"power {power:.6g} W, stored {rate:.6g} W, lost {lost:.6g} W"
    share = abs(power + rate + lost) / scale
    return _Finding("power + stored + lost / largest", where, share, ENERGY_RTOL)


def _later(motion: Array, h: float) -> Array:
    """The motion a moment h later, with the same velocities."""
    n = motion.size // MOTION_SIZE
    out = motion.copy()
    moved = motion_of(out, n)
    moved.position[:] += h * moved.velocity
    for k in range(n):
        moved.axes[k] = rotation.matrix(rotation.exp(h * moved.omega[k])) @ moved.axes[k]
    return out
