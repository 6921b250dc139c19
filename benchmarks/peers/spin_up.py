"""The spin-up of Kane, Ryan and Banerjee's bar as a solid body, as a rod, and by Exudyn's beams.

Within 15 s it turns from rest to 6 rad/s about its base; all have the same steps. The error is that
of the largest deflection of the tip against the geometrically exact beam. Processor time, one
thread, without set-up.

Source:
    Kane, Ryan and Banerjee, Dynamics of a cantilever beam attached to a moving base, J. Guidance,
    Control and Dynamics 10 (1987) 139.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from benchmarks.peers.compare import answer_to
from benchmarks.peers.rods import SCRIPT_FILE
from benchmarks.timing import timed
from rom import rotation
from rom.components.cosserat import body, straight
from rom.components.wind.wind_turbine import ramp
from rom.mbs.integrate.simulation import simulate
from rom.mbs.mechanism import Mechanism
from rom.model import Array

BAR_LENGTH, LINE_MASS = 10.0, 1.2  # [m, kg/m]
AXIAL_STIFFNESS, BENDING_STIFFNESS = 2.8e7, 1.4e4  # EA, EI [N, N m^2]
BAR_SIDE = (12 * BENDING_STIFFNESS / AXIAL_STIFFNESS) ** 0.5  # of its square section [m]
LINE_INERTIA = LINE_MASS * BAR_SIDE**2 / 12  # [kg m]
# along the bar, then across: without Poisson effect, and five sixths of the section for shear
SECTION_STRETCH = [AXIAL_STIFFNESS, AXIAL_STIFFNESS / 2.4, AXIAL_STIFFNESS / 2.4]
SECTION_BEND = [BENDING_STIFFNESS] * 3
SECTION_INERTIA = [2 * LINE_INERTIA, LINE_INERTIA, LINE_INERTIA]
TO_ROD = [1, 2, 0]  # whose third axis is along it
FINAL_SPEED, RISE_TIME, TIME_STEP, RHO_INF = 6.0, 15.0, 0.005, 0.9
LARGEST_LAG = -0.57379  # deflection of the tip of the exact beam, at 6.76 s [m]
ORIGIN = (0.0, 0.0, 0.0)
ROD_AXES = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]])  # third axis of a rod along x

Held = Callable[[Mechanism], tuple[Any, Any]]


@dataclass(frozen=True)
class Run:
    """A spin-up.

    Attributes:
        seconds: processor time of its steps.
        error: of the largest deflection, relative.
        steps, corrections: numbers of them.
    """

    seconds: float
    error: float
    steps: int
    corrections: int


def solid(flexible: Any) -> Held:
    """The bar as a reduced body along x, with the interfaces root and tip."""

    def held(mech: Mechanism) -> tuple[Any, Any]:
        part = mech.add_flexible("bar", flexible)
        return part.marker("root"), part.marker("tip")

    return held


def rod(segments: int) -> Held:
    """The bar as a rod of so many segments."""

    def held(mech: Mechanism) -> tuple[Any, Any]:
        stretch, bend, inertia = (np.array(x)[TO_ROD] for x in
                                  (SECTION_STRETCH, SECTION_BEND, SECTION_INERTIA))  # fmt: skip
        section: dict[str, Any] = {
            "stretch": stretch, "bend": bend, "inertia": inertia, "mass": LINE_MASS,
        }  # fmt: skip
        one = body(straight(BAR_LENGTH, segments, frame=ROD_AXES, **section))
        part = mech.add_nonlinear("bar", one)
        return part.marker("start"), part.marker("end")

    return held


def spun_up(held: Held, t_end: float = RISE_TIME) -> Run:
    """The bar turns about z at its root, driven; a first step compiles and is not counted."""
    mech = Mechanism(gravity=ORIGIN)
    root, tip = held(mech)
    place = mech.design_point(root)
    mech.revolute("base", mech.ground.marker(place), root, axis=(0, 0, 1))
    speed, angle = ramp(FINAL_SPEED, RISE_TIME)
    mech.drive("motor", "base", angle, rate=speed)
    options: dict[str, Any] = {"dt": TIME_STEP, "rho_inf": RHO_INF, "progress": False}
    simulate(mech, t_end=2 * TIME_STEP, **options)
    seconds, sol = timed(simulate, mech, t_end=t_end, **options)
    seen = sol.position(tip.body, tip.place) - place
    across = np.array([(rotation.matrix(rotation.exp([0, 0, -angle(t)])) @ x)[1]
                       for t, x in zip(sol.t, seen, strict=True)])  # fmt: skip
    done = sol.statistics
    return Run(seconds, abs(across.min() / LARGEST_LAG - 1), done["steps"], done["iterations"])


def by_exudyn(elements: int) -> tuple[float, float, str]:
    """Processor time [s] and error of the same by Exudyn, and its version."""
    steps = round(RISE_TIME / TIME_STEP)
    described = {"blades": [beams(elements)], "final": FINAL_SPEED, "rise": RISE_TIME,
                 "t_end": RISE_TIME, "steps": steps, "samples": steps,
                 "rho_inf": RHO_INF}  # fmt: skip
    found = answer_to(SCRIPT_FILE, described)
    deepest = lag(np.array(found["tips"])[:, 0]).min()
    return found["seconds"], abs(deepest / LARGEST_LAG - 1), found["version"]


def beams(elements: int) -> dict[str, Any]:
    """Nodes and sections of the bar along y, which Exudyn's script turns about x."""
    n = elements
    quarter = rotation.quaternion(rotation.matrix(rotation.exp([0, 0, np.pi / 2])))
    nodes = [[0.0, y, 0.0, *quarter] for y in np.linspace(0.0, BAR_LENGTH, n + 1)]
    return {"nodes": nodes, "length": [BAR_LENGTH / n] * n, "mass": [LINE_MASS] * n,
            "stiffness": [SECTION_STRETCH + SECTION_BEND] * n, "damping": [[0.0] * 6] * n,
            "inertia": [SECTION_INERTIA] * n}  # fmt: skip


def lag(tip: Array) -> Array:
    """(k,) deflection across a bar along y that turns about x, from (k, 3) places of its tip."""
    angle = ramp(FINAL_SPEED, RISE_TIME)[1]
    t = np.linspace(0.0, RISE_TIME, len(tip))
    return np.array([(rotation.matrix(rotation.exp([-angle(s), 0, 0])) @ x)[2]
                     for s, x in zip(t, tip, strict=True)])  # fmt: skip
