"""Reduced bodies coupled where they touch: modes of the whole from its parts."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import block_diag

from rom.arguments import lowest, matrix, not_both, one_of, typed, whole
from rom.assembly.condensed import (
    CondensedAssembly,
    Partition,
    enough,
    joint_functions,
    local_traces,
    natural_modes,
    partition,
    per_body,
)
from rom.assembly.coupling import Place, coupled_rows, rows_of_parts
from rom.assembly.joined import (
    elastic_modes,
    interface_places,
    joined,
    kept_motions,
    matrix_rows,
    refuse_loose,
)
from rom.body.damping import ModalDamping, Rayleigh, damped
from rom.body.flexible import FlexibleBody
from rom.body.records import Marker, n_rigid_motions, still_motions
from rom.errors import ConfigError, warn
from rom.model import Array, Modes, Report, Row
from rom.names import check_known, check_once, named
from rom.rows import N_COMPARED, frequency_rows, row

AT_MOST = "coordinates of the coupled interfaces"
GAP_RTOL = 1e-9  # of the motion of the coupled interfaces


@typed
@dataclass(frozen=True)
class Assembly:
    """Bodies that share interfaces, in the position in which they were modelled.

    Interfaces are coupled by their coordinates: all dofs of conforming meshes ("full"), whatever
    the order of their nodes; rigid or mean motions; or the coefficients of equal functions. Where
    meshes do not match, a projection couples moments of common functions.

    Attributes:
        bodies: {name: body}, all in one system of coordinates; other units become SI.
        couplings: ((body, interface), (body, interface)) pairs that move together.
        projection: functions that couple deformable interfaces whose coordinates differ, e.g.
            ``Polynomial(4)``; displacements that they contain pass without error.

    Raises:
        ConfigError: if a body is unknown or a coupling is no pair of places.
        InterfaceError: if two interfaces differ in kind or size, lie apart, or need a projection.

    Warns:
        RomWarning: of bodies by `rom.EnhancedCraigBampton`, which is for bodies that stay alone.
    """

    bodies: dict[str, FlexibleBody]
    couplings: tuple[tuple[Place, Place], ...]
    projection: Any = None

    def __post_init__(self) -> None:
        if self.projection is not None and not hasattr(self.projection, "functions"):
            text = f"projection = {self.projection!r} gives no functions of a surface"
            raise ConfigError(f"{text}; use for example rom.Polynomial(4).")
        if far := [name for name, body in self.bodies.items() if body.quartic is not None]:
            text = f"{named(far)} has the energy of large deflection, and an assembly is linear"
            raise ConfigError(f"{text}; reduce without nonlinear.")
        made = {name: body.provenance.get("reduction", {}) for name, body in self.bodies.items()}
        if own := [n for n, how in made.items() if "EnhancedCraigB" in str(how.get("method"))]:
            warn(
                f"{named(own)} has enhanced Craig-Bampton modes, whose correction takes the "
                "interfaces for free: frequencies of an assembly are off by per cents. Take "
                "CraigBampton with a few modes more, or MomentMatching((0.0,), 2)."
            )
        in_si = {name: body.in_units("SI") for name, body in self.bodies.items()}
        object.__setattr__(self, "bodies", in_si)
        _ = self._coupled  # refuses couplings that cannot be

    @property
    def n_conditions(self) -> tuple[int, ...]:
        """Number of coordinates, or moments, that each coupling makes equal."""
        return tuple(term[0][1].shape[0] for term in self._coupled)

    def frequencies(self, n: int | None = None, *, fixed: tuple[Place, ...] = ()) -> Array:
        """(k,) natural frequencies of the assembly [Hz].

        Args:
            n: how many, lowest first; None for all.
            fixed: (body, interface) pairs that are held.

        Raises:
            InterfaceError: if an interface is unknown.
        """
        return self.modes(n, fixed=fixed).frequencies

    def modes(self, n: int | None = None, *, fixed: tuple[Place, ...] = ()) -> Modes:
        """Natural modes: omega (m,) [rad/s], and per body its shapes (6 + r, m)."""
        omega, V = self._natural(fixed)
        kept = lowest(n)
        # copies: what users do to them must not reach what is kept
        return Modes(omega[kept].copy(), per_body(self._widths(), V[:, kept].copy()))

    def _natural(self, fixed: tuple[Place, ...]) -> tuple[Array, Array]:
        """All natural modes, kept for other numbers of them."""
        key = tuple(map(tuple, fixed))
        if key not in self._known:
            (M, K), N = self._matrices(), self._free(fixed)
            omega, V = natural_modes(N.T @ M @ N, N.T @ K @ N, self._n_rigid(fixed))
            self._known[key] = omega, N @ V
        return self._known[key]

    @cached_property
    def _known(self) -> dict[Any, Any]:
        """Natural modes by what is held, and interface motions by body and what is held."""
        return {}

    def conditions(self, fixed: tuple[Place, ...] = ()) -> Array:
        """(c, 6 n_b + r) what is zero: gaps of coupled interfaces, coordinates of held ones [m, 1].

        Columns are the rigid and elastic coordinates of one body after another; ``fixed`` are
        (body, interface) pairs that are held.

        Raises:
            ConfigError, InterfaceError: if a body or an interface is unknown.
        """
        held = [((place, self._marker(place).hold, 1.0),) for place in fixed]
        n = sum(self._widths().values())
        return np.vstack([np.zeros((0, n)), *map(self._placed, [*self._coupled, *held])])

    def reduced(
        self, n_interface: int, *, level: str = "system", fixed: tuple[Place, ...] = ()
    ) -> CondensedAssembly:
        """The assembly with few functions on its coupled interfaces: characteristic modes.

        Other interfaces keep their coordinates. A repeated frequency of the interfaces is kept
        whole, so that the result may have more functions than asked for; it says how many.

        Args:
            n_interface: number of functions; with level "local", modes per body.
            level: "system": lowest modes of all interfaces of the whole, the best choice per
                function; "local": lowest modes of each body with its interfaces free, both sides
                of an interface taking the union, so that a body can be replaced alone.
            fixed: (body, interface) pairs that are held.

        Raises:
            ConfigError: if the interfaces have fewer coordinates, nothing is coupled, the level
                is unknown, or "local" meets an interface that is coupled twice.
            InterfaceError: if an interface is unknown.
        """
        one_of("level", level, ("system", "local"))
        if not self.couplings:
            raise ConfigError("nothing is coupled: interfaces to reduce need couplings.")
        (M, K), parts = self._matrices(), self._partition(None, fixed)
        if level == "system":
            whole("n_interface", n_interface, 1, parts.lam.size, reason=AT_MOST)
            W = parts.chi[:, : enough(parts.lam, n_interface, "interfaces of the assembly")]
        else:
            W = joint_functions(self._interfaces() @ parts.C, self._traces(n_interface, fixed))
        basis = np.hstack([parts.C @ W, parts.F])
        M, K = basis.T @ M @ basis, basis.T @ K @ basis
        n, n_rigid = W.shape[1], self._n_rigid(fixed)
        omega = natural_modes(M[:n, :n], K[:n, :n], n_rigid)[0]
        few = natural_modes(M, K, n_rigid)[0][n_rigid:][:N_COMPARED]
        table = {"reduced": few.tolist(), "full": self._elastic(few.size, fixed).tolist()}
        rows = tuple(frequency_rows(f"{n} interface functions", table))
        report = Report("certificate of the condensed assembly", rows)
        found = level, n, omega, basis, M, K, self._widths(), n_rigid, report
        return CondensedAssembly(*found, self)

    def body(
        self,
        name: str = "assembly",
        *,
        interfaces: tuple[Place, ...] | dict[str, Place] | None = None,
        n_modes: int | None = None,
        f_max: float | None = None,
        reference: object = "mean-axis",
        damping: Rayleigh | ModalDamping | None = None,
        within: Array | None = None,
    ) -> FlexibleBody:
        """One flexible body of all, for a mechanism; its integrals follow from those of its parts.

        It has all shapes of the assembly, unless a number or a frequency limits those that hold its
        interfaces: a Craig-Bampton basis of the whole, whose statics stay exact. Geometric
        stiffness of the bodies is left out.

        Args:
            name: of the body.
            interfaces: (body, interface) pairs it keeps, or {name: pair}; those that nothing is
                coupled to unless given. Two of one name become "left.bore" and "right.bore".
            n_modes: number of modes that hold these interfaces; a repeated frequency is kept whole.
            f_max: alternatively, all such modes up to this frequency [Hz].
            reference: how its frame follows it, see `FlexibleBody.with_reference`.
            damping: in place of that of the bodies.
            within: (n, m) motions in coordinates of all bodies, among which shapes are sought; all
                that close the couplings unless given.

        Raises:
            ConfigError: for both n_modes and f_max, or motions without the rigid ones.
            InterfaceError: if an interface is unknown.
            ModelError: if bodies can move against each other without strain.

        Warns:
            RomWarning: if geometric stiffness is left out, or the certificate fails.
        """
        not_both("Assembly.body", n_modes=n_modes, f_max=f_max)
        places = interface_places(self.bodies, self.couplings, interfaces)
        conditions, n_c = self.conditions(tuple(places.values())), sum(self.n_conditions)
        refuse_loose(self.bodies, conditions[:n_c])
        R = np.vstack([np.eye(width, 6) for width in self._widths().values()])
        M, K = self._matrices()
        N = self._free(()) if within is None else matrix("within", within, (len(M), None))
        n_rigid, most = self._n_rigid(tuple(places.values())), (n_modes, f_max)
        N = kept_motions(N, conditions[n_c:], (M, K), n_rigid, most)
        omega, V = elastic_modes(N, R, (M, K))
        body = joined(name, self.bodies, omega, V, places)
        rows = matrix_rows(body, R, V, M)
        body = body.with_reference(reference)
        if damping is not None:
            body = damped(body, damping)
        own = Report(f"certificate of {name}", (*rows, *self._compared(body, places)))
        own.warn_of_failures(f"the certificate of body {name!r}")
        report = replace(own, rows=(*self.certificate.rows, *own.rows))
        return replace(body, certificate=report)

    def _compared(self, body: FlexibleBody, places: dict[str, Place]) -> list[Row]:
        """Frequencies of a body against those of the assembly, free and held by each interface."""
        rows = []
        held = places if body.has_static_shapes else {}
        for fixed in ({}, *({name: place} for name, place in held.items())):
            omega = body.modes(fixed=tuple(fixed)).omega
            found = omega[omega > 0][:N_COMPARED]
            full = self._elastic(found.size, tuple(fixed.values()))
            support = f"{' + '.join(fixed)} held" if fixed else "free"
            if found.size:
                rows += frequency_rows(support, {"reduced": found.tolist(), "full": full.tolist()})
        return rows

    def _elastic(self, n: int, fixed: tuple[Place, ...]) -> Array:
        """(n,) lowest circular frequencies that are not those of rigid motions [rad/s]."""
        n_rigid = self._n_rigid(fixed)
        return self.modes(n_rigid + n, fixed=fixed).omega[n_rigid:]

    @cached_property
    def certificate(self) -> Report:
        """The certificates of the bodies, and whether couplings close in the lowest modes."""
        rows = rows_of_parts(self.bodies)
        if self.couplings:  # in the lowest elastic modes
            V = self._natural(())[1][:, self._n_rigid(()) :][:, :N_COMPARED]
            sides = [np.abs(self._placed(term[:1]) @ V).max() for term in self._coupled]
            gap = np.abs(self.conditions(()) @ V).max() / max(sides)
            rows.append(row("gap of coupled interfaces, over their motion", gap, GAP_RTOL))
        return Report("certificate of the assembly", tuple(rows))

    def _traces(self, n: int, fixed: tuple[Place, ...]) -> list[list[Array]]:
        """Per coupling, the interface motions that the modes of its two bodies ask for."""
        places = [place for coupling in self.couplings for place in coupling]
        check_once(places, 'level = "local", unlike "system", takes a place once:')
        coupled = list(dict.fromkeys(body for body, _ in places))
        parts = {name: self._partition(name, fixed) for name in coupled}
        most = max(part.lam.size for part in parts.values())
        whole("n_interface", n, 1, most, reason=AT_MOST)
        found: dict[Place, Array] = {}
        for name in coupled:
            rows = self._rows_of(name)
            traces = local_traces(parts[name], n, [*rows.values()], name)
            found |= dict(zip(rows, traces, strict=True))
        return [[found[place] for place in coupling] for coupling in self.couplings]

    def _partition(self, name: str | None, fixed: tuple[Place, ...]) -> Partition:
        """Interface motions of one body, or of the whole; kept for other numbers of functions."""
        key = (name, tuple(map(tuple, fixed)), "partition")
        if key not in self._known:
            if name is None:
                N, H, matrices = self._free(fixed), self._interfaces(), self._matrices()
            else:
                fixed = tuple(place for place in fixed if place[0] == name)
                body, held = self.bodies[name], [self._marker(place).hold for place in fixed]
                N = still_motions(np.vstack([np.zeros((0, 6 + body.n_modes)), *held]))
                H, matrices = np.vstack([*self._rows_of(name).values()]), body.full_matrices()
            self._known[key] = partition(*matrices, N, H, self._n_rigid(fixed))
        return self._known[key]

    def _interfaces(self) -> Array:
        """(h, n) coordinates of all coupled interfaces."""
        return np.vstack([self._placed(term[:1]) for term in self._coupled])

    def _rows_of(self, name: str) -> dict[Place, Array]:
        """Coordinates of the coupled interfaces of one body."""
        return {p: rows for term in self._coupled for p, rows, _ in term if p[0] == name}

    @cached_property
    def _coupled(self) -> list[tuple[tuple[Place, Array, float], ...]]:
        """Per coupling both places with their rows and signs: the sum vanishes."""
        size = max((body.size for body in self.bodies.values()), default=0.0)
        terms = []
        for coupling in self.couplings:
            try:
                one, other = (self._marker(place) for place in coupling)
            except (TypeError, ValueError) as error:
                raise ConfigError(f"{coupling!r} must be pairs (body, interface).") from error
            rows = coupled_rows(coupling, one, other, size, self.projection)
            terms.append(tuple(zip(coupling, rows, (1.0, -1.0), strict=True)))
        return terms

    def _matrices(self) -> tuple[Array, Array]:
        pairs = [body.full_matrices() for body in self.bodies.values()]
        return tuple(block_diag(*parts) for parts in zip(*pairs, strict=True))

    def _widths(self) -> dict[str, int]:
        return {name: 6 + body.n_modes for name, body in self.bodies.items()}

    def _marker(self, place: Place) -> Marker:
        body, interface = place
        check_known(body, self.bodies, f"no body {body!r}; the assembly has")
        return self.bodies[body].marker(interface)

    def _free(self, fixed: tuple[Place, ...]) -> Array:
        """(n, m) motions of all bodies that satisfy couplings and supports."""
        size = max(body.size for body in self.bodies.values())
        six = np.r_[np.ones(3), np.full(3, 1 / size)]
        scale = np.concatenate([np.r_[six, np.ones(b.n_modes)] for b in self.bodies.values()])
        return scale[:, None] * still_motions(self.conditions(fixed) * scale)

    def _placed(self, term: tuple[tuple[Place, Array, float], ...]) -> Array:
        """(c, n) sum of rows, each at the columns of its body."""
        widths = self._widths()
        block = np.zeros((term[0][1].shape[0], sum(widths.values())))
        columns = per_body(widths, block.T)  # views of it
        for place, rows, sign in term:
            columns[place[0]][:] += sign * rows.T
        return block

    def _n_rigid(self, fixed: tuple[Place, ...]) -> int:
        """Rigid motions of the whole that supports leave free."""
        size = max(body.size for body in self.bodies.values())
        return n_rigid_motions((self._marker(place).hold[:, :6] for place in fixed), size)
