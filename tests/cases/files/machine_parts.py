"""Five parts as they come from a CAD program: STEP files with fillets, seams and holes, in mm.

Each maker gives the volume of its part [m^3] as the CAD kernel integrates it.
"""

import numpy as np

from cases.files.step_parts import step_part

SMALL = 1e-3  # [mm] around what is looked for
MM3 = 1e-9  # [m^3]


def bracket(path):
    """Angle of 8 mm, 80 long, legs of 60 and 70 mm, fillet of 6: four bolt holes and a bore."""
    with step_part(path) as occ:
        angle = united(occ, occ.addBox(0, 0, 0, 80, 60, 8), occ.addBox(0, 0, 0, 80, 8, 70))
        angle = rounded(occ, angle, 6, (0, 8, 8), (80, 8, 8))
        bolts = [occ.addCylinder(x, y, -1, 0, 0, 10, 4.5) for x in (15, 65) for y in (25, 45)]
        whole = cut(occ, angle, *bolts, occ.addCylinder(40, -1, 45, 0, 10, 0, 12.5))
        return MM3 * occ.getMass(3, whole)


def crank(path):
    """Web of 16 mm between a bore of 24 and a pin of 20 mm diameter, 60 mm apart."""
    with step_part(path) as occ:
        ends = [occ.addCylinder(0, 0, 0, 0, 0, 16, 22), occ.addCylinder(60, 0, 0, 0, 0, 16, 16)]
        pin = occ.addCylinder(60, 0, 16, 0, 0, 25, 10)
        web = united(occ, *ends, occ.addBox(0, -12, 0, 60, 24, 16), pin)
        whole = cut(occ, web, occ.addCylinder(0, 0, -1, 0, 0, 18, 12))
        return MM3 * occ.getMass(3, whole)


def wheel(path):
    """Rim of 120 mm, hub of 36 with a bore of 20, five round spokes of 14 mm diameter."""
    with step_part(path) as occ:
        rim = occ.addCylinder(0, 0, -10, 0, 0, 20, 60)
        rim = cut(occ, rim, occ.addCylinder(0, 0, -11, 0, 0, 22, 48))
        turns = 2 * np.pi * np.arange(5) / 5
        spokes = [
            occ.addCylinder(12 * x, 12 * y, 0, 40 * x, 40 * y, 0, 7)
            for x, y in zip(np.cos(turns), np.sin(turns), strict=True)
        ]
        spoked = united(occ, rim, occ.addCylinder(0, 0, -15, 0, 0, 30, 18), *spokes)
        whole = cut(occ, spoked, occ.addCylinder(0, 0, -16, 0, 0, 32, 10))
        return MM3 * occ.getMass(3, whole)


def cover(path):
    """Lid of 140 x 90 x 30 mm with walls of 3, edges rounded by 8, open below, four screw holes."""
    with step_part(path) as occ:
        lid = round_block(occ, (0, 0, 0, 140, 90, 30), 8)
        inner = round_block(occ, (3, 3, -10, 134, 84, 37), 5)
        screws = [occ.addCylinder(x, y, 20, 0, 0, 20, 2.5) for x in (20, 120) for y in (20, 70)]
        whole = cut(occ, lid, inner, *screws)
        return MM3 * occ.getMass(3, whole)


def rack(path):
    """Rack of 48 teeth of module 2, 20 wide and 18 high, with two bolt bores: 200 faces."""
    pitch, foot, flank = 2 * np.pi, 13.5, 4.5 * np.tan(np.deg2rad(20))
    tooth = np.array([(0, 0), (flank, 4.5), (pitch / 2, 4.5), (pitch / 2 + flank, 0)])
    teeth = [tooth + np.array([3.0 + k * pitch, foot]) for k in range(48)]
    end = 48 * pitch + 3.0
    outline = np.vstack([[(0, 0), (0, foot)], *teeth, [(end, foot), (end, 0)]])
    with step_part(path) as occ:
        points = [occ.addPoint(x, 0, z) for x, z in outline]
        lines = [occ.addLine(*ends) for ends in zip(points, np.roll(points, -1), strict=True)]
        face = occ.addPlaneSurface([occ.addCurveLoop(lines)])
        bar = occ.extrude([(2, face)], 0, 20, 0)[1][1]
        bores = [occ.addCylinder(x, -1, 7, 0, 22, 0, 3.3) for x in (50, end - 50)]
        whole = cut(occ, bar, *bores)
        return MM3 * occ.getMass(3, whole)


def united(occ, first, *others):
    return occ.fuse([(3, first)], [(3, tag) for tag in others])[0][0][1]


def cut(occ, solid, *tools):
    """What the tools leave."""
    return occ.cut([(3, solid)], [(3, tag) for tag in tools])[0][0][1]


def round_block(occ, box, radius):
    """A box (x, y, z, dx, dy, dz) with all edges round but those of its foot."""
    block = occ.addBox(*box)
    x, y, z, dx, dy, dz = box
    top = (x, y, z + dz), (x + dx, y + dy, z + dz)
    uprights = [((x + i * dx, y + j * dy, z), (x + i * dx, y + j * dy, z + dz))
                for i in (0, 1) for j in (0, 1)]  # fmt: skip
    edges = [edge for place in (top, *uprights) for edge in edges_within(occ, *place)]
    return occ.fillet([block], edges, [radius])[0][1]


def rounded(occ, solid, radius, low, high):
    return occ.fillet([solid], edges_within(occ, low, high), [radius])[0][1]


def edges_within(occ, low, high):
    """Edges within the box from one corner to the other."""
    box = [x - SMALL for x in low] + [x + SMALL for x in high]
    return [tag for _, tag in occ.getEntitiesInBoundingBox(*box, 1)]


PARTS = {make.__name__: make for make in (bracket, crank, wheel, cover, rack)}
