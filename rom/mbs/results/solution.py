"""What a run leaves behind, and the questions it answers."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from rom.arguments import one_of, typed, vector
from rom.errors import ConfigError
from rom.fields import Columns, Open
from rom.io.history import data_frame, data_set
from rom.mbs.equations.packing import Packed
from rom.mbs.kernels.system import WORK
from rom.mbs.mechanism import Mechanism
from rom.mbs.parts.joints import coordinate_of
from rom.mbs.parts.signals import sample_all
from rom.mbs.results import recomputed
from rom.mbs.results.element_record import (
    ElementRecord,
    LawRecord,
    element_record,
    law_record,
    markers_of,
)
from rom.mbs.results.interpolation import Point, between
from rom.mbs.results.state import State
from rom.mbs.results.whereabouts import Whereabouts
from rom.model import Array, Index
from rom.names import check_known
from rom.notebook import html_table, listed, with_figure
from rom.rotation import matrix

Place = str | tuple[float, float, float]


@dataclass(frozen=True)
class Occurrences:
    """When an event happened.

    Attributes:
        t: (k,) times [s].
        q, v: (k, n_q), (k, n) coordinates and velocities then, in units of `State`.
    """

    t: Array
    q: Array
    v: Array


@dataclass(frozen=True)
class Energy:
    """Energies and works over time; works count from the start.

    Attributes:
        kinetic: (n_t,) of all bodies [J].
        strain: (n_t,) elastic energy of bodies and elements [J].
        potential: (n_t,) of gravity [J].
        drives: (n_t,) work done by drives and motors [J].
        forces: (n_t,) work done by forces, torques and user forces [J].
        damping: (n_t,) work lost in dampers, friction and impacts [J].
    """

    kinetic: Array
    strain: Array
    potential: Array
    drives: Array
    forces: Array
    damping: Array

    @property
    def total(self) -> Array:
        """(n_t,) mechanical energy: kinetic, strain and potential [J]."""
        return self.kinetic + self.strain + self.potential

    @property
    def balance(self) -> Array:
        """(n_t,) mechanical energy gained minus work put in [J]; zero for an exact motion."""
        supplied = self.drives + self.forces - self.damping
        return self.total - self.total[0] - supplied


@typed
@dataclass(frozen=True)
class Solution(Whereabouts, Columns, metaclass=Open, kind="columns", bound=typed):
    """Motion of a mechanism.

    Attributes:
        mechanism: what moved.
        packed: its arrays.
        t: (n_t,) times [s].
        q, v, a: (n_t, n_q), (n_t, n), (n_t, n) coordinates, velocities, accelerations, see
            `rom.mbs.results.state.State`.
        lam: (n_t, m) constraint multipliers [N, N m].
        work: (n_t, 3) work of drives, of forces, lost in dampers [J].
        base: (n_t, c) joint coordinates that forces or couplings act on, angles counted over
            whole turns [m, or rad].
        signals: (n_t, s, 3) prescribed functions of time, in their own units.
        statistics: steps, iterations, times.
        status: one sentence on how the run ended.
        final: the last state, from which a run can go on.
        events: when each event of the mechanism happened, by name.

    Raises:
        ConfigError: of all methods, for a body, joint, drive or element that is not there.
    """

    mechanism: Mechanism
    packed: Packed
    t: Array
    q: Array
    v: Array
    a: Array
    lam: Array
    work: Array
    base: Array
    signals: Array
    statistics: dict[str, Any]
    status: str
    final: State
    events: dict[str, Occurrences] = field(default_factory=dict)
    _tracks: dict[object, recomputed.Tracks] = field(default_factory=dict, repr=False)

    def __repr__(self) -> str:
        return (
            f"Solution({self.t.size} instants, {self.t[0]:g} to {self.t[-1]:g} s, bodies "
            f"{listed(self.packed.names)}: {self.status})"
        )

    def _repr_html_(self) -> str:
        plain = [(key, x) for key, x in self.statistics.items() if isinstance(x, int | float | str)]
        happened = [
            (f"event {name}", f"{len(found.t)} times") for name, found in self.events.items()
        ]
        rows = [
            ("time [s]", f"{self.t[0]:g} to {self.t[-1]:g}"),
            ("instants", self.t.size),
            ("bodies", listed(self.packed.names)),
            ("joints and drives", listed(dict.fromkeys(self.packed.row_owner))),
            *plain,
            *happened,
        ]
        return with_figure(self, html_table(f"Motion. {self.status}", ("", ""), rows))

    def at(self, t: npt.ArrayLike) -> "Solution":
        """The motion at other times, with everything that can be asked of a solution.

        Its ``final`` is the state at the last of them, from which a run can go on.
        Cubic Hermite polynomials between the saved instants, see `rom.mbs.results.interpolation`;
        multipliers, works and followed joint coordinates are linear there.

        Args:
            t: a time or (k,) times within the motion [s].

        Raises:
            ConfigError: for a time outside of it.
        """
        t = vector("t", t)
        outside = ~((t >= self.t[0]) & (t <= self.t[-1]))
        if outside.any():
            text = f"t = {t[outside][0]:g} s must be within the motion from {self.t[0]:g} s to"
            raise ConfigError(f"{text} {self.t[-1]:g} s.")
        if self.t.size == 1:
            return self
        left = np.clip(np.searchsorted(self.t, t, side="right") - 1, 0, self.t.size - 2)
        rows = zip(left, t, strict=True)
        curves = (
            between(self.packed.system, self._point(k), self._point(k + 1), x) for k, x in rows
        )
        q, v, a = (np.array(x) for x in zip(*curves, strict=True))
        share = ((t - self.t[left]) / (self.t[left + 1] - self.t[left]))[:, None]
        lines = (self.lam, self.work, self.base)
        lam, work, base = (x[left] + share * (x[left + 1] - x[left]) for x in lines)
        span, spacing = (self.t[0], self.t[-1]), 0.01 * (self.t[-1] - self.t[0]) / (self.t.size - 1)
        signals = sample_all(self.packed.signals, t, span, spacing)
        motion = {"q": q, "v": v, "a": a, "lam": lam, "work": work, "base": base}
        ends = {name: row[-1] for name, row in motion.items() if name != "work"}
        final = State(float(t[-1]), rank=self.final.rank, **ends)
        return replace(self, t=t, **motion, signals=signals, final=final, _tracks={})

    def _point(self, k: int) -> Point:
        return Point(self.t[k], self.q[k], self.v[k], self.a[k])

    def stress(self, body: str, instant: int) -> Array:
        """(p, 6) stress xx, yy, zz, yz, xz, xy on the surface of a flexible body [Pa].

        In the axes of the body; modes that its reduction left out follow its inertia without
        delay, if the body knows them.

        Args:
            body: name of a body reduced with ``stress=True``.
            instant: row of ``t``.

        Raises:
            ConfigError: if the stress of the body cannot be recovered.
        """
        part = self.mechanism.part(body)
        recovery = getattr(part.moving, "stress", None) if part.r else None
        if recovery is None:
            text = f"the stress of body {body!r} cannot be recovered"
            raise ConfigError(f"{text}; reduce it with stress=True.")
        at = self.packed.system.bodies.v_at[self._number(body)]
        A, omega = matrix(self._places(body, 3, 7)[instant]), self._rates(body, 3, 6)[instant]
        a, gravity = self.a[instant, at : at + 6 + part.r], np.asarray(self.mechanism.gravity)
        q = self.elastic(body)[instant]
        return recomputed.stress_in_motion(recovery, q, A, omega, a, gravity)

    def reaction(self, name: str) -> Array:
        """(n_t, 6) force [N] and moment [N m] of a joint or drive on its second body, world.

        The moment is about the second marker. A drive is counted apart from its joint.

        Example:
            >>> mech = rom.Mechanism(gravity=(0, 0, -9.81))
            >>> at = {"at": (0, 0, -1), "markers": {"top": (0, 0, 1)}}
            >>> lamp = mech.add_rigid("lamp", mass=2, inertia=(1e-3,) * 3, **at)
            >>> mech.spherical("hook", mech.ground.marker((0, 0, 0)), lamp.marker("top"))
            >>> sol = rom.simulate(mech, t_end=0.1, dt=1e-2)
            >>> round(float(sol.reaction("hook")[-1, 2]), 6)  # its weight
            19.62
        """
        check_known(name, set(self.packed.row_owner), f"no joint or drive {name!r}; there are")
        return self._follow(rows=self.packed.rows_of(name)).reaction

    def joint(self, name: str) -> recomputed.JointMotion:
        """Angle and displacement of a joint over time, with their rates.

        Raises:
            ConfigError: if it leaves no angle about an axis and no displacement along one.
        """
        coordinate_of(self.mechanism.joints, name, None, "motion of a joint")
        joint = self.mechanism.joints[name]
        one, two = (self._at_marker(self.packed.row(marker)) for marker in joint.markers)
        row, slide = joint.turn, joint.displacement
        angle = (None, None) if row is None else recomputed.angles(row, self.t, one, two)
        displacement = (None, None) if slide is None else recomputed.displacements(slide, one, two)
        return recomputed.JointMotion(self.t, *angle, *displacement)

    def drive_load(self, name: str) -> Array:
        """(n_t,) torque [N m] or force [N] that a drive supplies along its joint coordinate."""
        check_known(name, self.mechanism.drives, f"no drive {name!r}; there are")
        return -self.lam[:, self.packed.rows_of(name)[0]]

    def interface_loads(self, body: str, *, frame: str = "world") -> dict[Place, Array]:
        """Loads on each marker of a body: joints, drives, springs, contacts, loads together.

        With gravity they are all that moves the body; on an interface of a flexible body they are
        the load history for a stress or fatigue analysis of the part.

        Args:
            body: name of a body, or "ground".
            frame: axes, of the "world" or of the "body".

        Returns:
            {marker: (n_t, 6) force [N] and moment about the marker [N m]}, without markers that
            carry nothing.
        """
        self.mechanism.part(body)
        one_of("frame", frame, ("body", "world"))
        found, loads = dict[Place, Array](), self._marker_loads
        for marker, k in self.packed.markers.items():
            if marker.body == body and loads[:, k].any():
                both = loads[:, k].reshape(-1, 2, 3)
                if frame == "body":
                    both = np.einsum("tba,tsb->tsa", recomputed.axes_of(self, body), both)
                found[marker.place] = both.reshape(-1, 6)
        return found

    def law(self, name: str) -> LawRecord:
        """What a law of the user said over time: forces, energy, memory and its own outputs."""
        check_known(name, self.mechanism.laws, f"no law {name!r}; there are")
        return law_record(self, name)

    def element(self, name: str) -> ElementRecord:
        """Forces, energy and losses of one spring, motor, contact or other element on markers."""
        return element_record(self, name)

    @property
    def elements(self) -> tuple[str, ...]:
        """Names of the force elements that act on markers, which `element` answers for."""
        found = self.mechanism.elements.items()
        return tuple(name for name, x in found if markers_of(self.mechanism, *x))

    @cached_property
    def _marker_loads(self) -> Array:
        """(n_t, k, 6) force [N] and moment [N m] of all that acts on each marker, world."""
        return np.array([W.wrench.copy() for W in recomputed.at_instants(self)])

    @cached_property
    def energy(self) -> Energy:
        """Energies and works over time."""
        energy = self._follow().energy
        works, kept = dict(zip(WORK, self.work.T, strict=True)), self.packed.kept(self.base)
        works["damping"] = works["damping"] - (kept - kept[0])
        return Energy(energy[:, 0], energy[:, 1], energy[:, 2], **works)

    @cached_property
    def gap(self) -> Array:
        """(n_t, m) residuals of the constraints [m, or 1]."""
        return self._follow().gap

    @cached_property
    def momentum(self) -> tuple[Array, Array]:
        """(n_t, 3) linear momentum and (n_t, 3) angular momentum about the world origin."""
        tracks = self._follow()
        return tracks.momentum[:, :3], tracks.momentum[:, 3:]

    def to_pandas(self, *, every: int = 1) -> Any:
        """Every so many instants as a table: a DataFrame of `rom.io.history.data_frame`.

        Raises:
            ResourceError: if pandas is missing.
        """
        return data_frame(self, every=every)

    def to_xarray(self, *, every: int = 1) -> Any:
        """The motion as named arrays: a Dataset of `rom.io.history.data_set`; as above."""
        return data_set(self, every=every)

    def _at_marker(self, row: int) -> recomputed.Seen:
        return recomputed.Seen(*self._follow(row)[:3])

    def _follow(self, marker: int = 0, rows: Sequence[int] | Index = ()) -> recomputed.Tracks:
        key = (marker, tuple(rows))
        if key not in self._tracks:
            self._tracks[key] = recomputed.follow(self, marker, np.array(rows, dtype=np.int64))
        return self._tracks[key]
