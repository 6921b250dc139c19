"""What elements of force give a mechanism."""

from rom.fields import Field

ELEMENTS_MODULE = "rom.mbs.elements"
FAMILIES = """
springs:SPRINGS joint_laws:TURNS loads:LOADS laws:LAWS motors:MOTORS joint_laws:FRICTIONS
joint_laws:STOPS bushings:BUSHINGS contact.points:CONTACTS loads:SPREAD_LOADS nonlinear:NONLINEAR
solids:QUARTICS solids:SAMPLES
""".split()
RECORDS = """
springs=springs:Spring turns=joint_laws:Turn loads=loads:Load laws=laws:Law
user_forces=laws:UserForce motors=motors:Motor frictions=joint_laws:Friction stops=joint_laws:Stop
bushings=bushings:Bushing contacts=contact.points:Contact spread_loads=loads:Spread
nonlinear=nonlinear:Assembly
""".split()
METHODS = """
springs:spring_damper joint_laws:rotational_spring loads:force loads:torque laws:law laws:user_force
motors:motor joint_laws:friction joint_laws:stop bushings:bushing contact.shapes:sphere_on_plane
contact.shapes:disc_on_plane contact.shapes:sphere_on_sphere contact.shapes:sphere_on_cylinder
contact.shapes:capsule_on_capsule contact.shapes:surface_on_plane contact.shapes:surface_on_sphere
contact.shapes:surface_on_cylinder loads:spread_load nonlinear:add_nonlinear
""".split()
SYMBOLS = {"springs": "spring", "turns": "spiral", "bushings": "bushing"}
NAMED = [*RECORDS, *(f"{place.partition(':')[2]}={place}" for place in METHODS)]
FIELD = Field(
    families=tuple(f"{ELEMENTS_MODULE}.{place}_FAMILY" for place in FAMILIES),
    bodies={"deflection": f"{ELEMENTS_MODULE}.solids:deflection_of"},
    methods={name: f"{ELEMENTS_MODULE}.{place}" for name, place in (x.split("=") for x in NAMED)},
    symbols={family: f"rom.view.scenes.connections:{shape}" for family, shape in SYMBOLS.items()},
)
