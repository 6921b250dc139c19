"""Waves in the sand: which force arrives below a layer after one on top of it.

The layer is a column that does not spread and does not fail, with the mass of its sand; its floor
gives back a share of each wave. Statics, spread and loss of energy are those of `layer`: this is
what a cushion without mass leaves out, and it does not act back on the boulder.

Source:
    d'Alembert's solution, as in Achenbach, Wave Propagation in Elastic Solids (1973), chapter 1.
"""

import numpy as np
import numpy.typing as npt

from rom.arguments import between, positive, typed, vector
from rom.components.rockfall.layer import Layer
from rom.errors import ConfigError
from rom.model import Array

MAX_PASSAGES = 10_000  # of waves in a history; more are no longer a pulse on a layer


@typed
def wave_delay(layer: Layer, d: float = 0.0) -> float:
    """Time [s] that a wave takes through the sand left at a penetration.

    The speed is the root of modulus over density, with the modulus of loading.

    Args:
        layer: the sand.
        d: penetration [m].

    Raises:
        ConfigError: for a penetration that is negative or through the layer.
    """
    between("d [m]", d, 0, layer.thickness, "[)")
    return float((layer.thickness - d) * np.sqrt(layer.density / layer.modulus))


@typed
def arriving(
    t: npt.ArrayLike, force: npt.ArrayLike, delay: float, *, reflection: float = 1.0
) -> Array:
    """(n,) force on the floor of a column of sand on which a given force acts [N].

    A wave runs down in the delay; the floor gives back the share r of it, and the top, where the
    force is given, all of it with the other sign::

        F_below(t) = (1 + r) sum_n (-r)^n F(t - (2 n + 1) delay)

    A force that grows slowly arrives as it is, a short one (1 + r) times. The column has no damping
    and pulls as well, which sand cannot: what comes after the first pull counts no more.

    Args:
        t: (n,) instants from the first contact on [s].
        force: (n,) on top at these instants, straight between, none before [N].
        delay: time of a wave from top to floor [s], see `wave_delay`.
        reflection: r, 1 for a floor that does not give way, 0 for one like the sand [1].

    Raises:
        ConfigError: for histories that do not fit, a delay that is not positive or far shorter than
            the history, or a share that is none.
    """
    t, force = vector("t", t), vector("force", force)
    if t.shape != force.shape or t.size < 2 or not (np.diff(t) > 0).all():
        raise ConfigError(f"{t.size} instants with {force.size} forces: needed are instants that "
                          "grow, and a force at each.")  # fmt: skip
    between("reflection", reflection, 0, 1)
    passages = int(np.ceil((t[-1] - t[0]) / positive("delay [s]", delay) / 2)) + 1
    if passages > MAX_PASSAGES:
        raise ConfigError(f"{passages} passages of a wave of {delay:.3g} s in {t[-1] - t[0]:.3g} s;"
                          f" at most {MAX_PASSAGES} are followed.")  # fmt: skip
    below = np.zeros(t.size)
    for n in range(passages):
        late = np.interp(t - (2 * n + 1) * delay, t, force, left=0.0)
        below += (1 + reflection) * (-reflection) ** n * late
    return below
