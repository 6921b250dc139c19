"""A cantilever that bends as far as it likes, in closed form: thin, inextensible, pushed across.

With P L^2 / EI = load and the slope a of the tip, k^2 = (1 + sin a) / 2 and sin b = 1 / (k sqrt 2):
sqrt(load) = K(k) - F(b, k); z / L = 1 - 2 (E(k) - E(b, k)) / sqrt(load) across and
x / L = sqrt(2 sin a / load) along.
Bisshopp, Drucker, Large deflection of cantilever beams, Quart. Appl. Math. 3 (1945) 272.
"""

import numpy as np
from scipy.optimize import brentq
from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc


def load_at(slope):
    """P L^2 / EI at a slope of the tip [rad]."""
    m = (1 + np.sin(slope)) / 2
    return (ellipk(m) - ellipkinc(np.arcsin(np.sqrt(0.5 / m)), m)) ** 2


def elastica(load):
    """Slope of the tip [rad], and its place along and across over the length, under P L^2 / EI."""
    slope = brentq(lambda a: load_at(a) - load, 1e-9, np.pi / 2 - 1e-12, xtol=1e-15)
    m = (1 + np.sin(slope)) / 2
    bent = ellipe(m) - ellipeinc(np.arcsin(np.sqrt(0.5 / m)), m)
    return slope, np.sqrt(2 * np.sin(slope) / load), 1 - 2 * bent / np.sqrt(load)
