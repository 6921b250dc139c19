"""What elements of force give a mechanism."""

from rom.fields import Field

ELEMENTS_MODULE = "rom.mbs.elements"
FIELD = Field(
    families=tuple(f"{ELEMENTS_MODULE}.{place}_FAMILY" for place in (
        "springs:SPRINGS", "rotational_springs:TURNS", "loads:LOADS", "laws:LAWS", "motors:MOTORS",
        "frictions:FRICTIONS", "stops:STOPS", "bushings:BUSHINGS", "contact.points:CONTACTS",
        "spread_loads:SPREAD_LOADS", "nonlinear:NONLINEAR",
    )),
    methods={name.partition(" ")[0]: f"{ELEMENTS_MODULE}.{name.partition(' ')[2]}" for name in (
        "springs springs:Spring", "turns rotational_springs:Turn", "loads loads:Load",
        "laws laws:Law", "user_forces laws:UserForce", "motors motors:Motor",
        "frictions frictions:Friction", "stops stops:Stop", "bushings bushings:Bushing",
        "contacts contact.points:Contact", "spread_loads spread_loads:Spread",
        "nonlinear nonlinear:Assembly",
    )} | {place.partition(":")[2]: f"{ELEMENTS_MODULE}.{place}" for place in (
        "springs:spring_damper", "rotational_springs:rotational_spring", "loads:force",
        "loads:torque", "laws:law", "laws:user_force", "motors:motor", "frictions:friction",
        "stops:stop", "bushings:bushing", "contact.points:sphere_on_plane",
        "contact.points:disc_on_plane", "contact.points:sphere_on_sphere",
        "contact.points:sphere_on_cylinder", "contact.capsules:capsule_on_capsule",
        "contact.surfaces:surface_on_plane", "contact.surfaces:surface_on_sphere",
        "contact.surfaces:surface_on_cylinder", "spread_loads:spread_load",
        "nonlinear:add_nonlinear",
    )},
    symbols={family: f"rom.view.scenes.connections:{shape}" for family, shape in (
        ("springs", "spring"), ("turns", "spiral"), ("bushings", "bushing"),
    )},
)  # fmt: skip
