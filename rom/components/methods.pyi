# What fields give to mechanisms and solutions, for who checks types; `rom.fields` finds them.
from rom.components.gear_mesh.gears import meshes
from rom.components.journal_bearing import record
from rom.components.journal_bearing.films import journal_bearings
from rom.components.rolling_bearing import bearings
from rom.components.tendons import tendons
from rom.mbs.elements import (
    bushings,
    frictions,
    laws,
    loads,
    motors,
    nonlinear,
    rotational_springs,
    spread_loads,
    springs,
    stops,
)
from rom.mbs.elements.contact import capsules, points, surfaces
from rom.mbs.mechanism import ElementsOf

class Methods:
    spring_damper = springs.spring_damper
    rotational_spring = rotational_springs.rotational_spring
    force = loads.force
    torque = loads.torque
    law = laws.law
    user_force = laws.user_force
    motor = motors.motor
    friction = frictions.friction
    stop = stops.stop
    bushing = bushings.bushing
    sphere_on_plane = points.sphere_on_plane
    disc_on_plane = points.disc_on_plane
    sphere_on_sphere = points.sphere_on_sphere
    sphere_on_cylinder = points.sphere_on_cylinder
    capsule_on_capsule = capsules.capsule_on_capsule
    surface_on_plane = surfaces.surface_on_plane
    surface_on_sphere = surfaces.surface_on_sphere
    surface_on_cylinder = surfaces.surface_on_cylinder
    spread_load = spread_loads.spread_load
    tendon = tendons.tendon
    gear_mesh = meshes.gear_mesh
    rolling_bearing = bearings.rolling_bearing
    journal_bearing = journal_bearings.journal_bearing
    add_nonlinear = nonlinear.add_nonlinear

    springs: ElementsOf[springs.Spring]
    turns: ElementsOf[rotational_springs.Turn]
    loads: ElementsOf[loads.Load]
    user_forces: ElementsOf[laws.UserForce]
    laws: ElementsOf[laws.Law]
    motors: ElementsOf[motors.Motor]
    frictions: ElementsOf[frictions.Friction]
    stops: ElementsOf[stops.Stop]
    bushings: ElementsOf[bushings.Bushing]
    contacts: ElementsOf[points.Contact]
    spread_loads: ElementsOf[spread_loads.Spread]
    tendons: ElementsOf[tendons.Tendon]
    gear_meshes: ElementsOf[meshes.GearMesh]
    rolling_bearings: ElementsOf[bearings.RollingBearing]
    journal_bearings: ElementsOf[journal_bearings.OilFilm]
    nonlinear: ElementsOf[nonlinear.Assembly]

class Columns:
    journal_bearing = record.journal_bearing
