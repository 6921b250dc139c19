"""Numbers that are no mistake of form and no physics: they are refused, or a warning names them."""

import numpy as np

import rom
from cases.files.cells import blocks_of, solid, write_msh
from generated.case import Silent, Warned, Works, case, edit, require
from generated.cases_reliability import matrices, skewed, spoilt
from generated.stock import STEEL, model, origin, pendulum
from rom.errors import (
    ConfigError,
    FileFormatError,
    MaterialError,
    MeshError,
    ModelError,
    QualityGateError,
    SolverError,
)

ODD = (Warned, MaterialError)
MATERIALS = {  # E, nu, rho; what is accepted; what is named
    "steel": ("210e9", "0.3", "7850", Silent, ""),
    "rubber": ("5e6", "0.45", "1100", Silent, ""),
    "diamond": ("1.05e12", "0.2", "3510", Silent, ""),
    "soft foam": ("1e5", "0.2", "30", Silent, ""),
    "E in GPa": ("210", "0.3", "7850", ODD, "m/s"),
    "E in kPa": ("210e6", "0.3", "7850e6", ODD, "m/s"),
    "density in g/cm^3": ("210e9", "0.3", "7.85", ODD, "m/s"),
    "density in t/mm^3": ("210e9", "0.3", "7.85e-9", ODD, "m/s"),
    "just too slow": ("9.5e4", "0.3", "1000", ODD, "m/s"),
    "just not too slow": ("1.05e5", "0.3", "1000", Silent, ""),
    "just not too fast": ("3.9e11", "0.3", "1000", Silent, ""),
    "just too fast": ("4.1e11", "0.3", "1000", ODD, "m/s"),
    "no stiffness": ("0", "0.3", "7850", MaterialError, "E"),
    "negative stiffness": ("-210e9", "0.3", "7850", MaterialError, "E"),
    "no mass": ("210e9", "0.3", "0", MaterialError, "rho"),
    "negative mass": ("210e9", "0.3", "-7850", MaterialError, "rho"),
    "Poisson's ratio of 0.5": ("210e9", "0.5", "7850", MaterialError, "nu"),
    "Poisson's ratio of 0.6": ("210e9", "0.6", "7850", MaterialError, "nu"),
    "Poisson's ratio of -1": ("210e9", "-1", "7850", MaterialError, "nu"),
}
ON_A_LINE = ("steel", "E in GPa", "no mass", "Poisson's ratio of 0.6")
BODIES = {  # numbers of a rigid body
    "no mass": ({"mass": 0.0}, "mass"),
    "a negative mass": ({"mass": -1.0}, "mass"),
    "negative inertia": ({"inertia": (1e-3, 1e-3, -1e-3)}, "inertia"),
    "inertia of no body": ({"inertia": (1.0, 1.0, 3.0)}, "inertia"),
    "an asymmetric inertia": ({"inertia": [[1, 0.5, 0], [0, 1, 0], [0, 0, 1]]}, "inertia"),
    "a quaternion of length 2": ({"orientation": (2, 0, 0, 0)}, ("orientation", "quaternion")),
    "a matrix that mirrors": ({"orientation": np.diag([1, 1, -1])}, "orientation"),
    "a matrix that stretches": ({"orientation": np.diag([2, 1, 1])}, "orientation"),
    "a quaternion of zeros": ({"orientation": (0, 0, 0, 0)}, ("orientation", "quaternion")),
}
STARTS = {  # laws, their value and rate at the start, which the mechanism takes up
    "a speed at once": (lambda t: 5.0 * t, 0.0, 5.0),
    "a harmonic at once": (lambda t: 0.5 * np.sin(20 * t), 0.0, 10.0),
}
JUMPS = {  # laws that no mechanism can follow from where it is drawn
    "an angle at once": lambda t: 0.5,
    "a step later": lambda t: 0.0 if t < 0.05 else 0.3,
    "a kink later": lambda t: 0.0 if t < 0.05 else 5.0 * (t - 0.05),
}
BOX = solid()


def solid_of(E, nu, rho):
    return rom.Material(E=E, nu=nu, rho=rho)


def driven(law, dt=0.01):
    def act(folder):
        mech = pendulum()
        mech.drive("motor", "hinge", law)
        return rom.simulate(mech, t_end=0.1, dt=dt)

    return act


def taken_up(law, angle, rate):
    """The motion begins with the angle and the rate of the law."""

    def act(folder):
        sol = driven(law, dt=1e-3)(folder)  # the rate is a difference over a step
        where, speed = sol.position("bob")[0], sol.v[0, 5]
        require(np.allclose(where, [0.2 * np.cos(angle), 0.2 * np.sin(angle), 0], atol=1e-6), where)
        require(abs(speed - rate) < 1e-3, speed)

    return act


def far(distance):
    """The box of the stock, moved away from the origin."""
    blocks, names = blocks_of(BOX)
    return lambda folder: write_msh(
        folder / "box.msh", BOX.points + np.array([distance, 0, 0]), blocks, names
    )


def part(folder):
    """A cube of 20 mm as STEP."""
    import gmsh

    gmsh.initialize([], False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.model.occ.addBox(0, 0, 0, 20, 20, 20)
        gmsh.model.occ.synchronize()
        gmsh.write(str(folder / "a.step"))
    finally:
        gmsh.finalize()


def unheld(folder):
    """Nothing holds the body: there is no equilibrium."""
    mech = rom.Mechanism(gravity=(0, 0, -9.81))
    mech.add_rigid("stone", mass=1.0, inertia=(1e-3,) * 3, at=(0, 0, 0))
    return rom.equilibrium(mech)


def contradicting(folder):
    """Two welds that cannot both hold after the bodies move."""
    mech = rom.Mechanism()
    bob = mech.add_rigid(
        "bob",
        mass=1.0,
        inertia=(1e-3,) * 3,
        at=(1, 0, 0),
        markers={"a": (-1, 0, 0), "b": (0, 0, 0)},
    )
    mech.distance("rod", origin(mech), bob.marker("b"), length=2.0)
    mech.spherical("ball", origin(mech), bob.marker("a"))
    return rom.simulate(mech, t_end=0.1, dt=0.01)


def free_free(folder):
    """Free-free modes alone have no stress at an interface that is held."""
    made = rom.reduce(
        model((4, 1, 1)), method=rom.FreeFree(4), interfaces={"root": "rbe2", "tip": "rbe2"}
    )
    mech = rom.Mechanism()
    rod = mech.add_flexible("rod", made)
    mech.fixed("clamp", origin(mech), rod.marker("root"))


GATES = (QualityGateError, ModelError, MaterialError, SolverError, ConfigError)
CASES = [
    *(case(f"a material: {name}", lambda folder, n=(E, nu, rho): solid_of(*map(float, n)), accept,
           *([word] if word else [])) for name, (E, nu, rho, accept, word) in MATERIALS.items()),
    *(case(f"a material on a line: {name}", f"modes box.msh -n 7 --E={E} --nu={nu} --rho={rho}", accept,
           *([word] if word else []), fe=True) for name, (E, nu, rho, accept, word) in MATERIALS.items()
      if name in ON_A_LINE),
    case("a damping ratio of 2 in a file", "reduce part.toml -o a.npz", (ConfigError, Warned), "2",
         given=edit("part.toml", "ratio = 0.01", "ratio = 2")),
    case("a damping ratio of 200 % in a file", "reduce part.toml -o a.npz", (ConfigError, Warned), "2",
         given=edit("part.toml", "ratio = 0.01", 'ratio = "200 %"')),
    case("a damping ratio of 2 on the command line", "reduce part.toml -o a.npz --damping-ratio 2",
         (ConfigError, Warned), "2"),
    *(case(f"a rigid body: {name}", lambda folder, n=numbers: pendulum(**n), (ModelError, ConfigError),
           word) for name, (numbers, word) in BODIES.items()),
    *(case(f"a drive: {name}", driven(law), (ConfigError, ModelError, SolverError, Warned), "motor")
      for name, law in JUMPS.items()),
    *(case(f"a drive: {name}", taken_up(*start), (Works, Warned), "motor")
      for name, start in STARTS.items()),
    case("a drive: no jump", driven(lambda t: 100 * t**3), Silent),
    *(case(f"a mesh {x:g} m from the origin", "mesh box.msh", (Warned, MeshError, FileFormatError),
           ("origin", "away"), given=far(x), fe=True) for x in (1e7, 1e10, 1e14)),
    case("a mesh 30 m from the origin", "mesh box.msh", Silent, given=far(30.0), fe=True),
    case("a scale for a step", "mesh a.step --scale 1e-3 -p lc=0.02", (ConfigError, Warned),
         ("scale", "unit"), given=part, fe=True),
    case("a part in metres for one in millimetres", f"modes box.msh {STEEL} --scale 1000 -n 7", Warned,
         ("3000", "3e+03"), fe=True),
    case("an asymmetric mass", matrices(M=skewed), QualityGateError, "M"),
    case("a mass of inf", matrices(M=lambda A: spoilt(A, np.inf)), GATES, "M"),
    case("a negative stiffness", matrices(K=lambda A: -A), GATES, "K"),
    case("a negative mass", matrices(M=lambda A: -A), GATES, "M"),
    case("a mass of zeros", matrices(M=lambda A: 0 * A), GATES, "M"),
    case("a stone that nothing holds", unheld, (ModelError, SolverError), "stone"),
    case("joints that contradict each other", contradicting, ModelError, ("rod", "ball")),
    case("free-free modes that are clamped", free_free, (ModelError, ConfigError), "rod"),
    case("a body that is read and moves", "simulate good.npz --hinge root --t-end 0.02 --dt 1e-3 -o out",
         (Works, Warned)),
]  # fmt: skip
