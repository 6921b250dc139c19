"""Forces along joint coordinates: motors, friction and stops."""

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numba

from rom.arguments import number, positive, typed
from rom.errors import ConfigError
from rom.mbs.elements.impact import Impact, checked_law
from rom.mbs.parts.joints import Joint, Row
from rom.plausible import FRICTION, warn_outside


@dataclass(frozen=True, slots=True)
class Motor:
    """Force along a joint coordinate from a law (t, coordinate, rate)."""

    joint: str
    row: Row
    law: Callable[[float, float, float], float]
    compiled: Any

    @property
    def address(self) -> int:
        """Of the compiled law; 0 when it is left to Python."""
        return self.compiled.address if self.compiled is not None else 0


@dataclass(frozen=True, slots=True)
class Friction:
    """Dry and viscous friction along a joint coordinate; numbers as in `rom.mbs.kernels.system`."""

    joint: str
    row: Row
    numbers: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Stop:
    """Limits of a joint coordinate: (side +1 or -1, place), and their law."""

    joint: str
    row: Row
    limits: tuple[tuple[int, float], ...]
    law: Impact


@typed
class JointForces:
    """The forces of a `rom.mbs.mechanism.Mechanism` along joint coordinates."""

    joints: dict[str, Joint]
    motors: dict[str, Motor]
    frictions: dict[str, Friction]
    stops: dict[str, Stop]
    _check_new: Callable[[str], None]
    _coordinate: Callable[..., Row]

    def motor(
        self,
        name: str,
        joint: str,
        law: Callable[[float, float, float], float],
        *,
        coordinate: str | None = None,
        compiled: bool | None = None,
    ) -> None:
        """Motor with a control law: force [N] or torque [N m] = ``law(t, coordinate, rate)``.

        It acts along the joint coordinate on the second body and back on the first. The law is
        compiled by Numba when it can be; a compiled law sees outer variables as they were when
        the motor was added. What cannot be compiled runs as plain Python, some ten times slower.

        Args:
            name: name of the motor.
            joint: joint with a coordinate.
            law: function of time [s], coordinate [rad or m] and its rate, or one of Numba.
            coordinate: "angle" or "displacement"; None for the only or the first one.
            compiled: True to insist, False to leave it to Python, None for what works.

        Raises:
            ConfigError: if the joint has no such coordinate, or the law is no function of three
                numbers, or cannot be compiled although it must.
        """
        self._check_new(name)
        row = self._coordinate(joint, coordinate, "motor")
        self.motors[name] = Motor(joint, row, law, _compiled(name, law, compiled))

    def friction(  # noqa: PLR0913  one keyword per property
        self,
        name: str,
        joint: str,
        *,
        transition_speed: float,
        coulomb: float = 0.0,
        mu: float = 0.0,
        radius: float | None = None,
        static: float = 1.0,
        stribeck_speed: float | None = None,
        viscous: float = 0.0,
        coordinate: str | None = None,
    ) -> None:
        """Friction along a joint coordinate x: - level s(x') - viscous x'.

        s(v) = tanh(v / transition_speed) (1 + (static - 1) exp(-(v / stribeck_speed)^2)), and
        level = coulomb + mu radius |F| with the resultant force F that the joint transmits. What
        sticks creeps with less than the transition speed.

        Args:
            name: name of the friction.
            joint: joint with a coordinate.
            transition_speed: speed over which the sign changes [m/s or rad/s]; implicit steps that
                change the speed by much more do not converge.
            coulomb: level that is always there [N or N m].
            mu: coefficient of friction.
            radius: at which friction acts on an angle, that of the pin [m]; none for a
                displacement.
            static: level at rest over that of fast motion, at least 1.
            stribeck_speed: speed over which this fades [m/s or rad/s].
            viscous: [N s/m or N m s/rad].
            coordinate: "angle" or "displacement"; None for the only or the first one.

        Raises:
            ConfigError: for a joint without such a coordinate, or numbers no friction has.
        """
        self._check_new(name)
        row = self._coordinate(joint, coordinate, "friction")
        for what, value in (("coulomb", coulomb), ("mu", mu), ("viscous", viscous)):
            if number(what, value) < 0.0:
                raise ConfigError(f"{what} of friction {name!r} is {value:g}: it must not drive.")
        warn_outside(FRICTION, mu, repr(name))
        turns = row is self.joints[joint].turn
        if mu and turns and radius is None:
            raise ConfigError(f"friction {name!r} with mu on an angle needs the radius of the pin.")
        if radius is not None and not turns:
            raise ConfigError(f"friction {name!r} acts along a displacement: it has no radius.")
        if number("static", static) < 1.0 or (static > 1.0 and stribeck_speed is None):
            raise ConfigError(
                f"static = {static:g} of friction {name!r} must be at least 1, and above 1 it "
                "needs stribeck_speed."
            )
        arm = positive("radius", radius) if radius is not None else 1.0
        fade = positive("stribeck_speed", stribeck_speed) if stribeck_speed is not None else 1.0
        speed = positive("transition_speed", transition_speed)
        numbers = (coulomb, mu * arm, static - 1.0, fade, viscous, speed)
        self.frictions[name] = Friction(joint, row, tuple(float(x) for x in numbers))

    def stop(
        self,
        name: str,
        joint: str,
        law: Impact,
        *,
        lower: float | None = None,
        upper: float | None = None,
        coordinate: str | None = None,
    ) -> None:
        """Limit a joint coordinate by compliant stops.

        Args:
            name: name of the stops.
            joint: joint with a coordinate.
            law: `rom.mbs.Impact`, its friction without effect.
            lower: smallest coordinate without force [rad or m]; None for no limit.
            upper: largest one.
            coordinate: "angle" or "displacement"; None for the only or the first one.

        Raises:
            ConfigError: for a joint without such a coordinate, or limits that leave no room.
        """
        self._check_new(name)
        row = self._coordinate(joint, coordinate, "stop")
        law = checked_law(name, law)
        places = [(-1, lower), (1, upper)]
        limits = [(side, number(f"limit of {name}", x)) for side, x in places if x is not None]
        if not limits:
            raise ConfigError(f"stop {name!r} has no limit.", hint="Give lower or upper.")
        if len(limits) == 2 and limits[0][1] > limits[1][1]:
            raise ConfigError(
                f"stop {name!r}: the lower limit {lower:g} is above the upper {upper:g}."
            )
        self.stops[name] = Stop(joint, row, tuple(limits), law)


def _compiled(name: str, law: Any, wanted: bool | None) -> Any:
    """The law as a C function of three doubles, None when it is left to Python."""
    if wanted is False:
        return None
    python = getattr(law, "py_func", law)
    try:
        if not inspect.isfunction(python):
            raise TypeError("not a plain function")
        return numba.cfunc("float64(float64, float64, float64)")(python)
    except Exception as error:  # Numba raises errors of many kinds for what it cannot compile
        if not wanted:
            return None
        raise ConfigError(
            f"law of motor {name!r} cannot be compiled: {str(error).splitlines()[0]}",
            hint="Use numbers and NumPy functions of numbers only, or compiled=False.",
        ) from error
