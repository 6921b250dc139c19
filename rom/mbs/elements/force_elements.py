"""Force elements: bushings, contacts of surfaces, loads spread over a body."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.interpolate import PchipInterpolator

from rom import rotation
from rom.arguments import finite, number, positive, typed, unit_quaternion, unit_vector
from rom.errors import ConfigError
from rom.mbs.elements.impact import Impact, checked_law
from rom.mbs.kernels.system import BORE, CYLINDER, DISC, PLANE, SPHERE
from rom.mbs.parts.bodies import Marker, Part
from rom.model import Array

DIRECTIONS = ("x", "y", "z", "rx", "ry", "rz")
Curves = dict[str, tuple[npt.ArrayLike, npt.ArrayLike]]


@dataclass(frozen=True, slots=True)
class Bushing:
    """Six springs and dampers between two markers; numbers as in `rom.mbs.kernels.system`."""

    i: Marker
    j: Marker
    frames: tuple[Array, Array]
    zero: Array
    stiffness: Array
    damping: Array
    curves: tuple[tuple[int, Array], ...]


@dataclass(frozen=True, slots=True)
class Contact:
    """A sphere or disc on j against something on i; numbers as in `rom.mbs.kernels.system`."""

    kind: int
    i: Marker
    j: Marker
    e: Array
    s: Array
    radius: tuple[float, float]
    law: Impact


@dataclass(frozen=True, slots=True)
class Spread:
    """A load on all points of a body; arrays as in `rom.body.spread.SpreadLoad`."""

    body: str
    force: Array
    first: Array
    shapes: Array
    amplitude: float
    function: Callable[[float], Any] | None
    world: int


@typed
class Elements:
    """The bushings, contacts and spread loads of a `rom.mbs.mechanism.Mechanism`."""

    bushings: dict[str, Bushing]
    contacts: dict[str, Contact]
    spread_loads: dict[str, Spread]
    part: Callable[[str], Part]
    design_point: Callable[[Marker], Array]
    _check_new: Callable[[str], None]
    _check_markers: Callable[..., None]

    def bushing(
        self,
        name: str,
        m1: Marker,
        m2: Marker,
        *,
        stiffness: npt.ArrayLike,
        damping: npt.ArrayLike | None = None,
        axes: npt.ArrayLike | None = None,
        curves: Curves | None = None,
    ) -> None:
        """Elastic and damped connection in six directions, without force at the start.

        Args:
            name: name of the bushing.
            m1: marker that carries the axes.
            m2: other marker; turned by less than half a turn against the first.
            stiffness: (6,) or symmetric (6, 6) [N/m, N/rad; N m/m, N m/rad], translations first,
                then rotations (vector of the rotation).
            damping: likewise, times the rates; None for none.
            axes: (3, 3) or quaternion, axes of the bushing to world at the start; None: world.
            curves: {"x": (displacements, forces), ..., "rz": (angles, moments)} added to the
                stiffness: monotone cubic between ascending points, straight beyond them.

        Raises:
            ConfigError: for matrices without an energy, or tables that do not ascend.
        """
        self._check_new(name)
        self._check_markers(name, m1, m2)
        if m1.body == m2.body:
            raise ConfigError(f"bushing {name!r} connects body {m1.body!r} with itself.")
        world = rotation.matrix(unit_quaternion(axes))
        A1, A2 = (rotation.matrix(self.part(m.body).p) for m in (m1, m2))
        gap = self.design_point(m2) - self.design_point(m1)
        K = _matrix66(f"stiffness of {name}", stiffness)
        C = _matrix66(f"damping of {name}", np.zeros(6) if damping is None else damping)
        tables = tuple(_curve(name, *item) for item in (curves or {}).items())
        frames = (A1.T @ world, A2.T @ world)
        self.bushings[name] = Bushing(m1, m2, frames, world.T @ gap, K, C, tables)

    def sphere_on_plane(
        self,
        name: str,
        m1: Marker,
        m2: Marker,
        law: Impact,
        *,
        normal: npt.ArrayLike,
        radius: float,
    ) -> None:
        """Sphere about m2 against the plane through m1; ``normal`` (3,), world at the start."""
        self._touch(name, PLANE, (m1, m2), law, (normal, None), (radius, 0.0))

    def disc_on_plane(
        self,
        name: str,
        m1: Marker,
        m2: Marker,
        law: Impact,
        *,
        normal: npt.ArrayLike,
        axis: npt.ArrayLike,
        radius: float,
    ) -> None:
        """Rim of a thin disc about m2 against the plane through m1; two make a cylinder.

        ``normal`` of the plane and ``axis`` of the disc (3,) in the world at the start; the disc
        must not lie flat.
        """
        self._touch(name, DISC, (m1, m2), law, (normal, axis), (radius, 0.0))

    def sphere_on_sphere(
        self,
        name: str,
        m1: Marker,
        m2: Marker,
        law: Impact,
        *,
        radius1: float,
        radius2: float,
    ) -> None:
        """Spheres of radius1 about m1 and radius2 about m2 [m]."""
        radii = positive("radius2", radius2), positive("radius1", radius1)
        self._touch(name, SPHERE, (m1, m2), law, (None, None), radii)

    def sphere_on_cylinder(  # noqa: PLR0913  two surfaces and a law
        self,
        name: str,
        m1: Marker,
        m2: Marker,
        law: Impact,
        *,
        axis: npt.ArrayLike,
        radius1: float,
        radius2: float,
        inside: bool = False,
    ) -> None:
        """Sphere of radius2 about m2 against an endless cylinder of radius1 about m1, or its bore.

        ``axis`` (3,) of the cylinder, world at the start; a disc across a bore with its radius is
        a pin with clearance.
        """
        radii = positive("radius2", radius2), positive("radius1", radius1)
        if inside and radii[0] >= radii[1]:
            raise ConfigError(
                f"contact {name!r}: a sphere of {radii[0]:g} m does not fit into a bore of "
                f"{radii[1]:g} m."
            )
        self._touch(name, BORE if inside else CYLINDER, (m1, m2), law, (axis, None), radii)

    def spread_load(
        self, name: str, part: Part, load: Any, amplitude: Any = 1.0, *, frame: str = "body"
    ) -> None:
        """Load on all points of a flexible body: pressure, traction, force per mass.

        In the frame "body" the forces turn with it, as a pressure does; in the "world" they keep
        their direction, given in the axes of the world. Either way they act on the points as they
        deform, which changes moments; the area they were reduced for stays the undeformed one.

        Args:
            name: name of the load.
            part: what `add_flexible` returned.
            load: from `rom.surface_load` or `rom.mass_load` of the same reduced body.
            amplitude: a number, or a function of time.
            frame: "body" or "world".

        Raises:
            ConfigError: for a name in use, a load of another body, or a wrong frame or amplitude.
        """
        self._check_new(name)
        part = self.part(str(getattr(part, "name", part)))
        if frame not in ("world", "body"):
            raise ConfigError(f"frame of {name!r} is {frame!r}; it is 'world' or 'body'.")
        shapes = getattr(load, "shapes", None)
        if shapes is None or shapes.shape != (part.r, 3, 3) or part.flexible is None:
            raise ConfigError(
                f"load {name!r} is not one of body {part.name!r} with {part.r} coordinates.",
                hint="Make it with rom.surface_load or rom.mass_load from that body.",
            )
        function = amplitude if callable(amplitude) else None
        constant = 0.0 if function else number("amplitude", amplitude)
        arrays = (load.force, load.first, shapes)
        self.spread_loads[name] = Spread(
            part.name, *arrays, constant, function, int(frame == "world")
        )

    def _touch(
        self, name: str, kind: int, markers: Any, law: Impact, axes: Any, radius: Any
    ) -> None:
        self._check_new(name)
        self._check_markers(name, *markers)
        if markers[0].body == markers[1].body:
            raise ConfigError(f"contact {name!r} is of body {markers[0].body!r} with itself.")
        positive("radius", radius[0])
        directions = [
            np.zeros(3)
            if axis is None
            else rotation.matrix(self.part(marker.body).p).T @ unit_vector(f"axis of {name}", axis)
            for marker, axis in zip(markers, axes, strict=True)
        ]
        i, j = markers
        e, s = directions
        self.contacts[name] = Contact(kind, i, j, e, s, radius, checked_law(name, law))


def _matrix66(name: str, value: Any) -> Array:
    """Symmetric, not negative (6, 6) matrix from itself or its diagonal."""
    A = np.diag(finite(name, value, (6,))) if np.shape(value) == (6,) else None
    A = finite(name, value, (6, 6)) if A is None else A
    size = np.abs(A).max()
    if np.abs(A - A.T).max() > 1e-9 * size:
        raise ConfigError(f"{name} is not symmetric by {np.abs(A - A.T).max():.3g}: no energy.")
    if np.linalg.eigvalsh(A)[0] < -1e-9 * size:
        raise ConfigError(f"{name} is negative in some direction: it would drive the motion.")
    return 0.5 * (A + A.T)


def _curve(name: str, direction: str, table: Any) -> tuple[int, Array]:
    """Direction and pieces (n, 7) of a tabulated force, see `rom.mbs.kernels.system.Bushings`."""
    if direction not in DIRECTIONS:
        raise ConfigError(f"curve {direction!r} of bushing {name!r}: it is one of {DIRECTIONS}.")
    n = np.size(table[0])
    x, force = (finite(f"curve {direction} of {name}", values, (n,)) for values in table)
    if n < 2 or np.diff(x).min() <= 0.0:
        raise ConfigError(
            f"curve {direction} of bushing {name!r} needs two or more ascending displacements."
        )
    cubic = PchipInterpolator(x, force)
    energy = cubic.antiderivative()
    slopes = cubic.derivative()(x[[0, -1]])
    inner = np.column_stack([x[:-1], x[:-1], cubic.c[::-1].T, energy(x[:-1])])
    left = [-np.inf, x[0], force[0], slopes[0], 0.0, 0.0, energy(x[0])]
    right = [x[-1], x[-1], force[-1], slopes[1], 0.0, 0.0, energy(x[-1])]
    return DIRECTIONS.index(direction), np.vstack([left, inner, right])
