"""Journal bearings as elements: what users describe, and their arrays."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
import numpy.typing as npt

from rom.arguments import Direction, NotNegative, Positive, Share, finite, positive, unit_vector
from rom.components.journal_bearing.films import journals as col
from rom.components.journal_bearing.films.bearing import JFO, REYNOLDS, JournalBearing
from rom.components.journal_bearing.films.bores import bore_of
from rom.components.journal_bearing.films.cells import CLEARANCE, N_ANSWERS, cells_of
from rom.components.journal_bearing.films.journals import (
    Journals,
    film_pair_tangents,
    film_tangents,
    film_wrenches,
)
from rom.components.journal_bearing.films.oil import Oil
from rom.components.journal_bearing.films.tabulated import N_READ, N_VALUES, table_of
from rom.errors import ConfigError
from rom.mbs.elements.family import Family, Hooks, Places, integers, never, rows_of
from rom.mbs.parts.bodies import Marker
from rom.mbs.parts.joints import Whole
from rom.model import Array, Index
from rom.rotation import matrix

PARALLEL_COSINE = 0.9  # with X, beyond which angles do not count from there


@dataclass(frozen=True, slots=True)
class OilFilm:
    """A film between a journal and a bush; axes (3, 3) and oil (9,) as in `Journals`.

    The bore (n, m), (m, r) is that of `bore_of`, without functions for a rigid one; the table that
    of `table_of`, None for a film that is solved.
    """

    i: Marker
    j: Marker
    bearing: JournalBearing
    axes: Array
    liquid: Oil | float
    oil: tuple[float, ...]
    turning: float
    bore: tuple[Array, Array] = (np.zeros((0, 0)), np.zeros((0, 0)))
    table: Array | None = None


def journal_bearing(  # noqa: PLR0913  one keyword per property
    self: Whole,
    name: str,
    journal: Marker,
    bush: Marker,
    *,
    axis: Direction,
    bearing: JournalBearing,
    oil: Oil | float,
    inlet: float | None = None,
    reference: Direction | None = None,
    roughness: Annotated[float, NotNegative("m")] = 0.0,
    carried: Share = 0.9,
    felt: Share = 0.5,
    thermal_time: Annotated[float, Positive("s")] = 1.0,
    elastic_bush: bool = False,
    tabulated: bool = False,
) -> None:
    """Oil film between a journal and its bush, by Reynolds' equation.

    The film is that of the journal as seen from the bush, which may move, turn and tilt, too. A
    mass-conserving film ("jfo") remembers how far its cells are filled; where no time has passed,
    in `equilibrium` and at the start, the filling is the one that stays. With an `Oil` the film has
    a temperature, which follows inlet and own power with the thermal time: in `equilibrium` it is
    the one that stays, and a run that starts elsewhere begins with oil as it comes in.

    Args:
        name: name of the bearing.
        journal: on the axis of the journal.
        bush: middle of the bush; within the clearance from that axis where the bodies are added.
        axis: (3,) of both, in the world at the start; angles count positive about it.
        bearing: `rom.mbs.JournalBearing`.
        oil: `rom.mbs.Oil`, or a viscosity that stays [Pa s].
        inlet: temperature of an `Oil` that comes in [degrees Celsius].
        reference: (3,) direction from which angles of grooves and lobes count, in the world at the
            start, across the axis; that of X, or of Y where X lies along the axis.
        roughness: height at which journal and bush touch [m].
        carried: share of the heat that leaves with the oil [1].
        felt: share of the rise that the temperature of the film feels [1].
        thermal_time: over which that temperature follows [s].
        elastic_bush: whether the pressure bends the bore, and the bent bore changes the film: the
            bush is an interface of a reduced body with functions, as `rom.FourierLegendre`. Else
            the film sees its mean motion alone.
        tabulated: whether the film is read from a table of its equation's solutions, which takes
            seconds to make, once for each shape of bearing, and microseconds to read; for round
            bores with grooves at ambient pressure. Forces are those of a journal that does not
            tilt, moments those of small tilts; an end may come closer by 0.3 of the film.

    Raises:
        ConfigError: for a name in use, unknown markers, a journal that touches its bush at the
            start, an elastic bush without functions of this bore, or a film that is more than a
            table.
    """
    self.check_apart(name, journal, bush)
    z, x = _directions(name, axis, reference)
    turned = [matrix(self.part(side.body).p) for side in (journal, bush)]
    axes = np.array([z @ turned[0], z @ turned[1], x @ turned[1]])
    D = self.design_point(journal) - self.design_point(bush)
    _check_gap(name, bearing, np.array([D @ x, D @ np.cross(z, x)]), roughness)
    numbers = (*_oil(name, oil, inlet), carried * felt, thermal_time, roughness)
    self.part(bush.body).refuse_spin(f"the bush of bearing {name!r}", "grooves would turn in it")
    turning = self.part(journal.body).spin_about(name, axes[0])
    film = OilFilm(journal, bush, bearing, axes, oil, numbers, turning)
    if elastic_bush and tabulated:
        text = f"the bush of bearing {name!r} bends: its film has no table of places"
        raise ConfigError(f"{text}; leave out elastic_bush or tabulated.")
    if tabulated:
        film = replace(film, table=table_of(name, bearing))
    if elastic_bush:
        bore = bore_of(name, self.part(bush.body), bush, axes[1:], bearing)
        film = replace(film, bore=bore)
    self.add(name, film, JOURNAL_BEARINGS_FAMILY)


def _directions(name: str, axis: npt.ArrayLike, reference: npt.ArrayLike | None) -> Array:
    """(2, 3) axis, and direction from which angles count."""
    z = unit_vector(f"axis of {name}", axis)
    across = np.eye(3)[1 if abs(z[0]) > PARALLEL_COSINE else 0]
    given = across if reference is None else finite("reference", reference, (3,))
    x = given - (given @ z) * z
    if not np.linalg.norm(x) > 1e-6 * np.linalg.norm(given):
        text = f"reference of bearing {name!r} lies along its axis"
        raise ConfigError(f"{text}; give a direction across it, from which angles count.")
    return np.array([z, x / np.linalg.norm(x)])


def _check_gap(name: str, bearing: JournalBearing, place: Array, roughness: float) -> None:
    """Refuse a journal that touches its bush at the start, or always would."""
    c, most = bearing.clearance, bearing.thinnest(np.zeros(2))
    if not roughness < most:
        text = f"roughness of bearing {name!r} is {roughness * 1e6:.3g} micrometres"
        raise ConfigError(f"{text}, and its film {most * 1e6:.3g} at most.")
    if not bearing.thinnest(place) > roughness:
        far = f"{np.hypot(*place) * 1e6:.4g} micrometres beside the middle of {c * 1e6:.4g}"
        text = f"the journal of bearing {name!r} touches its bush at the start: it stands"
        raise ConfigError(f"{text} {far}; put the markers on one axis.")


def _oil(name: str, oil: Oil | float, inlet: float | None) -> tuple[float, ...]:
    """Viscosity if it stays, law, density, specific heat and inlet temperature."""
    if not isinstance(oil, Oil):
        viscosity = positive(f"oil of bearing {name!r} [Pa s]", oil)
        if inlet is None:
            return (viscosity, 0.0, 0.0, 1.0, 1.0, 0.0)
        fault = "has an inlet temperature, but a viscosity that stays; give an rom.mbs.Oil."
    elif inlet is None:
        fault = "has an oil; give its inlet temperature."
    elif float(oil.viscosity(inlet)) > 0.0:
        return (0.0, *oil.law(), oil.density, oil.heat, float(inlet))
    else:
        fault = f"has the inlet = {inlet}: the oil boils before; give degrees Celsius."
    raise ConfigError(f"bearing {name!r} {fault}")


def circles(_: object, __: str, film: OilFilm) -> list[tuple[Marker, Array, float]]:
    """What is drawn: the journal and the bush."""
    pair = zip((film.i, film.j), film.axes[:2], strict=True)
    return [(marker, axis, film.bearing.radius) for marker, axis in pair]


def pack(found: Mapping[str, OilFilm], places: Places) -> Journals:
    """The films as arrays."""
    films = list(found.values())
    k, cells = len(films), cells_of([x.bearing for x in films], [x.bore[0] for x in films])
    most = cells.functions.shape[2]
    bores = np.zeros((k, most, places.R))
    for row, one in zip(bores, films, strict=True):
        row[: len(one.bore[1]), : one.bore[1].shape[1]] = one.bore[1]
    return Journals(
        integers(places.marker[one.i] for one in films),
        integers(places.marker[one.j] for one in films),
        np.array([one.axes for one in films]),
        rows_of((one.oil for one in films), 9),
        integers([places.clock()]),
        integers(
            places.memory(name, _memory(one, 0.0), settling=_memory(one, col.SETTLING_MARK))
            for name, one in found.items()
        ),
        cells,
        np.array([one.bearing.scale for one in films]),
        np.array([one.turning for one in films], dtype=float),
        *np.zeros((3, k)),
        bores,
        *(np.zeros((k, 2 * most)), np.zeros((most, 12)), np.zeros(N_ANSWERS + most)),
        *_tables(films),
        np.zeros((N_READ, N_VALUES)),
        *np.zeros((2, k)),
    )


def _tables(films: list[OilFilm]) -> tuple[Index, Array]:
    """Number of the table of each film, -1 where it has none, and the tables."""
    found = {id(one.table): one.table for one in films if one.table is not None}
    numbers = {key: number for number, key in enumerate(found)}
    nodes = np.array(list(found.values())) if found else np.zeros((0, 0, N_VALUES))
    return integers(numbers.get(id(one.table), -1) for one in films), nodes


def _memory(one: OilFilm, known: float) -> Array:
    """What a film remembers at first: the temperature of its inlet, and whether that is known."""
    conserves = one.bearing.cavitation == "jfo"
    memory = np.zeros(col.FIRST_CONTENT + conserves * int(np.prod(one.bearing.cells)))
    memory[col.KNOWN], memory[col.TEMPERATURE] = known, one.oil[col.INLET]
    return memory


@contextmanager
def oil_everywhere(journals: Journals) -> Iterator[bool]:
    """Films that conserve their oil find it everywhere: on the way to the load they may run dry."""
    law = journals.films.law.copy()
    journals.films.law[law == JFO] = REYNOLDS
    try:
        yield bool((law == JFO).any())
    finally:
        journals.films.law[:] = law


KERNELS = film_wrenches, film_tangents, None, None, film_pair_tangents  # no energy is stored
HOOKS = Hooks(
    answers=lambda journals: journals.largest,
    potential=False,
    eased=oil_everywhere,
    room=lambda journals: journals.thinnest / journals.films.size[:, CLEARANCE],
    lost="the journal touches its bush in {}, its film finds no pressure or leaves its table",
    remembers=lambda rows: (rows.films.law == JFO) | (rows.oil[:, col.CONSTANT] == 0.0),
)
JOURNAL_BEARINGS_FAMILY = Family(
    "journal_bearings", OilFilm, pack, *KERNELS, by_rate=never, hooks=HOOKS
)
