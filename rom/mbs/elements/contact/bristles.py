"""Friction of contacts that truly holds: springs along the surfaces, which slip at Coulomb's limit.

A spring runs from a point of body i to a point of body j. Both are where the bodies touched at the
last accepted instant, less what the spring is stretched; seen from there the bodies slide by the
way of their points, whatever the step. What lies along the normal is dropped.

Source:
    Jenkins, J. Appl. Mech. 29 (1962) 327 (spring and slider); Cundall, Strack, Geotechnique 29
    (1979) 47 (in contacts that move); stiffness: Mindlin, J. Appl. Mech. 16 (1949) 259.
"""

import numpy as np

from rom.mbs.kernels.algebra import add, dot, mtv, put, scale, sub, turn, vec
from rom.mbs.kernels.compiled import inner

# what a contact remembers: whether it touched, ends of its spring in the axes of i and j [m],
# energy in the spring [J]
HELD, ON_I, ON_J, STORED = 0, 1, 4, 7
N_REMEMBERED = 8
STICK_RTOL = 1e-9  # what slid to the limit sticks there when it is looked at again


@inner
def shortened(x, limit):
    """The vector x, or one of length ``limit`` in its direction if it is longer."""
    size = np.sqrt(dot(x, x))
    if size.real > (1.0 + STICK_RTOL) * limit.real:
        return scale(limit / size, x)
    return x


@inner
def spring_and_slider(bristle, limit, stretch, slide):
    """Friction on j, and the stretch that remains; ``bristle`` is stiffness and damping."""
    stretch = shortened(stretch, limit / bristle[0])
    load = add(scale(bristle[0], stretch), scale(bristle[1], slide))
    return scale(-1.0, shortened(load, limit)), stretch


@inner
def ends_of_spring(W, at, i, j):
    """One if bodies touched at the last instant, else zero; ends from their markers, world."""
    on_i, on_j = turn(W.E, i, vec(W.base, at + ON_I)), turn(W.E, j, vec(W.base, at + ON_J))
    return W.base[at + HELD], on_i, on_j


@inner
def keep_spring(W, at, markers, touching, stretch, stiffness):
    """Remember a spring; ``touching`` is the vector from each marker to the touching point."""
    i, j = markers
    W.fresh[at + HELD] = 1.0
    for p in range(3):
        W.fresh[at + ON_I + p] = W.fresh[at + ON_J + p] = 0.0
    put(W.fresh, at + ON_I, mtv(W.E[i], sub(touching[0], stretch)))
    put(W.fresh, at + ON_J, mtv(W.E[j], touching[1]))
    W.fresh[at + STORED] = 0.5 * stiffness * dot(stretch, stretch)


@inner
def forget_spring(W, at):
    """The bodies are apart."""
    W.fresh[at + HELD] = W.fresh[at + STORED] = 0.0
