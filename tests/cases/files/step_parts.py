"""STEP files of parts whose faces are known, in millimetres."""

import re
from contextlib import contextmanager

import numpy as np
import pytest

TURN_AXIS, TURN_ANGLE, SHIFT = (1.0, 2.0, 3.0), 0.7, (200.0, -50.0, 30.0)  # [rad], [mm]
INCH = (
    "#9001 = ( LENGTH_UNIT() NAMED_UNIT(*) SI_UNIT(.MILLI.,.METRE.) );\n"
    "#9002 = LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE(25.4),#9001);\n"
    "#9003 = DIMENSIONAL_EXPONENTS(1.,0.,0.,0.,0.,0.,0.);\n"
)


@contextmanager
def step_part(path):
    """The OpenCASCADE kernel of gmsh; what it holds at the end is written."""
    gmsh = pytest.importorskip("gmsh", reason="gmsh is not installed")
    gmsh.initialize([], False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        # that of an earlier session of this process stays otherwise
        gmsh.option.setString("Geometry.OCCTargetUnit", "MM")
        yield gmsh.model.occ
        gmsh.model.occ.synchronize()
        gmsh.write(str(path))
    finally:
        gmsh.finalize()


def step_box(path, *edges):
    """Write a box with edges in mm."""
    with step_part(path) as occ:
        occ.addBox(0, 0, 0, *edges)


def step_plate(path, *, turned=False):
    """100 x 60 x 10 mm with bores along z: radius 6 at (30, 30), 10 at (70, 30) in two halves."""
    with step_part(path) as occ:
        plate = occ.addBox(0, 0, 0, 100, 60, 10)
        bores = [occ.addCylinder(30, 30, -5, 0, 0, 20, 6)]
        bores += [occ.addCylinder(70, 30, -5, 0, 0, 20, 10, angle=np.pi) for _ in range(2)]
        occ.rotate([(3, bores[2])], 70, 30, 0, 0, 0, 1, np.pi)
        for bore in bores:
            occ.cut([(3, plate)], [(3, bore)])
        if turned:
            occ.rotate([(3, plate)], 0, 0, 0, *TURN_AXIS, TURN_ANGLE)
            occ.translate([(3, plate)], *SHIFT)


def in_inches(path, to):
    """The same numbers as inches."""
    text = path.read_text()
    number = re.search(r"#(\d+) = \( LENGTH_UNIT\(\)[^;]*MILLI[^;]*;", text)
    unit = (
        f"{INCH}#{number[1]} = ( CONVERSION_BASED_UNIT('INCH',#9002) LENGTH_UNIT() "
        "NAMED_UNIT(#9003) );"
    )
    to.write_text(text.replace(number[0], unit))
