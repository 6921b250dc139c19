"""One extended system of which Newton's bodies and the mechanics of shapes are two gauges.

A scale phi and its momentum pi stand beside positions x and momenta p. Newton's are e^phi x and
e^-phi p, and two constraints, V of degree k, vanish on every motion without energy and momenta::

    H = e^(-2 phi) T(p) + e^(k phi) V(x),    Q = pi - D,   D = sum x . p

Their bracket is zero: Q moves along x -> e^-s x, p -> e^s p, phi -> phi + s, which H does not see.
So the motion that N H + l Q makes is the same, in Newton's variables, for every choice of the
multipliers N (of time) and l (of size)::

    x' = N e^(-2 phi) p / m - l x,        phi' = l
    p' = -N e^(k phi) dV/dx + l p,        pi'  = N (2 e^(-2 phi) T - k e^(k phi) V)

`newton_gauge` keeps phi = 0, with N = 1: Newton's equations. `shape_gauge` takes pi for the clock,
pi' = 1, and keeps the size of x: H = 0 then gives phi, which is the Hamiltonian of
`Linking.move_shapes`. No field of gravity is computed here, nor anything of general relativity.

Source:
    After Mercati's chapter on shape dynamics, for bodies in place of fields; derived here.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rom.components.best_matching.bodies import Bodies, integrated
from rom.components.best_matching.projection import configuration
from rom.errors import ConfigError, ModelError
from rom.model import Array

MOMENTUM_RTOL = 1e-9  # of the scale of energy or momenta: beyond it a motion is not relational
SIZE_RTOL = 1e-9  # of a size that should be one


@dataclass(frozen=True, slots=True)
class Extended:
    """A point of the extended phase space, or k of them along a motion; no unit but ratios: [1].

    Attributes:
        x: (n, 3) or (k, n, 3) positions about the mass centre [1].
        p: (n, 3) or (k, n, 3) momenta [1].
        phi: () or (k,) logarithm of the scale [1].
        pi: () or (k,) its momentum [1].
        time: () or (k,) Newton's time, the sum of N [1].
    """

    x: Array
    p: Array
    phi: Array | float
    pi: Array | float
    time: Array | float = 0.0

    def scaled(self, phi: Array | float) -> "Extended":
        """The same motion with another logarithm of the scale () or (k,) [1], along what Q makes.

        With zero, x and p are Newton's.
        """
        s = np.exp(np.asarray(phi - self.phi))[..., None, None]
        return Extended(self.x / s, self.p * s, phi + 0 * np.asarray(self.phi), self.pi, self.time)


Gauge = Callable[["Linking", Extended], tuple[float, float]]  # multipliers N and l of a state


def newton_gauge(linking: "Linking", state: Extended) -> tuple[float, float]:
    """N = 1 and l = 0 [1], which keep phi and count Newton's time."""
    return 1.0, 0.0


def shape_gauge(linking: "Linking", state: Extended) -> tuple[float, float]:
    """N and l [1] of pi' = 1 and constant sum m x^2: pi is the clock, and x has no size."""
    N = 1 / linking.rate_of_pi(state)
    size = linking.bodies.size(state.x)
    return N, N * float(np.exp(-2 * state.phi)) * float((state.x * state.p).sum()) / size


@dataclass(frozen=True, slots=True)
class Linking:
    """The extended system of N bodies.

    Attributes:
        bodies: masses and the degree of their potential.

    Raises:
        ConfigError: for degree -2, where D is conserved and cannot be a clock.
    """

    bodies: Bodies

    def __post_init__(self) -> None:
        if not self.bodies.degree > -2.0:
            text = f"degree = {self.bodies.degree:g} must be above -2"
            raise ConfigError(f"{text}: below it growth does not count time.")

    def state(self, x: Array, v: Array) -> Extended:
        """Newton's configuration (n, 3) [1] and velocities (n, 3) [1], with phi = 0 and Q = 0.

        Raises:
            ConfigError, ModelError: as `Bodies.potential`; if energy, momentum or angular momentum
                are not zero, so that frame, size or clock would have a meaning.
        """
        bodies = self.bodies
        x, v = bodies.centred(x), configuration(v)
        T, V = bodies.kinetic(v), bodies.potential(x)
        p = bodies.mass[:, None] * v
        span, motion = np.sqrt(bodies.size(x)), np.sqrt(2 * T * bodies.mass.sum())
        whole = {
            "energy": abs(T + V) / max(T, -V),
            "momentum": np.abs(p.sum(axis=0)).max() / max(motion, 1e-300),
            "angular momentum": np.abs(np.cross(x, p).sum(axis=0)).max()
            / max(span * np.sqrt(2 * T), 1e-300),
        }
        if wrong := {name: float(x) for name, x in whole.items() if not x < MOMENTUM_RTOL}:
            text = f"not zero, relative to their scale: {wrong}."
            raise ModelError(text, hint="`Bodies.at_rest_as_a_whole` takes them out.")
        return Extended(x, p, 0.0, float((x * p).sum()))

    def energy_constraint(self, state: Extended) -> float:
        """H of a point of the phase space, zero on motions [1]."""
        T, V = self._parts(state)
        return T + V

    def size_constraint(self, state: Extended) -> float:
        """Q of a point of the phase space, zero on motions [1]."""
        return float(state.pi - (state.x * state.p).sum())

    def rate_of_pi(self, state: Extended) -> float:
        """-dH/dphi at a point of the phase space [1], positive where H = 0."""
        T, V = self._parts(state)
        return 2 * T - self.bodies.degree * V

    def move(self, state: Extended, gauge: Gauge, parameter: Array) -> Extended:
        """The motion along a parameter, in a gauge.

        Args:
            state: start, at the first value of the parameter.
            gauge: function of this system and a state that returns N and l; `newton_gauge`,
                `shape_gauge` or any other.
            parameter: (k,) values; Newton's time or pi in those two [1].

        Returns:
            k states; `Extended.scaled` with zero has Newton's positions and momenta.

        Raises:
            SolverError: if two bodies come too close.
        """
        y = np.concatenate([state.x.ravel(), state.p.ravel(), [state.phi, state.pi, state.time]])
        Y = integrated(lambda _, y: self._rates(y, gauge), y, parameter)
        n = 3 * self.bodies.mass.size
        x, p = Y[:, :n].reshape(len(Y), -1, 3), Y[:, n : 2 * n].reshape(len(Y), -1, 3)
        return Extended(x, p, *Y[:, 2 * n :].T)

    def move_shapes(self, x: Array, p: Array, D: Array) -> tuple[Array, Array]:
        """(k, n, 3) shapes, momenta [1] of size one over D, by a Hamiltonian that knows no scale.

        With K = sum p^2 / m, on sum m x^2 = 1 and sum x . p = 0::

            h = ln((D^2 + K) / (-2 V)) / (2 + k),   x' = dh/dp,   p' = -dh/dx, on the sphere

        D (k,) are values of the clock [1]; at D[0] x (n, 3) is a configuration of size one [1], p
        (n, 3) its momenta without that of growth [1].

        Raises:
            ConfigError, ModelError: as `Bodies.potential`; if size or growth are not one and zero.
            SolverError: if two bodies come too close.
        """
        x, p = self.bodies.centred(x), configuration(p)
        self.bodies.potential(x)
        growth = abs((x * p).sum()) / max(1.0, float(np.abs(p).max()))
        if max(abs(self.bodies.size(x) - 1), growth) > SIZE_RTOL:
            raise ModelError("shapes must have the size sum m x^2 = 1 and no growth sum x . p.")
        y = np.concatenate([x.ravel(), p.ravel()])
        Y = integrated(self._shape_rates, y, D).reshape(len(D), 2, -1, 3)
        return Y[:, 0], Y[:, 1]

    def shapes(self, state: Extended) -> tuple[Array, Array]:
        """(..., n, 3) configurations of size one, momenta without growth [1], in any gauge."""
        m = self.bodies.mass[:, None]
        R = np.sqrt((m * state.x**2).sum(axis=(-2, -1)))[..., None, None]
        D = (state.x * state.p).sum(axis=(-2, -1))[..., None, None]
        x = state.x / R
        return x, state.p * R - D * m * x

    def scale(self, x: Array, p: Array, D: float) -> float:
        """Logarithm of the scale of a shape: that of Newton's size, from H = 0.

        It is ln((D^2 + K) / (-2 V)) / (2 + k) [1], which is also the Hamiltonian, of a
        configuration x (n, 3) of size one [1], its momenta p (n, 3) [1] and the clock D [1].
        """
        K = float((p**2 / self.bodies.mass[:, None]).sum())
        ratio = (D**2 + K) / (-2 * self.bodies.potential(x))
        return float(np.log(ratio) / (2 + self.bodies.degree))

    def _parts(self, state: Extended) -> tuple[float, float]:
        """Newton's kinetic and potential energy."""
        T = 0.5 * float((state.p**2 / self.bodies.mass[:, None]).sum())
        V = self.bodies.potential(state.x)
        smaller, deeper = np.exp(-2 * state.phi), np.exp(self.bodies.degree * state.phi)
        return float(smaller * T), float(deeper * V)

    def _rates(self, y: Array, gauge: Gauge) -> Array:
        n, m = 3 * self.bodies.mass.size, self.bodies.mass[:, None]
        x, p, phi = y[:n].reshape(-1, 3), y[n : 2 * n].reshape(-1, 3), float(y[2 * n])
        state = Extended(x, p, phi, float(y[2 * n + 1]))
        N, growth = gauge(self, state)
        force = m * self.bodies.acceleration(x)
        dx = N * np.exp(-2 * phi) * p / m - growth * x
        dp = N * np.exp(self.bodies.degree * phi) * force + growth * p
        return np.concatenate([dx.ravel(), dp.ravel(), [growth, N * self.rate_of_pi(state), N]])

    def _shape_rates(self, D: float, y: Array) -> Array:
        m, k = self.bodies.mass[:, None], self.bodies.degree
        x, p = y.reshape(2, -1, 3)
        K = float((p**2 / m).sum())
        dx = 2 * p / m / (D * D + K) / (2 + k)
        force = -m * self.bodies.acceleration(x) / self.bodies.potential(x)  # dV/dx / V
        dp = (force - k * m * x) / (2 + k) - (dx * p).sum() * m * x
        return np.concatenate([dx.ravel(), dp.ravel()])
