"""A pinion on a straight rack: as a gear without end, whose line of action does not turn."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

import numpy as np

from rom.arguments import typed
from rom.components.gear_mesh.gears.geometry import GearPair
from rom.errors import ModelError
from rom.model import Array


@typed
@dataclass(frozen=True)
class RackPair:
    """A cylindrical pinion and a rack, without ends: see `rom.Mechanism.stop`.

    Attributes:
        pinion_teeth: their number.
        module: normal module [m].
        width: common face width [m].
        helix: angle at the reference circle [rad]; positive for a right-handed pinion.
        pressure_angle: normal [rad].
        shift: profile shift of the pinion in modules [1].
        centre_distance: from the axis to the reference line of the rack [m]; None leaves no
            backlash.
        thinning: transverse backlash from thinner teeth, along the line of action [m].
        addendum, dedendum, fillet: as of `GearPair`, in modules [1].
        gear_helix: that of the rack, to check: of the other hand; None for the one that fits [rad].

    Raises:
        ModelError: if no such wheel and rack mesh.
    """

    internal: ClassVar[bool] = False  # nothing is inside a rack
    pinion_teeth: int
    module: float
    width: float
    helix: float = 0.0
    pressure_angle: float = float(np.radians(20.0))
    shift: float = 0.0
    centre_distance: float | None = None
    thinning: float = 0.0
    addendum: float = 1.0
    dedendum: float = 1.25
    fillet: float = 0.4
    gear_helix: float | None = None

    def __post_init__(self) -> None:
        for fault, hint in self._faults():
            raise ModelError(fault, hint=hint)

    def _faults(self) -> Iterator[tuple[str, str]]:
        """Why the wheels do not mesh, the first first, and what to do."""
        if not (self.pinion_teeth >= 4 and self.module > 0 and self.width > 0):
            size = f"module {self.module} m, {self.width} m wide,"
            hint = "The rack is outside: its pinion has at least 4 teeth."
            yield f"no pinion of {self.pinion_teeth} teeth of {size} turns on a rack.", hint
        if self.gear_helix is not None and not abs(self.gear_helix + self.helix) < 1e-9:
            of_rack, fits = np.degrees([self.gear_helix, -self.helix])
            other = f"does not mesh with a pinion of {-fits:.4g} degrees."
            hint = f"Their hands are opposite: {fits:.4g} degrees."
            yield f"a rack of helix {of_rack:.4g} degrees {other}", hint
        if not self.tip_thickness > 0:
            hint = "Lower the addendum or the pressure angle."
            yield "the teeth of the rack are pointed: their flanks meet below the tip.", hint
        if self.backlash < -1e-12:
            here = f"{self.distance * 1e3:.4f} mm from the axis to the rack"
            more = f"the teeth would need {-self.backlash * 1e6:.4g} micrometres more."
            hint = f"From {self.tight_distance * 1e3:.4f} mm there is backlash."
            yield f"the backlash is closed: {here} {more}", hint
        if self.path[0] < 0 or self.contact_ratio < 1:
            span = f"from {self.path[0] * 1e3:.3f} to {self.path[1] * 1e3:.3f} mm"
            ratio = f"a transverse contact ratio of {self.contact_ratio:.3f}"
            hint = "Lower the distance of the rack or the addendum, or take more teeth."
            yield f"contact is lost: {ratio}, {span}.", hint

    @cached_property
    def wheel(self) -> GearPair:
        """The pinion, with a wheel that is so large that nothing of it is refused."""
        teeth = self.pinion_teeth, 1000 * self.pinion_teeth
        sizes = self.module, self.width, self.helix, self.pressure_angle, (self.shift, 0.0)
        heights = {"addendum": self.addendum, "dedendum": self.dedendum, "fillet": self.fillet}
        return GearPair(teeth, *sizes, **heights)

    @property
    def teeth(self) -> tuple[int, int]:
        """Of the pinion, and 0."""
        return self.pinion_teeth, 0

    @property
    def base_helix(self) -> float:
        """Angle of the contact lines on the base plane [rad]."""
        return self.wheel.base_helix

    @property
    def base_pitch(self) -> float:
        """Distance of contact lines along the line of action [m]."""
        return self.wheel.base_pitch

    @property
    def alpha(self) -> float:
        """Transverse pressure angle, at any distance [rad]."""
        return self.wheel.alpha_t

    @property
    def r(self) -> Array:
        """(1,) reference radius of the pinion [m]: its rolling circle, whatever the distance."""
        return self.wheel.r[:1]

    @property
    def rb(self) -> Array:
        """(2,) base radius of the pinion [m], and what the rack approaches per travel [1]."""
        return np.array([self.wheel.rb[0], -np.cos(self.alpha)])

    @property
    def base_thickness(self) -> Array:
        """(1,) transverse thickness of the teeth of the pinion on the base circle [m]."""
        return self.wheel.base_thickness[:1]

    @property
    def tight_distance(self) -> float:
        """Distance at which teeth that are not thinned have no backlash [m]."""
        return float(self.wheel.r[0] + self.shift * self.module)

    @cached_property
    def distance(self) -> float:
        """From the axis to the reference line [m]."""
        return self.tight_distance if self.centre_distance is None else self.centre_distance

    @property
    def backlash(self) -> float:
        """Gap of the back flanks along their line of action when the working flanks touch [m]."""
        return self.thinning + 2 * (self.distance - self.tight_distance) * float(np.sin(self.alpha))

    @property
    def tangents(self) -> float:
        """Distance of the points of tangency [m]: without end."""
        return float("inf")

    @property
    def tip(self) -> float:
        """Height of the teeth of the rack over their reference line [m]."""
        return self.addendum * self.module

    @property
    def tip_thickness(self) -> float:
        """Normal thickness of the teeth of the rack at their tips [m]."""
        slope = np.tan(self.pressure_angle)
        return float(self.module * (np.pi / 2 - 2 * self.addendum * slope))

    @cached_property
    def path(self) -> tuple[float, float]:
        """First and last point of contact, from T1 [m]."""
        depth = self.distance - self.tip - self.wheel.rb[0] * np.cos(self.alpha)
        last = np.sqrt(self.wheel.ra[0] ** 2 - self.wheel.rb[0] ** 2)
        return float(depth / np.sin(self.alpha)), float(last)

    @cached_property
    def contact_ratio(self) -> float:
        """Transverse, epsilon_alpha."""
        return (self.path[1] - self.path[0]) / self.base_pitch
