"""The arrays of gear meshes, and the names of their columns."""

from rom.components.round_bodies.cylinders import Cylinders
from rom.mbs.kernels.compiled import inner
from rom.mbs.kernels.tables import (
    Array1,
    Array2,
    Index1,
    Index2,
    Scratch1,
    Scratch2,
    Scratch3,
    Table,
    table,
)

# columns of Meshes.size, Meshes.flank and Meshes.law
RB_1, RB_2, RA_1, RA_2, HELIX, PITCH, THICKNESS = range(7)
BACKLASH, ALPHA, WIDTH, OFFSET, PHASE, ENTRY, RACK, TIP = range(7, 15)
RELIEF_1, RELIEF_2, EXTENT_1, EXTENT_2, POWER, CROWNING, SLOPE = range(7)
RUN_OUT_1, RUN_OUT_2, TOWARDS_1, TOWARDS_2, LEAST, LEAST_BACK = range(7, 13)
DAMPING, FRICTION, SPEED, FOLLOWS, COUPLING, HERTZ = range(6)
SIDE, PLACE, HEIGHT, LENGTH, LOAD = range(5)  # columns of Meshes.slices
# what `rom.components.gear_mesh.gears.teeth.add_lines` adds up
FORCES, TANGENTS, ENERGY = range(3)
# how the wheels stand to each other: all that the energy of the teeth depends on
TURN_1, TURN_2, DISTANCE, SHIFT, TILT_C, TILT_T, COORDINATES = range(7)
# columns of Meshes.line: of a slice its place, how deep its flanks are in each other, its weight
# (length of line times the share of its load that it has taken up), the stiffness of its teeth and
# the constant of its contact; then how these follow the line along the path, and the path's begin
X, Z, DEPTH, WEIGHT, STIFFNESS, CONSTANT = range(6)
DEPTH_AT, WEIGHT_AT, STIFFNESS_AT, CONSTANT_AT = range(6, 10)
DEPTH_FIRST, WEIGHT_FIRST, STIFFNESS_FIRST, CONSTANT_FIRST = range(10, 14)
# its force and how that follows depth, weight, stiffness and constant; its energy and how that
# follows the last three
FORCE, BY_DEPTH, BY_WEIGHT, BY_STIFFNESS, BY_CONSTANT = range(14, 19)
STORED, WORK_WEIGHT, WORK_STIFFNESS, WORK_CONSTANT = range(19, 23)
# of slices that carry each other: their foundation, what binds one to the next, whether it touches,
# its deflection, and three columns of memory
FOUNDATION, LINK, TOUCHES, BENT, UPPER, ANSWER, TARGET = range(23, 30)
# the length of its piece of the line, the force that damping adds, and how the whole follows depth
# and its rate
LENGTH_OF_LINE, LOSS, STEEP, VISCOUS = range(30, 34)
FIRST_GRADIENT = 34  # first of the derivatives of its depth by the coordinates of the wheels
SLICE_COLUMNS = FIRST_GRADIENT + COORDINATES


@table
class Meshes(Table):
    """All meshes."""

    i: Index1  # (k,) markers of the pinions
    j: Index1  # (k,) of the gears
    # (k, 12) axis of the pinion, a direction across it, the same of the gear, in axes of their
    # markers
    axes: Array2
    # (k, 15) base radii, tip radii [m], base helix [rad], base pitch, thickness of the pinion's
    # teeth on the base circle, backlash [m], working pressure angle at the datum [rad], width,
    # offset of the faces [m], angle of the pinion at the datum [rad], length of entry [m]; distance
    # of a rack, 0 for gears, and height of its teeth [m]
    size: Array2
    # (k, 13) tip relief of pinion and gear, their extents [m], power, crowning, slope,
    # eccentricities of the wheels [m], their directions [rad], least gaps of working and back
    # flanks [m]
    flank: Array2
    # (k, 6) damping [s], coefficient of friction, transition speed [m/s], whether forces follow the
    # energy along the path, length over which slices carry each other [m], compliance of the
    # contact [m^2/N]
    law: Array2
    # (k, 2) of both wheels in the frames of their bodies, about the axis of the pinion [rad/s]
    spin: Array2
    clock: Index1  # (1,) function that tells the time
    cells: Index1  # (k,) slices across the face
    stiffness_at: Index1  # (k + 1,) where the tables begin
    stiffness: Array1  # [N/m^2]
    constant_at: Index1  # (k + 1,) where those of the contact begin
    constant: Array1  # [1]
    pitch_at: Index1  # (2 k + 1,) where the pitch errors of wheels begin
    pitch: Array1  # [m]
    map_at: Index1  # (4 k + 1,) where maps of working flanks, then of back flanks, begin
    maps: Array1  # [m]
    map_shape: Index2  # (4 k, 3) teeth, places along profile and lead
    remembered: Index1  # (k,) first of two angles that are followed
    start: Array2  # (k, 2) these angles at the datum [rad]
    load: Scratch1  # (k,) sum of normal forces at the last residual; NaN: no common tangent [N]
    approach: Scratch1  # (k,) of the flanks deepest in each other, of wheels that are rigid [m]
    # (k, m, 5) of all that bear at the last residual: side, place on the path of contact, height
    # over the middle of the face, length of the line [m], force [N]
    slices: Scratch3
    n_slices: Scratch1  # (k,) how many
    rims: Cylinders  # how the rims of flexible wheels deform
    factor: Scratch1  # (2,) of stiffness and damping in the tangents
    line: Scratch2  # (c, 40) slices of one line, with the columns above
    gradient: Scratch1  # (6,) of the energy and power lost, by coordinates of the wheels and rates
    speed: Scratch1  # (6,) these rates
    hessian: Scratch3  # (2, 6, 6) how the gradient follows the coordinates and their rates
    rates: Scratch2  # (6, 12) of the coordinates by the motions of both markers
    lever: Scratch2  # (2, 12) what the motions do across a slice, and how they close it
    tangent: Scratch3  # (2, 12, 12) of one mesh, by motions and velocities


@inner
def has_rims(meshes, k):
    """Whether a wheel of mesh k has a rim that deforms."""
    return meshes.rims.of[k, 0] >= 0 or meshes.rims.of[k, 1] >= 0
