"""Involute spur and helical gear pairs: base circles, path of contact, lengths of contact lines.

The pinion drives and turns about +Z, the gear lies in the direction of +X. Distances s along the
path of contact count from the pinion's point of tangency T1 on the base plane.

An internal gear has a negative number of teeth, and with it negative radii and a negative centre
distance, as in ISO 21771: then all formulas are those of external gears.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
import numpy.typing as npt
from scipy.optimize import brentq

from rom.arguments import Angle, Number, Size, typed
from rom.errors import ModelError
from rom.model import Array


def involute(angle: npt.ArrayLike) -> Array:
    """Tan a - a of a pressure angle [rad]."""
    return np.tan(angle) - np.asarray(angle, dtype=float)


@typed
@dataclass(frozen=True)
class GearPair:
    """A pair of cylindrical gears.

    Attributes:
        teeth: of pinion and gear [1]; that of an internal gear is negative.
        module: normal module [m].
        width: common face width [m].
        helix: angle at the reference circle [rad]; positive for a right-handed pinion.
        pressure_angle: normal [rad].
        shift: profile shifts in modules [1].
        centre_distance: of the axes, above zero [m]; None leaves no backlash.
        thinning: transverse backlash from thinner teeth, along the line of action [m].
        addendum, dedendum, fillet: height of the teeth above and below the reference circle, and
            radius at their roots, in modules [1].
        gear_helix: that of the gear, to check: of the other hand outside, of the same inside a
            ring; None for the one that fits [rad].

    Raises:
        ModelError: if no such gears mesh.
    """

    teeth: tuple[float, float]  # parts of teeth in sections across the flank
    module: Size
    width: Size
    helix: Angle = 0.0
    pressure_angle: Angle = float(np.radians(20.0))
    shift: tuple[float, float] = (0.0, 0.0)
    centre_distance: Size | None = None
    thinning: Annotated[float, Number("m")] = 0.0
    addendum: float = 1.0
    dedendum: float = 1.25
    fillet: float = 0.4
    gear_helix: Angle | None = None

    def __post_init__(self) -> None:
        for fault, hint in self._faults():
            raise ModelError(fault, hint=hint)

    def _faults(self) -> Iterator[tuple[str, str]]:
        """Why the wheels do not mesh, the first first, and what to do."""
        if min(map(abs, self.teeth)) < 4:
            yield f"no gears have {self.teeth} teeth; needed are at least 4.", ""
        if not abs(self.helix) < 0.9 or not 0.1 < self.pressure_angle < 0.7:
            text = f"helix {self.helix} and pressure angle {self.pressure_angle}"
            yield f"{text} must be in radians, below 0.9 and between 0.1 and 0.7.", ""
        fits = self.helix if self.internal else -self.helix
        if self.gear_helix is not None and not abs(self.gear_helix - fits) < 1e-9:
            gear, pinion, needed = np.degrees([self.gear_helix, self.helix, fits])
            hint = "Outside, hands are opposite; in a ring gear they are the same. The gear here"
            text = f"a gear of helix {gear:.4g} degrees does not mesh with a pinion of {pinion:.4g}"
            yield f"{text} degrees.", f"{hint} needs {needed:.4g} degrees."
        if self.teeth[0] < 0 or (self.internal and sum(self.teeth) >= 0):
            hint = "Of an internal gear the number is negative, and larger than the pinion's."
            yield f"no pinion of {self.teeth[0]} teeth turns in a gear of {self.teeth[1]}.", hint
        yield from self._faults_of_teeth()
        if not self.cos_working < 1 or self.backlash < -1e-12:
            why = "the base circles of the wheels have no common tangent"
            if self.cos_working < 1:
                why = f"the teeth would need {-self.backlash * 1e6:.4g} micrometres more"
            here, limit = abs(self.distance) * 1e3, "Up to" if self.internal else "From"
            hint = f"{limit} {abs(self.tight_distance) * 1e3:.4f} mm there is backlash."
            yield f"the backlash is closed: at a centre distance of {here:.4f} mm {why}.", hint
        yield from self._faults_of_contact()

    def _faults_of_teeth(self) -> Iterator[tuple[str, str]]:
        """Teeth that lose their involutes to the tool, and that end in a point."""
        if self.internal and not self.ra[1] <= self.rb[1]:
            tips, base = -1e3 * self.ra[1], -1e3 * self.rb[1]
            text = "the teeth of the gear reach below its base circle, where no involute is: tips"
            hint = "Lower the addendum, or take more teeth for the gear."
            yield f"{text} at {tips:.4g} mm, a base circle of {base:.4g} mm.", hint
        names = ("pinion",) if self.internal else ("pinion", "gear")
        for z, x, name in zip(self.teeth, self.shift, names, strict=False):
            least = self.addendum - z * np.sin(self.alpha_t) ** 2 / (2 * np.cos(self.helix))
            if x < least - 1e-9:
                text = f"the teeth of the {name} are undercut: {z} teeth with profile shift {x}"
                hint = f"Shift the profile by at least {least:.3f} modules, or take more teeth."
                yield f"{text} lose part of their involute to the tool.", hint
        for tip, name in zip(self.tip_thickness, names, strict=False):
            if not tip > 0:
                hint = "Lower the addendum or the profile shift, or take more teeth."
                yield f"the teeth of the {name} are pointed: their flanks meet below the tip.", hint

    def _faults_of_contact(self) -> Iterator[tuple[str, str]]:
        """Tips that reach below the involutes, and pairs that part before the next touch."""
        span = f"from {self.path[0] * 1e3:.3f} to {self.path[1] * 1e3:.3f} mm"
        beyond = not self.internal and self.path[1] > self.tangents
        if self.path[0] < 0 or beyond:
            tip, flank = ("gear", "pinion") if self.path[0] < 0 else ("pinion", "gear")
            text = f"tips of the {tip} reach below the base circle of the {flank}; they would touch"
            where = f"{span} on a base tangent of {self.tangents * 1e3:.3f} mm"
            hint = f"Lower the addendum of the {tip}, or take more teeth for the {flank}."
            yield f"the teeth interfere: {text} {where}.", hint
        if self.contact_ratio < 1:
            ratio = f"a transverse contact ratio of {self.contact_ratio:.3f}, {span}"
            hint = "Lower the centre distance or the profile shift, or take more teeth."
            pitch = f"at a base pitch of {self.base_pitch * 1e3:.3f} mm"
            yield f"contact is lost: {ratio} {pitch}.", hint
        if self.internal and self.tip_clearance < 0:
            text = "the teeth interfere: away from the path of contact tips of the pinion of"
            hint = "Let their numbers differ by more, or lower the addendum."
            pinion, gear = self.teeth[0], -self.teeth[1]
            yield f"{text} {pinion} teeth pass through those of the gear of {gear}.", hint

    @property
    def internal(self) -> bool:
        """Whether the pinion turns inside the gear."""
        return self.teeth[1] < 0

    @cached_property
    def alpha_t(self) -> float:
        """Transverse pressure angle at the reference circles [rad]."""
        return float(np.arctan(np.tan(self.pressure_angle) / np.cos(self.helix)))

    @cached_property
    def r(self) -> Array:
        """(2,) reference radii [m]."""
        return self.module / np.cos(self.helix) * np.array(self.teeth) / 2

    @cached_property
    def rb(self) -> Array:
        """(2,) base radii [m]."""
        return self.r * np.cos(self.alpha_t)

    @cached_property
    def ra(self) -> Array:
        """(2,) tip radii [m]."""
        return self.r + self.module * (self.addendum + np.array(self.shift))

    @cached_property
    def rf(self) -> Array:
        """(2,) root radii [m]."""
        return self.r - self.module * (self.dedendum - np.array(self.shift))

    @cached_property
    def base_helix(self) -> float:
        """Angle of the contact lines on the base plane [rad]."""
        return float(np.arctan(np.tan(self.helix) * np.cos(self.alpha_t)))

    @cached_property
    def base_pitch(self) -> float:
        """Distance of contact lines along the line of action [m]."""
        return float(2 * np.pi * self.rb[0] / self.teeth[0])

    @cached_property
    def tight_angle(self) -> float:
        """Working pressure angle without backlash [rad]."""
        x = 2 * sum(self.shift) / sum(self.teeth) * np.tan(self.pressure_angle)
        wanted = float(involute(self.alpha_t) + x)
        return float(brentq(lambda a: involute(a) - wanted, 1e-6, 1.2, xtol=1e-15))

    @cached_property
    def tight_distance(self) -> float:
        """Centre distance at which teeth that are not thinned have no backlash [m]."""
        return float(self.rb.sum() / np.cos(self.tight_angle))

    @cached_property
    def distance(self) -> float:
        """Centre distance [m], below zero for internal gears."""
        if self.centre_distance is None:
            return self.tight_distance
        return -self.centre_distance if self.internal else self.centre_distance

    @cached_property
    def cos_working(self) -> float:
        """Cosine of the working pressure angle."""
        return float(self.rb.sum() / self.distance)

    @cached_property
    def alpha(self) -> float:
        """Working transverse pressure angle [rad]."""
        return float(np.arccos(self.cos_working))

    @cached_property
    def backlash(self) -> float:
        """Gap of the back flanks along their line of action when the working flanks touch [m]."""
        opened = involute(self.alpha) - involute(self.tight_angle)
        return self.thinning + 2 * float(self.rb.sum() * opened)

    @cached_property
    def tangents(self) -> float:
        """Distance of the points of tangency [m]."""
        return self.distance * float(np.sin(self.alpha))

    @cached_property
    def path(self) -> tuple[float, float]:
        """First and last point of contact, from T1 [m]."""
        return path_of_contact(self, self.alpha)

    @cached_property
    def pitch_point(self) -> float:
        """Where the teeth roll on each other, from T1 [m]."""
        return float(self.rb[0] * np.tan(self.alpha))

    @cached_property
    def contact_ratio(self) -> float:
        """Transverse, epsilon_alpha."""
        return (self.path[1] - self.path[0]) / self.base_pitch

    @cached_property
    def overlap(self) -> float:
        """Of the helix, epsilon_beta."""
        return self.width * abs(float(np.tan(self.base_helix))) / self.base_pitch

    @cached_property
    def base_thickness(self) -> Array:
        """(2,) transverse thickness of the teeth on the base circle [m]."""
        x, m = np.array(self.shift), self.module / np.cos(self.helix)
        at_r = m * (np.pi / 2 + 2 * x * np.tan(self.pressure_angle) * np.cos(self.helix))
        at_r = at_r - np.array([0.0, self.thinning / np.cos(self.alpha_t)])
        return self.rb * (at_r / self.r + 2 * involute(self.alpha_t))

    @cached_property
    def tip_thickness(self) -> Array:
        """(2,) transverse thickness of the teeth at their tips [m]."""
        at_base = self.base_thickness / (2 * self.rb)
        return 2 * self.ra * (at_base - involute(np.arccos(self.rb / self.ra)))

    @property
    def tip_clearance(self) -> float:
        """Angle on a ring by which tips of its pinion pass its own, away from their path [rad].

        Source:
            Kohara, Gear Technical Reference: trochoid interference of internal gears.
        """
        (r, R), a = np.abs(self.ra), abs(self.distance)
        leaves = (R**2 - r**2 - a**2) / (2 * a * r)  # cosine of where both tip circles cross
        if not abs(leaves) < 1:
            return float("inf")
        enters = (a**2 + R**2 - r**2) / (2 * a * R)
        one, two = involute(np.arccos(self.rb / self.ra)) - involute(self.alpha)
        turned = -(np.arccos(leaves) + one) * self.teeth[0] / self.teeth[1]
        return float(turned - two - np.arccos(enters))


def path_of_contact(pair: GearPair, alpha: float) -> tuple[float, float]:
    """First and last point of contact at a working pressure angle [m]."""
    reach = np.sign(pair.rb[1]) * np.sqrt(pair.ra[1] ** 2 - pair.rb[1] ** 2)
    first = pair.rb.sum() * np.tan(alpha) - reach
    return float(first), float(np.sqrt(pair.ra[0] ** 2 - pair.rb[0] ** 2))


def line_length(pair: GearPair, tau: npt.ArrayLike, terms: int = 4000) -> Array:
    """(n,) total length of contact lines over width / cos(base helix) [1], as a Fourier series.

    Tau (n,) is the time in mesh periods since a pair began to touch on the first end of the face
    [1].

    Source:
        Maatar and Velex, J. Mech. Des. 118 (1996).
    """
    a, b, t = pair.contact_ratio, pair.overlap, np.asarray(tau, dtype=float)
    k = np.arange(1, terms + 1)
    each = np.sinc(k * a) * np.sinc(k * b)
    return a * (1 + 2 * np.cos(np.pi * np.multiply.outer(a + b - 2 * t, k)) @ each)
