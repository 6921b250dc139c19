"""Oil films of a journal bearing with all their derivatives, and a shaft in two of them."""

from collections.abc import Iterator
from math import pi
from time import perf_counter

import numpy as np

from benchmarks.models import shaft_in_films
from benchmarks.timing import Row, timed
from rom.components.journal_bearing import Groove, JournalBearing, film
from rom.mbs.integrate.simulation import simulate

N_CELLS = "120 x 8 cells"


def measured(solves: int) -> Iterator[Row]:
    """Case, quantity, value, unit and aim.

    Args:
        solves: films around the orbit, each started from the one before.
    """
    angle = np.linspace(0, 2 * pi, solves)
    orbit = 1e-5 * np.stack([6 + np.cos(angle), 1.5 * np.sin(angle)], axis=1)
    for law in ("reynolds", "jfo"):
        bearing = JournalBearing(0.1, 0.05, 1e-4, [Groove(pi, 0.35)], cavitation=law, aligned=True)
        now = film(bearing, orbit[0], speed=300.0, viscosity=0.03)
        taken, changes = np.empty(solves), 0
        for k, x in enumerate(orbit):
            start = perf_counter()
            now = film(bearing, x, speed=300.0, viscosity=0.03, warm=now.active)
            taken[k], changes = perf_counter() - start, changes + now.iterations
        case = f"{N_CELLS}, {law}"
        each = 1e3 * float(np.median(taken))
        yield case, "film and derivatives", each, "ms", "below 0.6"
        yield case, "systems solved per film", changes / solves, "", ""
        speed = _steps_per_second(law, 5 * solves)
        case = f"shaft in two films, {law}"
        yield case, "steps per second of the processor", speed, "1/s", "above 500"


def _steps_per_second(law: str, steps: int) -> float:
    """Of processor time."""
    mech, dt = shaft_in_films(law), 1e-4
    warm = simulate(mech, t_end=5e-3, dt=dt, method="bdf")
    end = 5e-3 + dt * steps
    return steps / timed(simulate, mech, t_end=end, state=warm.final, dt=dt, method="bdf")[0]
