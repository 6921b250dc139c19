"""A clamped angle under loads out of its plane, in CalculiX with NLGEOM and as a reduced body.

Both take the second Piola-Kirchhoff stress proportional to the strain of Green and Lagrange; the
nodes, elements and nodal forces are the same.
"""

import shutil
import subprocess

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial import cKDTree

import rom
from cases.mbs.slender import cantilever
from cases.solid import reduced

pytestmark = [
    pytest.mark.fenicsx,
    pytest.mark.skipif(shutil.which("ccx") is None,
                       reason="CalculiX (ccx, Debian's calculix-ccx) is not installed"),
]  # fmt: skip
ANGLE = """
SetFactory("OpenCASCADE");
Box(1) = {0, -0.01, -0.006, 0.40, 0.02, 0.012};
Box(2) = {0.40, -0.01, -0.006, 0.02, 0.26, 0.012};
BooleanUnion(3) = { Volume{1}; Delete; }{ Volume{2}; Delete; };
Physical Volume("body", 1) = {3};
Physical Surface("root", 11) = Surface In BoundingBox{-1e-5, -1, -1, 1e-5, 1, 1};
Physical Surface("tip", 12) = Surface In BoundingBox{0.3, 0.24999, -1, 1, 0.25001, 1};
Mesh.MeshSizeMin = 0.03; Mesh.MeshSizeMax = 0.03;
"""
ALUMINIUM = rom.Material(E=70e9, nu=0.33, rho=2700.0)
FORCE = np.array([0.0, 300.0, -400.0])  # the tip moves by a fifth of the length [N]
SHARES = (0.25, 0.5, 1.0)


def by_calculix(folder, path, tip):
    """(s, 3) mean displacement of the tip [m] under the shares of the force."""
    from rom.fe.mesh.input_deck import input_deck
    from rom.fe.mesh.read import read_mesh

    head = input_deck(read_mesh(path), material=ALUMINIUM, fixed=("root",)).split("*STEP\n")[0]
    rows = head.split("*NODE\n")[1].split("*")[0].splitlines()
    nodes = np.array([row.split(",") for row in rows], dtype=float)
    _, at = cKDTree(nodes[:, 1:]).query(tip.points)
    numbers, weight = nodes[at, 0].astype(int), np.asarray(tip.surface_mass.sum(axis=1)).ravel()
    weight /= weight.sum()
    loads = [f"{number}, {axis + 1}, {part * FORCE[axis]:.12e}" for axis in (1, 2)
             for number, part in zip(numbers, weight, strict=True) if part]  # fmt: skip
    step = ["*STEP, NLGEOM, INC=100", "*STATIC, DIRECT", "0.25, 1.0", "*BOUNDARY", "root, 1, 3",
            "*CLOAD", *loads, "*NODE PRINT, NSET=tip", "U", "*END STEP"]  # fmt: skip
    (folder / "job.inp").write_text(head + "\n".join(step) + "\n")
    subprocess.run(["ccx", "job"], cwd=folder, check=True, capture_output=True, timeout=600)
    found = {}
    for table in (folder / "job.dat").read_text().split("displacements")[1:]:
        time, *lines = table.split("time")[1].splitlines()
        u = {int(line.split()[0]): line.split()[1:] for line in lines if len(line.split()) == 4}
        found[float(time)] = weight @ np.array([u[number] for number in numbers], dtype=float)
    return np.array([found[share] for share in SHARES])


@pytest.mark.long
def test_an_angle_bends_and_twists_as_in_calculix(tmp_path):
    """Two components at once, at the edge of the range: nothing warns."""
    path = tmp_path / "angle.geo"
    path.write_text(ANGLE)
    model = rom.fe.model(path, material=ALUMINIUM)
    far = rom.Geometric(loads={"tip": (*np.sqrt(2) * FORCE, 0, 0, 0)})
    how = {"interfaces": {"root": "rbe2", "tip": "rbe3"}, "reference": "root", "certify": True}
    body = reduced(6, model, nonlinear=far, **how)
    states = body.equilibria({"tip": (*FORCE, 0, 0, 0)}, shares=SHARES)
    ours = states @ body.marker("tip").translation.T
    theirs = by_calculix(tmp_path, path, model.interfaces["tip"])
    size = np.linalg.norm(theirs, axis=1)
    assert size[-1] > 0.08
    assert (np.linalg.norm(ours - theirs, axis=1) < 1e-3 * size).all()
    linear = np.array(SHARES)[:, None] * theirs[0] / SHARES[0]
    assert np.linalg.norm(linear - theirs, axis=1)[-1] > 0.1 * size[-1]
    mech, part = cantilever(body)
    mech.force("load", part.marker("tip"), FORCE)
    elastic = rom.equilibrium(mech, steps=4).q[7:]
    assert_allclose(elastic, states[-1], atol=1e-6 * np.abs(states[-1]).max())
