"""A controller in Python that sees each step, beside a run that asks no Python; processor time."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import cos, sin
from statistics import median
from typing import Any
from warnings import catch_warnings, simplefilter

import numpy as np

from benchmarks.models import KINDS, bar, slider_crank
from benchmarks.timing import Row, timed
from rom.errors import RomWarning
from rom.mbs.control.stepper import Stepper
from rom.mbs.integrate.simulation import simulate
from rom.mbs.mechanism import Mechanism
from rom.reduction.bases.method import CraigBampton
from rom.workflow import reduce

GAIN, DAMPING, RESET, LIMIT = 40.0, 1.5, 100.0, 25.0  # N m/rad, N m s/rad, N m/(rad s), N m


class Controller:
    """Ten lines: follow an angle that swings, with bounds and what it has missed so far."""

    def __init__(self, dt: float):
        self.dt, self.t, self.total = dt, 0.0, 0.0

    def __call__(self, angle: float, rate: float) -> float:
        """Torque [N m] of the next step."""
        self.t += self.dt
        wanted = 0.3 * sin(20.0 * self.t)
        speed = 6.0 * cos(20.0 * self.t)
        miss = wanted - angle
        self.total += miss * self.dt
        torque = GAIN * miss + DAMPING * (speed - rate) + RESET * self.total
        if abs(torque) > LIMIT:
            self.total -= miss * self.dt
            torque = LIMIT if torque > 0.0 else -LIMIT
        return torque


def crank(rod: Any = None) -> Any:
    """The slider-crank, from rest, with a motor at its crank."""
    mech = slider_crank(rod)
    mech.drives.clear()
    for name, part in mech.parts.items():
        mech.parts[name] = replace(part, velocity=0 * part.velocity, omega=0 * part.omega)
    return mech


def pendulum(link: Any) -> Any:
    """One flexible link on a hinge, released level."""
    mech = Mechanism(gravity=(0, -9.81, 0))
    one = mech.add_flexible("a", link, at=-link.marker("root").point)
    mech.revolute("main", mech.ground.marker((0.0, 0.0, 0.0)), one.marker("root"), axis=(0, 0, 1))
    return mech


def two_links(link: Any) -> Any:
    """Two flexible links in a row, a coil between them, with a load of 0.2 kg at the end."""
    mech, z, root = Mechanism(gravity=(0, 0, 0)), (0, 0, 1), link.marker("root").point
    places = {"a": np.zeros(3), "b": np.array([0.25, 0, 0])}
    one, two = (mech.add_flexible(name, link, at=x - root) for name, x in places.items())
    mech.revolute("main", mech.ground.marker((0.0, 0.0, 0.0)), one.marker("root"), axis=z)
    mech.revolute("elbow", one.marker("tip"), two.marker("root"), axis=z)
    mech.rotational_spring("coil", "elbow", stiffness=50.0, damping=0.1)
    load = mech.add_rigid("load", mass=0.2, inertia=(1e-4,) * 3, at=(0.5, 0, 0))
    mech.fixed("grip", two.marker("tip"), load.marker((0, 0, 0)))
    return mech


def measured(steps: int = 4000, rounds: int = 5, pieces: int = 100) -> Iterator[Row]:
    """Case, quantity, value, unit and aim; ratios are medians of rounds that take turns.

    Args:
        steps: of the stepper and of the run.
        rounds: how often each is measured.
        pieces: steps of a loop of runs of one step.
    """
    rod = _reduced((0.16, 0.02, 0.012), 20)
    link = _reduced((0.25, 0.02, 0.012), 8)
    cases: dict[str, tuple[Callable[[], Any], float]] = {
        "flexible pendulum": (lambda: pendulum(link), 1e-4),
        "rigid slider-crank": (crank, 1e-4),
        "slider-crank with a flexible rod": (lambda: crank(rod), 1e-4),
        "arm of two flexible links": (lambda: two_links(link), 1e-4),
    }
    for case, (build, dt) in cases.items():
        seen: list[tuple[float, float, float, float]] = []
        for turn in range(rounds + 1):
            found = (*_stepped(build, dt, steps), _run(build, dt, steps), _loop(build, dt, pieces))
            seen += [found] if turn else []  # the first round compiles
        decided, held, run, loop = (median(column) for column in zip(*seen, strict=True))
        yield case, "steps per second, controller in Python", decided, "1/s", "above 20000"
        yield case, "steps per second, input held", held, "1/s", ""
        yield case, "steps per second, one run", run, "1/s", ""
        yield case, "steps per second, runs of one step", loop, "1/s", ""
        for over, k, aim in (("one run", 2, ""), ("runs of one step", 3, "above 10")):
            ratio = median(row[0] / row[k] for row in seen)
            yield case, f"controller in Python over {over}", ratio, "", aim
        ratio = median(row[1] / row[2] for row in seen)
        yield case, "input held over one run", ratio, "", "above 0.5"


def _reduced(size: tuple[float, float, float], modes: int) -> Any:
    return reduce(
        bar(size, (16, 2, 1)), method=CraigBampton(modes), interfaces=dict(KINDS),
        reference=tuple(KINDS), certify=False,
    )  # fmt: skip


def _stepped(build: Callable[[], Any], dt: float, steps: int) -> tuple[float, float]:
    """Steps per second of a stepper under the controller, and under a constant torque."""
    mech = build()
    mech.motor("servo", "main", lambda t, angle, rate: 0.0)
    stepper = Stepper(mech, dt=dt, inputs=["servo"], outputs=["main"])

    def decide(controller: Callable[[float, float], float]) -> None:
        angle, rate = stepper.reset()
        for _ in range(steps):
            angle, rate = stepper.step((controller(angle, rate),))

    decide(lambda angle, rate: 1.0)
    decided, _ = timed(decide, Controller(dt))
    held, _ = timed(decide, lambda angle, rate: 1.0)
    return steps / decided, steps / held


def _run(build: Callable[[], Any], dt: float, steps: int) -> float:
    mech = build()
    mech.motor("servo", "main", lambda t, angle, rate: 1.0)
    taken, _ = timed(simulate, mech, t_end=steps * dt, dt=dt)
    return steps / taken


def _loop(build: Callable[[], Any], dt: float, steps: int) -> float:
    """The same controller between runs of one step, each of which goes on from the last."""
    mech, told = build(), [0.0]
    mech.motor("servo", "main", lambda t, angle, rate: told[0], compiled=False)
    mech.rotational_spring("follow", "main", stiffness=0.0)
    control = Controller(dt)
    state = simulate(mech, t_end=dt, dt=dt).final

    def decide(state: Any) -> None:
        angle = before = 0.0
        for k in range(1, steps + 1):
            told[0] = control(angle, (angle - before) / dt)
            state = simulate(mech, t_end=(k + 1) * dt, dt=dt, state=state).final
            angle, before = float(state.base[0]), angle

    with catch_warnings():  # each run of one step looks at its own energy
        simplefilter("ignore", RomWarning)
        taken, _ = timed(decide, state)
    return steps / taken
