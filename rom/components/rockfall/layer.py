"""The cushion as a layer: contact that grows with depth, load that spreads, plug beneath it.

Waves: the layer is a column that does not spread and does not fail, with the mass of its sand; its
floor gives back a share of each. This is what a cushion without mass leaves out, and it does not
act back on the boulder.

Source:
    Cones in place of half spaces: Wolf and Deeks, Foundation Vibration Analysis, a Strength of
    Materials Approach, Elsevier (2004). Load spread by 2:1 in sand: any textbook of foundations.
    Waves: d'Alembert's solution, as in Achenbach, Wave Propagation in Elastic Solids (1973), ch. 1.
"""

from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np
import numpy.typing as npt

from rom.arguments import (
    Between,
    Length,
    Positive,
    Share,
    ascending,
    between,
    typed,
    typed_record,
    vector,
)
from rom.components.rockfall import kernels
from rom.components.rockfall.laws import (
    GRAVITY,
    ROCK,
    SAND_RECOVERY,
    Density,
    Mass,
    Modulus,
    Recovery,
    Resistance,
    Shear,
    ball_radius,
)
from rom.errors import ConfigError
from rom.model import Array

MAX_PASSAGES = 10_000  # of waves in a history; more are no longer a pulse on a layer
SAND_DENSITY, CONCRETE_DENSITY = 1800.0, 2500.0  # [kg/m^3]
PUNCHING_SLOPE = 1.0  # of the cone that is punched out of the concrete, 45 degrees


@typed_record
@dataclass(frozen=True, slots=True)
class Layer(Resistance):
    """A layer of sand of finite thickness under a boulder that is round below.

    At penetration d the contact has the radius a, a^2 = 2 R d - d^2 up to R, and the sand left is
    t = thickness - d. A load that spreads by s = tan(angle) finds the stiffness of a cone::

        dF/dd = E pi a (a + s t) / t

    until the sand fails below the boulder: F is at most strength pi a^2. On a thick layer that
    does not fail F = (2/3) sqrt(2) pi s E sqrt(R) d^(3/2), Hertz for s = sqrt(2) / pi (1 - nu^2);
    on a thin one the stiffness grows without bound. Unloading as for `Cushion`.

    Attributes:
        modulus: E of loading [Pa].
        radius: R of the boulder [m].
        thickness: of the layer [m].
        angle: by which the load spreads, from the vertical [rad].
        recovery: share of the energy that comes back [1], above 0; less of it where sand that fails
            leaves no way for so much.
        density: of the sand [kg/m^3].
        strength: pressure that the contact bears [Pa], see `bearing_pressure`.

    Raises:
        ConfigError: for a number out of its range.
    """

    exponent: ClassVar[float] = 1.5  # of unloading [1]
    modulus: Modulus
    radius: Length
    thickness: Length
    angle: Annotated[float, Between(0.0, np.pi / 2, "()", "rad")] = float(np.arctan(0.5))
    recovery: Recovery = SAND_RECOVERY
    density: Density = SAND_DENSITY
    strength: Annotated[float, Positive("Pa", infinite=True)] = np.inf

    @classmethod
    @typed
    def of_sand(
        cls, boulder: Mass, lame: Modulus, thickness: float, *, rock: Density = ROCK, **more: Any
    ) -> "Layer":
        """The sand of `Cushion.of_sand`, E = 2.5 lame, in a layer.

        Args:
            boulder: mass of a ball [kg].
            lame: Lame constant of the sand [Pa].
            thickness: of the layer [m].
            rock: density of the boulder [kg/m^3].
            more: further attributes.

        Raises:
            ConfigError: if a number is not positive.
        """
        return cls(2.5 * lame, ball_radius(boulder, rock), thickness, **more)

    @property
    def limit(self) -> float:  # type: ignore[override]
        """Penetration at which the boulder is through [m]."""
        return self.thickness

    @property
    def law(self) -> tuple[float, ...]:
        """(8,) the numbers of the law, as `kernels.cushion` takes them."""
        sizes = self.modulus, self.thickness, self.radius, np.tan(self.angle), self.strength
        return (kernels.CONE_LAW, *map(float, (self.recovery, self.exponent, *sizes)))

    def contact(self, d: float) -> float:
        """Radius of the contact [m] at a penetration [m].

        Raises:
            ConfigError: for a penetration that is negative or through the layer.
        """
        between("d [m]", d, 0, self.thickness, "[)")
        x = min(d, self.radius)
        return float(np.sqrt(2 * self.radius * x - x**2))

    def spread(self, d: float) -> float:
        """Radius on the slab over which the load arrives [m], at a penetration [m].

        Raises:
            ConfigError: for a penetration that is negative or through the layer.
        """
        return self.contact(d) + float(np.tan(self.angle)) * (self.thickness - d)

    @typed
    def plug(self, d: float, slab: Length, *, concrete: Density = CONCRETE_DENSITY) -> float:
        """Mass [kg] of the sand under the boulder and of the cone of concrete below it.

        Args:
            d: penetration [m], for example of the energy of the fall.
            slab: thickness of the concrete [m].
            concrete: its density [kg/m^3].

        Raises:
            ConfigError: for a size that is not positive, or a boulder through the layer.
        """
        top, bottom = self.contact(d), self.spread(d)
        sand = _frustum(top, bottom, self.thickness - d)
        cone = _frustum(bottom, bottom + PUNCHING_SLOPE * slab, slab)
        return self.density * sand + concrete * cone

    @typed
    def shear(
        self, d: float, slab: Length, *, modulus: Modulus, strength: Modulus, **more: Any
    ) -> Shear:
        """The plug's ring of concrete in shear, from the load's edge a thickness outwards.

        A ring of radii r and r + h that only shears has 2 pi G h / log(1 + h / r); it cracks at
        the strength on the perimeter half a thickness outside the load.

        Args:
            d: penetration [m].
            slab: thickness h of the concrete [m].
            modulus: G of the concrete [Pa].
            strength: in shear [Pa].
            more: further attributes of `Shear`.

        Raises:
            ConfigError: for a number that is not positive, or a boulder through the layer.
        """
        r = self.spread(d)
        stiffness = 2 * np.pi * modulus * slab / np.log1p(PUNCHING_SLOPE * slab / r)
        capacity = strength * 2 * np.pi * (r + 0.5 * PUNCHING_SLOPE * slab) * slab
        return Shear(float(stiffness), float(capacity), **more)


@typed
def bearing_pressure(
    friction: Annotated[float, Between(0.0, np.pi / 3, "()", "rad")],
    radius: Length,
    density: Density = SAND_DENSITY,
) -> float:
    """Pressure [Pa] under which dry sand fails below a disc on its surface.

    0.6 rho g R N with N = 2 (N_q + 1) tan(phi), N_q = exp(pi tan(phi)) tan^2(pi / 4 + phi / 2),
    for slow loading; 0.6 is the factor of a round foundation.

    Args:
        friction: angle phi of the sand [rad].
        radius: R of the disc [m].
        density: rho of the sand [kg/m^3].

    Source:
        Vesic, Analysis of ultimate loads of shallow foundations, J. Soil Mech. Found. Div. ASCE
        99 (1973) 45.
    """
    slope = np.tan(friction)
    n_q = np.exp(np.pi * slope) * np.tan(np.pi / 4 + friction / 2) ** 2
    return float(0.6 * density * GRAVITY * radius * 2 * (n_q + 1) * slope)


def _frustum(top: float, bottom: float, height: float) -> float:
    """Volume of a truncated cone."""
    return np.pi * height / 3 * (top**2 + top * bottom + bottom**2)


@typed
def wave_delay(layer: Layer, d: float = 0.0) -> float:
    """Time [s] that a wave takes through the sand left at a penetration d [m].

    The speed is the root of modulus over density, with the modulus of loading.

    Raises:
        ConfigError: for a penetration that is negative or through the layer.
    """
    between("d [m]", d, 0, layer.thickness, "[)")
    return float((layer.thickness - d) * np.sqrt(layer.density / layer.modulus))


@typed
def arriving(
    t: npt.ArrayLike,
    force: npt.ArrayLike,
    delay: Annotated[float, Positive("s")],
    *,
    reflection: Share = 1.0,
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
        ConfigError: for histories that do not fit, or a delay far shorter than the history.
    """
    t = ascending("t", t)
    force = vector("force", force, t.size)
    passages = int(np.ceil((t[-1] - t[0]) / delay / 2)) + 1
    if passages > MAX_PASSAGES:
        text = f"{passages} passages of a wave of {delay:.3g} s in {t[-1] - t[0]:.3g} s"
        raise ConfigError(f"{text}; at most {MAX_PASSAGES} are followed.")
    below = np.zeros(t.size)
    for n in range(passages):
        late = np.interp(t - (2 * n + 1) * delay, t, force, left=0.0)
        below += (1 + reflection) * (-reflection) ** n * late
    return below
