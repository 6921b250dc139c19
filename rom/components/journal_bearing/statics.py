"""Where a loaded journal comes to rest, how long it stays there, and how warm its film gets.

Source:
    Friswell, Penny, Garvey and Lees, Dynamics of Rotating Machines (2010), for stability of whirl;
    the effective temperature as in Raimondi and Boyd, ASLE Trans. 1 (1958) 159.
"""

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from rom.components.journal_bearing.films.bearing import JournalBearing
from rom.components.journal_bearing.films.oil import Oil
from rom.components.journal_bearing.oil_film import Film, film
from rom.errors import ModelError, SolverError
from rom.model import Array

MAX_STEP = 0.1  # of the clearance
MIN_FILM_RATIO = 2e-3  # thinnest film, of the clearance
MAX_ITERATIONS = 200  # Newton steps
LOAD_RTOL = 1e-9  # of the load


def equilibrium(
    bearing: JournalBearing,
    load: npt.ArrayLike,
    *,
    speed: float,
    viscosity: float,
    start: npt.ArrayLike | None = None,
) -> Film:
    """The film that carries a load; the journal stays parallel to the bush.

    Newton's method with the derivatives of the film, in steps of at most 0.1 clearances. A film
    that conserves its oil may run dry on the way; then it starts where one with oil everywhere
    rests.

    Args:
        bearing: the bearing.
        load: (2,) on the journal [N].
        speed: of rotation [rad/s].
        viscosity: of the oil [Pa s].
        start: (2,) first position of the journal [m], the only one then; by default 0.3 clearances
            along the load, turned by 60 degrees in the direction of rotation.

    Raises:
        ModelError: without a load.
        SolverError: if the film cannot carry it: at this inlet position, or at all.
    """
    W, c = np.asarray(load, dtype=float), bearing.clearance
    if not float(np.hypot(*W)) > 0:
        raise ModelError(f"a load of {W} N presses the journal nowhere; it needs a size.")
    if start is not None:
        return _settled(bearing, W, np.array(start, dtype=float), speed, viscosity)
    turn = np.pi / 3 + np.arctan2(W[1], W[0])
    try:
        first = 0.3 * c * np.array([np.cos(turn), np.sin(turn)])
        return _settled(bearing, W, first, speed, viscosity)
    except SolverError:
        for oiled in bearing.oiled:
            with suppress(SolverError):
                near = equilibrium(oiled, W, speed=speed, viscosity=viscosity)
                return _settled(bearing, W, near.motion[:2], speed, viscosity)
        raise


def _settled(bearing: JournalBearing, W: Array, x: Array, speed: float, viscosity: float) -> Film:
    """Newton's method from a position x (2,) [m]."""
    c, size, warm = bearing.clearance, float(np.hypot(*W)), None
    for _ in range(MAX_ITERATIONS):
        now = film(bearing, x, speed=speed, viscosity=viscosity, warm=warm)
        missing, warm = now.force[:2] + W, now.active
        if np.hypot(*missing) <= LOAD_RTOL * size:
            return now
        K = now.stiffness[:2, :2]
        if not np.isfinite(K).all() or np.linalg.cond(K) > 1e12:
            break
        step = np.linalg.solve(K, missing)
        step *= min(1.0, MAX_STEP * c / np.hypot(*step))
        here = bearing.thinnest(x)
        while bearing.thinnest(x + step) < 0.5 * here:
            step /= 2
        x = x + step
        if bearing.thinnest(x) < MIN_FILM_RATIO * c:
            break
    where = ", ".join(f"{np.degrees(g.angle):.0f}" for g in bearing.grooves)
    there = f" with oil from grooves at {where} degrees" if bearing.grooves else ""
    cures = {"jfo": "Move the inlet out of the loaded arc, upstream of it, or lower the load."}
    hint = cures.get(bearing.cavitation, "Lower the load, or raise speed, viscosity or length.")
    thin = f"{bearing.thinnest(now.motion) * 1e6:.3g} micrometres thin"
    text = f"no film carries {size:.4g} N{there}: at {now.eccentricity:.3f} clearances, {thin}, it"
    raise SolverError(f"{text} carries {np.hypot(*now.force[:2]):.4g} N.", hint=hint)


@dataclass(frozen=True, slots=True)
class Stability:
    """How a rigid rotor on identical bearings leaves its equilibrium.

    Attributes:
        stiffness: that the whirl feels [N/m].
        whirl_ratio: frequency of the whirl at the threshold over the speed [1]; 0 if there is none.
        critical_mass: per bearing, from which on the rotor whirls [kg]; inf if it never does.
    """

    stiffness: float
    whirl_ratio: float
    critical_mass: float


def stability(stiffness: npt.ArrayLike, damping: npt.ArrayLike, speed: float) -> Stability:
    """Stability of a rigid rotor from the coefficients of its bearings, by Routh and Hurwitz.

    Stiffness [N/m] and damping [N s/m] are (2, 2) of one bearing, at a speed of rotation [rad/s].

    Raises:
        ModelError: if the damping does not damp, so that no threshold exists.
    """
    K, C = np.asarray(stiffness, dtype=float), np.asarray(damping, dtype=float)
    if not (C[0, 0] + C[1, 1] > 0 and np.linalg.det(C) > 0):
        raise ModelError(f"damping {C.tolist()} N s/m feeds the whirl; it must be damping.")
    across = K[0, 0] * C[1, 1] + K[1, 1] * C[0, 0] - K[0, 1] * C[1, 0] - K[1, 0] * C[0, 1]
    k = across / (C[0, 0] + C[1, 1])
    omega2 = ((k - K[0, 0]) * (k - K[1, 1]) - K[0, 1] * K[1, 0]) / np.linalg.det(C)
    if omega2 <= 0:
        return Stability(k, 0.0, np.inf)
    return Stability(k, float(np.sqrt(omega2)) / speed, max(k, 0.0) / omega2)


def threshold_speed(film: Film) -> float:
    """Speed times sqrt(c/g) at which a rigid rotor with the load of this film begins to whirl [1].

    The position of the journal, and with it the coefficients, are kept. inf if it never whirls.

    Raises:
        ModelError: if the film feeds the whirl.
    """
    found = stability(film.stiffness[:2, :2], film.damping[:2, :2], film.speed)
    weight = float(np.hypot(*film.force[:2]))
    return film.speed * float(np.sqrt(found.critical_mass * film.bearing.clearance / weight))


def coefficients(film: Film) -> tuple[Array, Array]:
    """Stiffness times c/W and damping times c speed/W, (2, 2) [1] each.

    X is along the load, y by 90 degrees from it.
    """
    W = -film.force[:2]
    size = np.hypot(*W)
    A = np.array([[W[0], -W[1]], [W[1], W[0]]]) / size
    each = film.bearing.clearance / size
    K, C = film.stiffness[:2, :2], film.damping[:2, :2]
    return each * A.T @ K @ A, each * film.speed * A.T @ C @ A


@dataclass(frozen=True, slots=True)
class Warm:
    """A film at the temperature it makes.

    Attributes:
        film: at rest under the load.
        temperature: that its viscosity belongs to [degrees Celsius].
        rise: of the oil from inlet to outlet [K].
        power: that is lost [W].
    """

    film: Film
    temperature: float
    rise: float
    power: float


def warm_equilibrium(
    bearing: JournalBearing,
    load: npt.ArrayLike,
    oil: Oil,
    *,
    speed: float,
    inlet: float,
    carried: float = 0.9,
    felt: float = 0.5,
) -> Warm:
    """The loaded film, its viscosity that of oil warmed by the film itself.

    Power lost warms the oil that leaves at the ends; fixed point, half of each change.

    Args:
        bearing: the bearing.
        load: (2,) on the journal [N].
        oil: in it.
        speed: [rad/s].
        inlet: temperature of the oil that comes in [degrees Celsius].
        carried: share of the heat that leaves with the oil [1].
        felt: share of the rise that the effective viscosity feels [1]; 0.5 is the mean of inlet and
            outlet, as Raimondi and Boyd take it.

    Raises:
        SolverError: if no film carries the load, or the temperature does not settle.
        ModelError: without a load.
    """
    T, start = inlet, None
    for _ in range(60):
        mu = float(oil.viscosity(T))
        now = equilibrium(bearing, load, speed=speed, viscosity=mu, start=start)
        power, start = now.dissipated, now.motion[:2]
        rise = carried * power / (oil.density * oil.heat * now.side_flow)
        change = inlet + felt * rise - T
        if abs(change) < 1e-6:
            return Warm(now, T, rise, power)
        T += 0.5 * change
    text = f"the temperature of the film, {T:.1f} degrees Celsius, still changes by {change:.2g} K."
    raise SolverError(text, hint="Check the flow of oil: little flow, great heat.")


def warm_bearing(
    bearing: JournalBearing,
    *,
    bush: float,
    shaft: float,
    expansion: tuple[float, float] = (11.7e-6, 11.7e-6),
    free: float = 1.0,
) -> JournalBearing:
    """The bearing with the clearance it has when bush and shaft are warm.

    Bush and shaft are so much warmer [K] and expand with these coefficients [1/K], the bush by the
    share [1] of its expansion for which its fit leaves it free.

    Raises:
        ModelError: if no clearance is left.
    """
    growth = bearing.radius * (expansion[0] * bush * free - expansion[1] * shaft)
    if bearing.clearance + growth <= 0:
        text = f"the shaft seizes: {shaft} K on the shaft and {bush} K on the bush change the"
        change = f"clearance of {bearing.clearance * 1e6:.3g} micrometres by {growth * 1e6:.3g}"
        raise ModelError(f"{text} {change}; warm the bush too, or fit with more clearance.")
    return replace(bearing, clearance=bearing.clearance + growth)
