# What fields give to mechanisms and solutions, for who checks types; `rom.fields` finds them.
from rom.components.co_simulation import units
from rom.components.gear_mesh.gears import meshes
from rom.components.journal_bearing import record
from rom.components.journal_bearing.films import journal_bearings
from rom.components.rolling_bearing import bearings
from rom.components.tendons import tendons
from rom.mbs.elements import (
    bushings,
    joint_laws,
    laws,
    loads,
    motors,
    nonlinear,
    springs,
)
from rom.mbs.elements.contact import points, shapes
from rom.mbs.mechanism import ElementsOf

class Methods:
    spring_damper = springs.spring_damper
    rotational_spring = joint_laws.rotational_spring
    force = loads.force
    torque = loads.torque
    law = laws.law
    user_force = laws.user_force
    motor = motors.motor
    fmu = units.fmu
    friction = joint_laws.friction
    stop = joint_laws.stop
    bushing = bushings.bushing
    sphere_on_plane = shapes.sphere_on_plane
    disc_on_plane = shapes.disc_on_plane
    sphere_on_sphere = shapes.sphere_on_sphere
    sphere_on_cylinder = shapes.sphere_on_cylinder
    capsule_on_capsule = shapes.capsule_on_capsule
    surface_on_plane = shapes.surface_on_plane
    surface_on_sphere = shapes.surface_on_sphere
    surface_on_cylinder = shapes.surface_on_cylinder
    spread_load = loads.spread_load
    tendon = tendons.tendon
    gear_mesh = meshes.gear_mesh
    rolling_bearing = bearings.rolling_bearing
    journal_bearing = journal_bearings.journal_bearing
    add_nonlinear = nonlinear.add_nonlinear

    springs: ElementsOf[springs.Spring]
    turns: ElementsOf[joint_laws.Turn]
    spread_loads: ElementsOf[loads.Spread]
    loads: ElementsOf[loads.Load]
    user_forces: ElementsOf[laws.UserForce]
    laws: ElementsOf[laws.Law]
    motors: ElementsOf[motors.Motor]
    frictions: ElementsOf[joint_laws.Friction]
    stops: ElementsOf[joint_laws.Stop]
    bushings: ElementsOf[bushings.Bushing]
    contacts: ElementsOf[points.Contact]
    tendons: ElementsOf[tendons.Tendon]
    gear_meshes: ElementsOf[meshes.GearMesh]
    rolling_bearings: ElementsOf[bearings.RollingBearing]
    journal_bearings: ElementsOf[journal_bearings.OilFilm]
    nonlinear: ElementsOf[nonlinear.Assembly]

class Columns:
    journal_bearing = record.journal_bearing
