"""Measures for studies, where other processes can import them."""

import os
import signal
import time
import warnings
from pathlib import Path

import numpy as np

import rom

PENDULUM = """\
gravity = [0, 0, -9.81]
[bodies.bob]
mass = "1 kg"
inertia = [1e-9, 1e-9, 1e-9]
at = [0.3, 0, 0]
markers.top = [-0.3, 0, 0]
[joints]
pivot = { kind = "revolute", between = [{ ground = [0, 0, 0] }, "bob.top"], axis = [0, 1, 0] }
[simulation]
t_end = "0.4 s"
dt = "2 ms"
"""


def ishigami(x1, x2, x3):
    return {"y": np.sin(x1) + 7 * np.sin(x2) ** 2 + 0.1 * x3**4 * np.sin(x1)}


def histories(x):
    """Some bits of everything: a number, an array, samples that fail or warn."""
    if x > 0.95:
        raise ValueError("too large")
    if x < 0.1:
        rom.errors.warn("too small")
    t = np.linspace(0, 1, 5)
    return {"root": np.sqrt(x), "t": t, "wave": np.sin(x * t) / 3}


def told(x, log, seconds=0.0):
    """The same, with a line for each call; it may take a while."""
    with Path(log).open("a") as file:
        file.write(f"{x!r}\n")
    time.sleep(seconds)
    return histories(x)


def fails(x):
    """Each x in a way of its own."""
    match int(x):
        case 1:
            os.kill(os.getpid(), signal.SIGKILL)
        case 2:
            time.sleep(60)
        case 3:
            np.ones(2**33)
        case 4:
            return {"y": 1.0, "z": 2.0}
        case 5:
            return {"y": np.ones(3)}
        case 6:
            return {"y": np.nan}
        case 7:
            return 3.0
        case 8:
            raise rom.ModelError("no equilibrium")
        case 9:
            warnings.warn("none of ours", stacklevel=1)
    return {"y": x}


def nothing(x):
    return {"y": x}


class Worse:
    """What can be sent, but not received."""

    def __call__(self, x):
        return {"y": x}

    def __reduce__(self):
        return (int, ("no number",))
