"""What workers of studies measure; they import nothing else."""

from functools import cache
from time import sleep
from typing import Any

from benchmarks.peers.mechanisms import built, slider_crank
from rom.io.native import load
from rom.mbs.integrate.simulation import simulate

RADIUS = 0.04  # of a crank [m]
T_END, STEPS = 0.25, 1000
SHORT = 1e-3  # of a sample that does nothing else [s]


@cache
def body_of(file: str) -> Any:
    """The rod, read once in each process."""
    return load(file)


def crank(speed: float, file: str) -> dict[str, Any]:
    """How far the slider of a crank goes that starts at a speed [rad/s]."""
    body = body_of(file)
    mechanism = built(slider_crank(body, RADIUS, speed), body)
    motion = simulate(mechanism, t_end=T_END, dt=T_END / STEPS, save_every=STEPS // 50)
    return {"least": motion.position("slider", "o")[:, 0].min()}


def short(x: float) -> dict[str, Any]:
    """A sample of a millisecond."""
    sleep(SHORT)
    return {"y": x}
