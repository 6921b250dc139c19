"""Induction of a strip of blade by the balance of momentum: one unknown, one root, always found.

With the angle of flow phi against the plane of the rotor, the loads of the profile follow, and from
them both inductions; what is left is one equation that says that the flow has this angle. It
changes its sign once in a known interval, so that bisection and secants cannot fail.

Source:
    Ning, A simple solution method for the blade element momentum equations with guaranteed
    convergence, Wind Energy 17 (2014) 1327: equations 6 to 16 and the order of intervals.
    Buhl, A new empirical relationship between thrust coefficient and induction factor, NREL/
    TP-500-36834, 2005: beyond the validity of the balance, continuous with Prandtl's losses.
    Coleman, Feingold, Stempin, Evaluation of the induced-velocity field of an idealized helicopter
    rotor, NACA ARR L5E10, 1945: the skewed cylinder of vortices.
    Burton, Sharpe, Jenkins, Bossanyi, Wind Energy Handbook, 2001, section 3.10: angle of the wake.
"""

import math

from rom.mbs.kernels.compiled import inner

# columns of what describes a strip to the kernels
RADIUS_COLUMN, CHORD_COLUMN, ROTOR_COLUMN, HUB_COLUMN, BLADE_COLUMN = range(5)
STRIP_WIDTH = 5
MOMENTUM_LIMIT = 2 / 3  # of the loading k: from induction 0.4 on, thrust by Buhl's parabola
SMALLEST_ANGLE = 1e-6  # of the flow [rad]: the ends of intervals
ANGLE_ATOL = 1e-12  # to which the angle of flow is found [rad]
SKEW_GROWTH = 0.6  # of the angle of the wake, in those of the wind, with the induction
MAX_HALVINGS = 60  # of an interval below pi: more than its digits
LARGEST_SKEW = math.pi / 2  # of a wake: it lies in the disc, and slows no air before it [rad]


@inner
def interval(ascending, k, x):
    """Where the interval of the first k numbers begins that has x in it, at the ends the next."""
    low, high = 0, k - 1
    while high - low > 1:
        middle = (low + high) // 2
        if ascending[middle] > x:
            high = middle
        else:
            low = middle
    return low


@inner
def coefficients(table, k, angle):
    """Lift and drag at an angle of attack, and how both grow with it."""
    angle -= 2 * math.pi * math.floor((angle + math.pi) / (2 * math.pi))
    low = interval(table, k, angle)
    high = low + 1
    wide = table[high] - table[low]
    s = (angle - table[low]) / wide
    lift, drag = table[k + low], table[2 * k + low]
    up, more = table[k + high] - lift, table[2 * k + high] - drag
    return lift + s * up, drag + s * more, up / wide, more / wide


@inner
def losses(strip, phi):
    """Prandtl's factor for the flow round tip and hub."""
    r, blades = strip[RADIUS_COLUMN], strip[BLADE_COLUMN]
    steep = max(abs(math.sin(phi)), SMALLEST_ANGLE)
    tip = math.exp(-0.5 * blades * (strip[ROTOR_COLUMN] - r) / (r * steep))
    hub = math.exp(-0.5 * blades * (r - strip[HUB_COLUMN]) / (strip[HUB_COLUMN] * steep))
    F = (2 / math.pi) ** 2 * math.acos(min(tip, 1.0)) * math.acos(min(hub, 1.0))
    return max(F, SMALLEST_ANGLE)


@inner
def balance(strip, table, k, phi, theta):
    """Speed far away over that through the disc, and the loading in the plane, at an angle of flow.

    The former is 1 / (1 - a) of the axial induction a.
    """
    cl, cd, _, _ = coefficients(table, k, phi - theta)
    s, c = math.sin(phi), math.cos(phi)
    F = losses(strip, phi)
    solidity = strip[BLADE_COLUMN] * strip[CHORD_COLUMN] / (2 * math.pi * strip[RADIUS_COLUMN])
    loading = solidity * (cl * c + cd * s) / (4 * F * s * s)
    driving = solidity * (cl * s - cd * c) / (4 * F * s * c)
    if phi < 0.0:  # the rotor drives the air
        return 1.0 - loading, driving
    if loading <= MOMENTUM_LIMIT:
        return 1.0 + loading, driving
    g1 = 2 * F * loading - (10 / 9 - F)
    g2 = 2 * F * loading - (4 / 3 - F) * F
    g3 = 2 * F * loading - (25 / 9 - 2 * F)
    root = math.sqrt(g2)
    a = (g1 - root) / g3 if abs(g3) > SMALLEST_ANGLE else 1.0 - 0.5 / root
    return 1.0 / (1.0 - a), driving


@inner
def residual(strip, table, k, phi, theta, axial, tangential):
    """What the angle of flow is away from; multiplied so that the rotor may stand still."""
    ratio, driving = balance(strip, table, k, phi, theta)
    return tangential * math.sin(phi) * ratio - axial * math.cos(phi) * (1.0 - driving)


@inner
def root_between(strip, table, k, theta, flow, low, high):
    """The angle between two of different signs, by secants that bisection keeps in."""
    axial, tangential = flow
    f_low = residual(strip, table, k, low, theta, axial, tangential)
    f_high = residual(strip, table, k, high, theta, axial, tangential)
    kept = 0
    for n in range(2 * MAX_HALVINGS):
        middle = 0.5 * (low + high)
        if n % 3 and f_high != f_low:
            middle = high - f_high * (high - low) / (f_high - f_low)
        f = residual(strip, table, k, middle, theta, axial, tangential)
        if f * f_low > 0.0:
            f_high = 0.5 * f_high if kept == 1 and n % 3 else f_high
            low, f_low, kept = middle, f, 1
        else:
            f_low = 0.5 * f_low if kept == 2 and n % 3 else f_low
            high, f_high, kept = middle, f, 2
        if high - low < ANGLE_ATOL or f == 0.0:
            return middle
    return 0.5 * (low + high)


@inner
def flow_angle(strip, table, k, theta, axial, tangential):
    """The angle of flow of a strip in wind from the front.

    Intervals of the source: windmill, a rotor that drives the air, and flow from behind, which is
    sought where the air on a blade that hardly turns, or backward, comes past a right angle. So
    forces do not jump where a rotor starts.
    """
    e, flow, right = SMALLEST_ANGLE, (axial, tangential), 0.5 * math.pi
    end = residual(strip, table, k, right, theta, axial, tangential)
    if residual(strip, table, k, e, theta, axial, tangential) * end <= 0.0:
        return root_between(strip, table, k, theta, flow, e, right)
    start = residual(strip, table, k, -0.5 * right, theta, axial, tangential)
    if end > 0.0 and start * residual(strip, table, k, -e, theta, axial, tangential) < 0.0:
        return root_between(strip, table, k, theta, flow, -0.5 * right, -e)
    return root_between(strip, table, k, theta, flow, right, math.pi - e)


@inner
def induced(strip, table, k, theta, axial, tangential):
    """Air that reaches the strip: along the axis, against the motion, and the angle of flow.

    Wind from behind has no balance of momentum here and is not slowed.
    """
    if axial <= 0.0:
        return axial, tangential, math.atan2(axial, tangential)
    phi = flow_angle(strip, table, k, theta, axial, tangential)
    ratio, driving = balance(strip, table, k, phi, theta)
    through = axial / ratio
    # both say the same at the root; near a right angle the loading in the plane is large
    across = tangential / (1.0 - driving) if math.cos(phi) > 0.5 else through / math.tan(phi)
    return through, across, phi


@inner
def skewed(strip, axial, through, lean, toward):
    """Air through a strip whose wake leaves a disc that the wind meets at an angle.

    The induction grows to the side to which the wake leans, by tan(chi / 2) r / R, the slope of a
    skewed cylinder of vortices in the middle of its end; the mean of a turn stays. ``lean`` is the
    angle of the wind from the axis, not below zero, ``toward`` the cosine of that of the blade from
    the side.
    """
    if axial <= 0.0:
        return through
    a = min(max(1.0 - through / axial, 0.0), 1.0)
    slope = math.tan(0.5 * min((1.0 + SKEW_GROWTH * a) * lean, LARGEST_SKEW))
    share = slope * toward * strip[RADIUS_COLUMN] / strip[ROTOR_COLUMN]
    return through - (axial - through) * share


@inner
def slowed(strip, table, k, theta, flow, lee):
    """Air that reaches the strip, as `induced` has it, behind a wake that leans as `skewed` says.

    ``flow`` is the air far away along the axis and against the motion, ``lee`` where the wake
    leans: the last two arguments of `skewed`.
    """
    through, across, phi = induced(strip, table, k, theta, flow[0], flow[1])
    return skewed(strip, flow[0], through, lee[0], lee[1]), across, phi
