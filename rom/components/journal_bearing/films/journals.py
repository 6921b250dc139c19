"""Oil films as elements: their tables and kernels."""

import math

from rom.components.journal_bearing.films import cells as col
from rom.components.journal_bearing.films.bearing import JFO
from rom.components.journal_bearing.films.bores import (
    add_bore_rows,
    add_bore_tangents,
    bend_bore,
    bore_power,
    open_film,
)
from rom.components.journal_bearing.films.cells import Cells
from rom.components.journal_bearing.films.kinematics import (
    answer_unit,
    carried_stiffness,
    film_forces,
    imaginary,
    journal_motion,
    journal_place,
    journal_wrench,
    stepped_place,
)
from rom.components.journal_bearing.films.oil import CELSIUS_ZERO
from rom.components.journal_bearing.films.pressure import (
    find_pressure,
    outflow,
    peak,
    set_heights,
    set_supply,
)
from rom.components.journal_bearing.films.slopes import TORQUE_ANSWER, set_answers, set_slopes
from rom.components.journal_bearing.films.tabulated import (
    in_table,
    read_answers,
    read_slopes,
    thinnest_of,
)
from rom.mbs.elements.contact.points import COMPLEX_STEP
from rom.mbs.kernels.algebra import row
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.constraints import pair_stiffness
from rom.mbs.kernels.element_calls import pair_tangents, residuals, tangents
from rom.mbs.kernels.tables import Array1, Array2, Array3, Index1, Scratch1, Scratch2, Table, table

# columns of Journals.oil
CONSTANT, WALTHER_A, WALTHER_B, DENSITY, HEAT, INLET, HEATED, LAG, ROUGHNESS = range(9)
# what a film remembers, before the content of its cells
KNOWN, TIME, TEMPERATURE, THINNEST, LARGEST, POWER, SIDE_FLOW, MOTION = range(8)
FIRST_CONTENT = MOTION + col.N_MOTIONS
SETTLING_MARK = -1.0  # in place of 1 for a known film: its temperature is the one that stays
MAX_WARMINGS = 50  # of a film whose grooves have pressure
WARMING_TOL = 1e-10  # of a temperature [K]
MAX_BISECTIONS = 60  # of a temperature: all digits
# share of the oil that the journal drags around which is renewed in any case: a centred journal
# does not pump
LEAST_RENEWED = 1e-2


@table
class Journals(Table):
    """All films between journals and bushes."""

    i: Index1  # (k,) markers of the journals
    j: Index1  # (k,) of the bushes
    # (k, 3, 3) axis of the journal in the axes of its marker; axis of the bush and the direction
    # from which angles count, in those of the other
    axes: Array3
    # (k, 9) viscosity if it is constant, else 0 [Pa s]; A, B of Walther's law; density [kg/m^3];
    # specific heat [J/(kg K)]; inlet temperature [degrees Celsius]; share of the heat that the
    # temperature of the film feels; lag of it [s]; height of roughness [m]
    oil: Array2
    clock: Index1  # (1,) function that tells the time
    remembered: Index1  # (k,) first of the numbers that each remembers
    films: Cells  # their cells
    scale: Array2  # (k, 4) motions that change the film by a clearance [m, rad]
    # (k,) spin of the journal against the bush of bodies that spin in their frames [rad/s]
    turning: Array1
    largest: Scratch1  # (k,) pressure [Pa], not finite where there is no film
    thinnest: Scratch1  # (k,) film [m], which is below zero where the journal is beyond the bush
    viscosity: Scratch1  # (k,) at the last residual [Pa s]
    bores: Array3  # (k, m, R) amplitudes by which bushes open films per elastic coordinate [m]
    amplitude: Scratch2  # (k, 2 m) of the functions, and their rates, in clearances
    # (m, 12) changes of the forces on a bore by motions, or velocities, of both markers
    pressed: Scratch2
    change: Scratch1  # (5 + m,) imaginary steps of the answers
    number: Index1  # (k,) of the table that the film is read from; -1 of one that is solved
    nodes: Array3  # (n_tables, n, 12) of the tables
    read: Scratch2  # (4, 12) what was read last, and its derivatives
    flow: Scratch1  # (k,) oil that leaves, in units of the film
    peak: Scratch1  # (k,) largest pressure, in units of the film


@inner
def oil_viscosity(oil, celsius):
    """Viscosity of the oil of one film [Pa s]."""
    if oil[CONSTANT] > 0.0:
        return oil[CONSTANT]
    powers = oil[WALTHER_A] - oil[WALTHER_B] * math.log10(celsius + CELSIUS_ZERO)
    return 1e-6 * oil[DENSITY] * (10.0 ** (10.0**powers) - 0.7)


@inner
def side_flow(journals, k):
    """Oil that leaves at the ends [m^3/s]."""
    R, L, c = row(journals.films.size, k, col.RADIUS)
    return journals.flow[k] * journals.films.size[k, col.IMAGES] * c * R * L / 12


@inner
def lost_power(journals, k):
    """Power that turns into heat [W]."""
    films = journals.films
    total = answer_unit(journals, k, TORQUE_ANSWER) * films.answer[k, TORQUE_ANSWER]
    total *= films.state[k, col.SPIN_COLUMN]
    for m in range(col.N_MOTIONS):
        force = answer_unit(journals, k, m) * films.answer[k, m]
        total -= force * journals.scale[k, m] * films.state[k, col.N_MOTIONS + m]
    return total - bore_power(journals, k)


@inner
def warming(journals, k):
    """Rise of the temperature of the film over inlet that its power would keep up [K]."""
    oil, (R, L, c) = journals.oil[k], row(journals.films.size, k, col.RADIUS)
    drag = 0.5 * abs(journals.films.state[k, col.SPIN_COLUMN]) * c * R * L
    flow = max(side_flow(journals, k), LEAST_RENEWED * drag)
    if oil[CONSTANT] > 0.0 or not flow > 0.0:
        return 0.0
    return oil[HEATED] * lost_power(journals, k) / (oil[DENSITY] * oil[HEAT] * flow)


@inner
def solved(journals, k, celsius):
    """Solve film k at a temperature; says whether there is one."""
    films = journals.films
    journals.viscosity[k] = oil_viscosity(journals.oil[k], celsius)
    if journals.number[k] >= 0:
        read_answers(journals, k)
        return True
    set_supply(films, k, journals.viscosity[k])
    if find_pressure(films, k) < 0:
        return False
    set_answers(films, k)
    journals.flow[k], journals.peak[k] = outflow(films, k), peak(films, k)
    return True


@inner
def settled_temperature(journals, k):
    """Solve film k at the temperature that it keeps up itself, which is returned; or NaN."""
    oil = journals.oil[k]
    celsius = oil[INLET]
    for _ in range(MAX_WARMINGS):
        if not solved(journals, k, celsius):
            return math.nan
        by_viscosity = warming(journals, k) / journals.viscosity[k]
        low, high = oil[INLET], oil[INLET] + by_viscosity * oil_viscosity(oil, oil[INLET])
        for _ in range(MAX_BISECTIONS):
            middle = 0.5 * (low + high)
            if middle - oil[INLET] < by_viscosity * oil_viscosity(oil, middle):
                low = middle
            else:
                high = middle
        change, celsius = abs(high - celsius), high
        if change <= WARMING_TOL:
            break
    return celsius


@inner
def recall(s, W, journals, k):
    """Tell the film what it remembers; returns its temperature, NaN if that is to be found."""
    at, films = s.coordinates.kind.size + journals.remembered[k], journals.films
    films.state[k, col.PASSED_TIME] = W.signal[journals.clock[0], 0] - W.base[at + TIME]
    films.state[k, col.CONTENT_KNOWN] = 1.0 if W.base[at + KNOWN] == 1.0 else 0.0
    for cell in range(n_remembered(films, k)):
        films.content[k, cell] = W.base[at + FIRST_CONTENT + cell]
    return math.nan if W.base[at + KNOWN] == SETTLING_MARK else W.base[at + TEMPERATURE]


@inner
def n_remembered(films, k):
    """Cells whose content a film remembers: those of one that conserves its oil."""
    return films.shape[k, 0] * films.shape[k, 1] if films.law[k] == JFO else 0


@inner
def remember(W, journals, k, celsius):
    """Keep what the film is like, and its temperature when the present time is over."""
    films, oil = journals.films, journals.oil[k]
    at = journals.remembered[k]
    aim = oil[INLET] + warming(journals, k)
    if films.state[k, col.CONTENT_KNOWN] == 1.0 and films.state[k, col.PASSED_TIME] > 0.0:
        celsius = aim + (celsius - aim) * math.exp(-films.state[k, col.PASSED_TIME] / oil[LAG])
    W.fresh[at + KNOWN], W.fresh[at + TIME] = 1.0, W.signal[journals.clock[0], 0]
    W.fresh[at + TEMPERATURE], W.fresh[at + THINNEST] = celsius, journals.thinnest[k]
    W.fresh[at + LARGEST], W.fresh[at + POWER] = journals.largest[k], lost_power(journals, k)
    W.fresh[at + SIDE_FLOW] = side_flow(journals, k)
    for m in range(col.N_MOTIONS):
        W.fresh[at + MOTION + m] = films.state[k, m] * journals.scale[k, m]
    stays = films.state[k, col.CONTENT_KNOWN] == 1.0 and films.state[k, col.PASSED_TIME] == 0.0
    for cell in range(n_remembered(films, k)):
        if stays:
            W.fresh[at + FIRST_CONTENT + cell] = films.content[k, cell]
        else:
            W.fresh[at + FIRST_CONTENT + cell] = films.fill[k, cell] * films.middle[k, cell]


@inner
def set_state(journals, k, place):
    """Tell the film how the journal moves."""
    motion, rate, spin = journal_motion(*place)
    state, scale = journals.films.state[k], journals.scale[k]
    for m in range(col.N_MOTIONS):
        state[m], state[col.N_MOTIONS + m] = motion[m] / scale[m], rate[m] / scale[m]
    if journals.films.size[k, col.IMAGES] > 1.0:  # tilts are not seen
        state[2] = state[3] = state[col.N_MOTIONS + 2] = state[col.N_MOTIONS + 3] = 0.0
    state[col.SPIN_COLUMN] = spin + journals.turning[k]


@inner
def set_thinnest(journals, k):
    """Set the thinnest film of film k; says whether it is one, and in its table if it has one."""
    films = journals.films
    if journals.number[k] >= 0:
        thinnest, known = thinnest_of(films, k), in_table(films, k)
    else:
        thinnest, known = set_heights(films, k), True
    journals.thinnest[k] = films.size[k, col.CLEARANCE] * thinnest
    return known and journals.thinnest[k] > journals.oil[k, ROUGHNESS]


@inner
def film_of(s, W, journals, k):
    """Solve film k where its journal is now; says whether there is one."""
    celsius = recall(s, W, journals, k)
    if not set_thinnest(journals, k):
        return False
    if celsius == celsius:  # it remembers one
        found = solved(journals, k, celsius)
    else:
        celsius = settled_temperature(journals, k)
        found = celsius == celsius
    if not found:
        return False
    ratio = journals.films.size[k, col.RADIUS] / journals.films.size[k, col.CLEARANCE]
    journals.largest[k] = journals.peak[k] * (journals.viscosity[k] * ratio**2)
    remember(W, journals, k, celsius)
    return True


@residuals.of(Journals)
def film_wrenches(s, W, journals, q, v, _lam):
    """Add the films to the wrenches on the markers and bend bores; add up the power lost."""
    for k in range(journals.i.size):
        i, j = journals.i[k], journals.j[k]
        axes, relative = journal_place(W, i, j, journals.axes[k])
        set_state(journals, k, (axes, relative))
        open_film(s, journals, k, q, v)
        if not film_of(s, W, journals, k):
            journals.largest[k] = math.nan
            W.wrench[i, 0] = math.nan
            continue
        F, torque = film_forces(journals, k, journals.films.answer[k])
        force, on_journal, on_bush = journal_wrench(axes, relative[0], F, torque)
        for p in range(3):
            W.wrench[i, p] += force[p]
            W.wrench[i, 3 + p] += on_journal[p]
            W.wrench[j, p] -= force[p]
            W.wrench[j, 3 + p] += on_bush[p]
        bend_bore(s, W, journals, k)
        W.power[2] += lost_power(journals, k)
        W.power[1] += torque * journals.turning[k]  # of what keeps it spinning


@inner
def changed_answers(journals, k, motion, rate, spin):
    """Forces and torque with the imaginary step that motion, rate and spin have."""
    F, torque = film_forces(journals, k, journals.films.answer[k])
    change, slope = journals.change, journals.films.slope[k]
    for m in range(col.N_ANSWERS + journals.films.n_functions[k]):
        change[m] = 0.0
        for q in range(col.N_MOTIONS):
            change[m] += slope[m, q] * motion[q].imag / journals.scale[k, q]
            change[m] += slope[m, col.N_MOTIONS + q] * rate[q].imag / journals.scale[k, q]
        change[m] += slope[m, col.SPIN_COLUMN] * spin.imag
        change[m] *= answer_unit(journals, k, m)
    first, second = complex(F[0], change[0]), complex(F[1], change[1])
    moments = complex(F[2], change[2]), complex(F[3], change[3])
    return (first, second, *moments), complex(torque, change[TORQUE_ANSWER])


@inner
def set_column(W, journals, k, p, by_position):
    """Set column p of W.Q to minus the change of the wrenches in unit motion, or velocity, p.

    Column p of journals.pressed is that of the forces on the bore.
    """
    i, j = journals.i[k], journals.j[k]
    place = journal_place(W, i, j, journals.axes[k])
    axes, relative = stepped_place(p, by_position, place)
    F, torque = changed_answers(journals, k, *journal_motion(axes, relative))
    force, on_journal, on_bush = journal_wrench(axes, relative[0], F, torque)
    shove, turned, back = imaginary(force), imaginary(on_journal), imaginary(on_bush)
    for q in range(3):
        W.Q[q, p] = -shove[q]
        W.Q[3 + q, p] = -turned[q]
        W.Q[6 + q, p] = shove[q]
        W.Q[9 + q, p] = -back[q]
    for f in range(journals.films.n_functions[k]):
        journals.pressed[f, p] = journals.change[col.N_ANSWERS + f] / COMPLEX_STEP


@inner
def scale_pair(W, c):
    """Multiply W.Q by a factor."""
    for p in range(12):
        for q in range(12):
            W.Q[p, q] *= c


@inner
def set_film_slopes(journals, k):
    """Set the derivatives of the answers of film k."""
    if journals.number[k] >= 0:
        read_slopes(journals, k)
    else:
        set_slopes(journals.films, k)


@tangents.of(Journals)
def film_tangents(s, W, journals, _lam, ck, cc):
    """Add ck times the stiffness to W.Kt and cc times the damping to W.S."""
    for k in range(journals.i.size):
        if not journals.largest[k] >= 0.0:
            continue
        pair = journals.i[k], journals.j[k]
        by_rate = col.FIRST_OPENED + journals.films.functions.shape[2]
        set_film_slopes(journals, k)
        for p in range(12):
            set_column(W, journals, k, p, True)
        scale_pair(W, ck)
        pair_stiffness(s, W, *pair, W.Kt)
        add_bore_tangents(s, W, journals, k, col.FIRST_OPENED, ck, W.Kt)
        for p in range(12):
            set_column(W, journals, k, p, False)
        carried_stiffness(s, W, pair, ck, W.Kt)
        add_bore_rows(s, W, journals, k, -1, ck, W.Kt)
        scale_pair(W, cc)
        pair_stiffness(s, W, *pair, W.S)
        add_bore_tangents(s, W, journals, k, by_rate, cc, W.S)


@pair_tangents.of(Journals)
def film_pair_tangents(_s, W, journals, ck, cc, first):
    """Write what the motion of the journal against its bush changes to W.pairs.

    Nothing of a film that bends its bore, which is more than that motion.
    """
    for k in range(journals.i.size):
        W.pairs[first + k] = 0.0
        if not journals.largest[k] >= 0.0 or journals.films.n_functions[k] > 0:
            continue
        set_film_slopes(journals, k)
        for by_position in range(2):
            for q in range(6):
                set_column(W, journals, k, q, by_position == 1)
                for p in range(6):
                    W.pairs[first + k, p, q] += (ck if by_position == 1 else cc) * W.Q[p, q]
    return journals.i.size
