"""Wind that reaches a blade: far away it is uniform, ahead of the tower it is dammed.

The dam is the potential flow round a circular cylinder in each horizontal plane.

Source:
    Hansen, Aerodynamics of Wind Turbines, 2008, chapter 8: the rotor is upwind of the
    tower.
"""

from rom.components.wind.wind_turbine import TOWER_HEIGHT, TUBE_SIZES
from rom.mbs.kernels.compiled import inner

# radius of the tower at foot and top [m], its height [m]; zero: no dam
TOWER_TUBE = (TUBE_SIZES["diameter"][0] / 2, TUBE_SIZES["diameter"][1] / 2, TOWER_HEIGHT)
NO_TOWER = (0.0, 0.0, TOWER_HEIGHT)


@inner
def wind_at(tower, x, y, z, v):
    """Turn the wind v far away into that at a place; the axis of the tower is x = y = 0.

    With Z = x + i y, U = v_x + i v_y and the radius a, the flow is conj(U) - U a^2 / Z^2.
    """
    foot, top, height = tower
    square = x * x + y * y
    if foot <= 0.0 or z > height or z < 0.0 or square == 0.0:
        return
    a = foot + (top - foot) * z / height
    share = a * a / max(square, a * a) / square  # inside the tower as on its face
    c, s = share * (x * x - y * y), -share * 2 * x * y  # a^2 / Z^2
    u, w = v[0], v[1]
    v[0] = u - (u * c - w * s)
    v[1] = w + u * s + w * c


@inner
def slope_of_wind(tower, place, wind, out):
    """(3, 3) how the wind at a place grows with the place."""
    foot, top, height = tower
    x, y, z = place
    for i in range(3):
        for j in range(3):
            out[i, j] = 0.0
    square = x * x + y * y
    a = foot + (top - foot) * z / height
    if foot <= 0.0 or z > height or z < 0.0 or square <= a * a:
        return
    p = complex(wind[0], wind[1]) / complex(x, y) ** 2
    along = 2 * a * a * p / complex(x, y)
    up = -2 * a * (top - foot) / height * p
    out[0, 0], out[0, 1], out[0, 2] = along.real, -along.imag, up.real
    out[1, 0], out[1, 1], out[1, 2] = -along.imag, -along.real, -up.imag
