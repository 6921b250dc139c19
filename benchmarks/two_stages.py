"""Two stages of gears between three shafts, on six oil films in a housing: solids from gmsh."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from benchmarks.models import STEEL, geometry
from benchmarks.timing import Row, timed
from rom.components.gear_mesh.gears.geometry import GearPair
from rom.components.journal_bearing.films.bearing import Groove, JournalBearing
from rom.mbs.analysis.equilibrium import equilibrium
from rom.mbs.integrate.simulation import simulate
from rom.mbs.mechanism import Mechanism
from rom.reduction.bases.method import CraigBampton
from rom.reduction.interfaces.polynomial import FourierLegendre
from rom.workflow import reduce

SHAFT_HEIGHT, MIDDLE_DISTANCE, SHAFT_SPEED, INPUT_TORQUE, OIL_VISCOSITY = (
    0.15,
    0.135,
    100 * np.pi,
    40.0,
    0.02,
)
SHAFT_PLACES = {"input": -0.15, "middle": -0.02, "output": 0.15}  # across the shafts [m]
SPEED_RATIOS = {"input": 1.0, "middle": -25 / 61, "output": 25 * 21 / (61 * 54)}
JOURNAL_DIAMETERS = {"input": 0.04, "middle": 0.045, "output": 0.05}
# parameters of meshes/gear_shaft.geo: the first wheel, a second one, size of elements
SHAFT_SIZES: dict[str, dict[str, float]] = {
    "input": {"z_w": 0.105, "b": 0.03, "D": 0.066, "lc": 0.013},
    "middle": {"z_w": 0.105, "b": 0.03, "D": 0.172, "z_2": 0.17, "b_2": 0.045, "D_2": 0.083,
               "lc": 0.018},
    "output": {"z_w": 0.17, "b": 0.045, "D": 0.23, "lc": 0.02},
}  # fmt: skip
HOUSING_SIZES = {"L": 0.6, "W": 0.2, "H": 0.28, "a": 0.13, "a_2": 0.17, "z_s": SHAFT_HEIGHT,
                 "l_s": 0.03, "d_1": 0.04, "d_m": 0.045, "d_2": 0.05, "lc": 0.024}  # fmt: skip
WHEEL_PAIRS = {
    ("input", "wheel", "middle", "wheel"): GearPair((25, 61), 3e-3, 0.03, centre_distance=0.13),
    ("middle", "wheel_2", "output", "wheel"): GearPair(
        (21, 54), 4.5e-3, 0.045, centre_distance=0.17
    ),
}
STEPS_PER_TOOTH, N_TEETH = 40, 10


def bodies(rim: Any) -> dict[str, Any]:
    """Reduced shafts and housing.

    Args:
        rim: kind of interface of the wheels' rims.
    """
    from rom.fe import model as read_model

    seats = {f"{name}_{side}": "rbe3" for name in SHAFT_PLACES for side in ("front", "back")}
    model = read_model(geometry("housing"), material=STEEL, parameters=HOUSING_SIZES)
    found = {
        "housing": reduce(model, method=CraigBampton(6), interfaces=seats | {"feet": "rbe2"},
                          reference="feet", certify=False)
    }  # fmt: skip
    for name, sizes in SHAFT_SIZES.items():
        common = {"L": 0.27, "z_a": 0.05, "z_b": 0.22, "l_j": 0.03, "d": JOURNAL_DIAMETERS[name]}
        model = read_model(geometry("gear_shaft"), material=STEEL, parameters=common | sizes)
        kinds = dict.fromkeys(("journal_a", "journal_b", "end_a"), "rbe3")
        kinds |= dict.fromkeys(("wheel", "wheel_2") if "D_2" in sizes else ("wheel",), rim)
        found[name] = reduce(model, method=CraigBampton(6), interfaces=kinds,
                             reference="mean-axis", certify=False)  # fmt: skip
    return found


def machine(parts: dict[str, Any], cells: tuple[int, int], *, tabulated: bool = False) -> Mechanism:
    """The mechanism of these bodies, driven by an elastic coupling."""
    mech, y = Mechanism(gravity=(0, 0, -9.81)), np.array([0.0, 1.0, 0.0])
    housing = parts["housing"]
    case = mech.add_flexible("housing", housing)
    mech.fixed("feet", mech.ground.marker(housing.markers["feet"].point), case.marker("feet"))
    for name, x in SHAFT_PLACES.items():
        speed = SHAFT_SPEED * SPEED_RATIOS[name]
        shaft = mech.add_flexible(
            name, parts[name], at=(x, -MIDDLE_DISTANCE, SHAFT_HEIGHT), spin=(0, 0, speed),
            orientation=np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]),
        )  # fmt: skip
        d, grooves = JOURNAL_DIAMETERS[name], [Groove(0, 0.35), Groove(np.pi, 0.35)]
        film = JournalBearing(d, 0.03, 0.6e-3 * d, grooves, cells=cells)
        for journal, side in (("journal_a", "front"), ("journal_b", "back")):
            mech.journal_bearing(f"{name} {side}", shaft.marker(journal),
                                 case.marker(f"{name}_{side}"), axis=np.sign(speed) * y,
                                 reference=(1, 0, 0), bearing=film, oil=OIL_VISCOSITY,
                                 tabulated=tabulated)  # fmt: skip
        end, drive = shaft.marker("end_a"), 2e4 if name == "input" else 0.0
        mech.bushing(f"end of {name}", mech.ground.marker(mech.design_point(end)), end,
                     stiffness=(0, 1e8, 0, 0, drive, 0),
                     damping=(0, 1e3, 0, 0, 1e-4 * drive, 0))  # fmt: skip
    for k, ((a, one, b, two), pair) in enumerate(WHEEL_PAIRS.items()):
        ends = mech.part(a).marker(one), mech.part(b).marker(two)
        mech.gear_mesh(f"stage {k + 1}", *ends, axis=(1 - 2 * k) * y, pair=pair, stiffness=14e9,
                       damping=2e-6, cells=8)  # fmt: skip
    torque = -INPUT_TORQUE / SPEED_RATIOS["output"]
    mech.torque("load", mech.part("output").marker("end_a"), torque * y)
    return mech


def stages_run(cells: tuple[int, int] = (60, 4)) -> Iterator[Row]:
    """Case, quantity, value, unit and aim: from rest through some teeth of the first stage.

    With rims that stay round, and with rims that deform; with films that are solved and films that
    are read from tables.
    """
    for rim, label in (("rbe3", "stiff rims"), (FourierLegendre(1, 2), "elastic rims")):
        parts = bodies(rim)
        for tabulated, how in ((False, f"of {cells[0]} x {cells[1]}"), (True, "from tables")):
            mech = machine(parts, cells, tabulated=tabulated)
            yield from _steps(mech, f"{label}, 6 films {how}")


def _steps(mech: Mechanism, label: str) -> Iterator[Row]:
    dt = 2 * np.pi / (SHAFT_SPEED * 25) / STEPS_PER_TOOTH
    taken, rest = timed(equilibrium, mech)
    case = f"two stages, {rest.v.size} velocities, {label}"
    yield case, "equilibrium", taken, "s of the processor", ""
    warm = simulate(mech, state=rest, t_end=2 * dt, dt=dt).final
    n = N_TEETH * STEPS_PER_TOOTH
    taken, run = timed(simulate, mech, state=warm, t_end=(2 + n) * dt, dt=dt)
    yield case, "steps", n / taken, "1/s of the processor", "above 1000"
    for name in ("iterations", "factorisations"):
        yield case, f"{name} per step", run.statistics[name] / n, "", ""
