"""What rods have for mechanism files and the doctor."""

from rom.fields import Field

FIELD = Field(
    sections={"rods": "rom.components.cosserat.keys:SECTION"},
    first_use={"rods": "rom.components.cosserat.field:first_use"},
    moved={"rom.mbs.elements.rods": "rom.components.cosserat"},
)


def first_use() -> None:
    """A rod in a mechanism, its shape under load, and a motion of it alone."""
    from rom.components import cosserat
    from rom.mbs.integrate.simulation import simulate
    from rom.mbs.mechanism import Mechanism

    rod = cosserat.straight(1.0, 3, stretch=1e6, bend=100.0, mass=1.0, inertia=1e-3)
    mech = Mechanism()
    hook = mech.add_nonlinear("rod", cosserat.body(rod)).marker("start")
    mech.spherical("hook", mech.ground.marker((0.0, 0.0, 0.0)), hook)
    simulate(mech, t_end=2e-4, dt=1e-4)
    weight = cosserat.loads(rod, weight=(0.0, -9.81, 0.0))
    shape = cosserat.equilibrium(rod, weight)
    cosserat.elastic_energy(rod, shape)
    cosserat.strain(rod, shape)
    cosserat.simulate(rod, 2e-3, dt=1e-3, load=weight)
