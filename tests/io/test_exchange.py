"""One body through every format that is read too: frequencies, mass and inertia come back.

Formats of interface motions keep the rigid motions among theirs: these meet no stiffness, and carry
mass, mass centre and inertia. Each file is read without what the writer knows.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.io import loadmat
from scipy.linalg import eigh

import rom
from cases.files.mbdyn import groups, numbers
from cases.solid import block
from rom.io.export import FORMATS, read_body
from rom.io.matrices.dmig import read_dmig, read_grids
from rom.io.matrices.node_files import read_nodes
from rom.io.matrices.op4 import read_op4
from rom.io.matrices.user_element import read_user_element
from rom.io.programs.openfast import read_openfast

KINDS = {"root": "rbe2", "tip": "rbe3"}
WHOLE = {"npz": ".npz", "sid": ".SID_FEM", "sid-pysid": ".SID_FEM", "sid-geisler": ".SID_FEM",
         "mbdyn": ".fem", "exudyn": ".py"}  # fmt: skip


@pytest.fixture(scope="module")
def model():
    return block(cells=(5, 2, 1), origin=(0.1, -0.2, 0.3))


@pytest.fixture(scope="module")
def body(model):
    return rom.reduce(model, method=rom.CraigBampton(5), interfaces=KINDS, certify=False)


def full(A):  # from the lower triangle, or both
    A = A.toarray()
    return np.tril(A) + np.tril(A, -1).T


def op4(path):
    found = read_op4(path)
    return *(full(found[name]) for name in ("KAAX", "MAAX")), None


def dmig(path):
    found = read_dmig(path)
    (K, dofs), (M, same) = found["KAAX"], found["MAAX"]
    assert_array_equal(dofs, same)
    assert_array_equal(dofs[:12], [(k, c) for k in (1, 2) for c in range(1, 7)])
    return full(K), full(M), read_grids(path)[1]


def abaqus(path):
    found = read_user_element(path)
    (K, dofs), (M, _) = found["STIFFNESS"], found["MASS"]
    assert_array_equal(dofs[:12], [(k, c) for k in (1, 2) for c in range(1, 7)])
    return full(K), full(M), read_nodes(path)[1][:2]


def simscape(path):
    found = loadmat(path)
    return found["K"], found["M"], found["origins"]


def openfast(path):
    found = read_openfast(path)
    return found.K, found.M, None


READERS = {"op4": (op4, 1e-9), "dmig": (dmig, 3e-8), "abaqus": (abaqus, 1e-9),
           "simscape": (simscape, 1e-9), "openfast": (openfast, 1e-9),
           "openfast-4": (openfast, 1e-9)}  # fmt: skip  # ten digits in dmig


def rigid_motions(points, n):
    """(n, 6) motions and turns about the origin of coordinates of interfaces at points."""
    R = np.zeros((n, 6))
    for k, x in enumerate(points):
        R[6 * k : 6 * k + 6] = np.eye(6)
        R[6 * k : 6 * k + 3, 3:] = np.cross(np.eye(3), x).T
    return R


def inertia(body):
    """(6, 6) of the rigid body about the origin of coordinates."""
    m, c = body.mass * np.eye(3), np.cross(np.eye(3), body.first_moment).T
    return np.block([[m, c], [c.T, body.inertia]])


def frequencies(K, M, held=0):
    lam = eigh(K[held:, held:], M[held:, held:], eigvals_only=True)
    return np.sqrt(np.maximum(lam, 0.0)) / (2 * np.pi)


@pytest.mark.parametrize("to", WHOLE)
def test_a_body_is_the_same_body(body, to, tmp_path):
    back = read_body(rom.export(body, tmp_path / f"rod{WHOLE[to]}", to=to))
    for fixed in ((), ("root",), ("tip",), ("root", "tip")):
        assert_allclose(back.frequencies(fixed=fixed), body.frequencies(fixed=fixed), rtol=1e-9)
    assert_allclose(back.mass, body.mass, rtol=1e-11)
    for name in ("first_moment", "inertia"):
        A = getattr(body, name)
        assert_allclose(getattr(back, name), A, atol=1e-11 * np.abs(A).max())


@pytest.mark.parametrize("to", READERS)
def test_matrices_of_interfaces_are_the_same_body(model, body, to, tmp_path):
    """Superelements of OpenFAST are free at their one interface: six digits more than it needs."""
    read, tol = READERS[to]
    if read is openfast:
        tip = {"tip": "rbe3"}
        body = rom.reduce(model, method=rom.CraigBampton(5), interfaces=tip, certify=False)
    K, M, points = read(rom.export(body, tmp_path / f"rod{FORMATS[to][0]}", to=to))
    if points is None:  # the file has matrices alone
        points = [marker.point for marker in body.markers.values()]
    R = rigid_motions(points, len(K))
    assert np.abs(K @ R).max() < tol * np.abs(K).max()
    J = inertia(body)
    assert_allclose(R.T @ M @ R, J, atol=tol * np.abs(J).max())
    for n in range(1, len(body.markers) + 1):
        held = body.frequencies(fixed=body.interface_names[:n])
        assert_allclose(frequencies(K, M, 6 * n), held, rtol=tol)
    free = body.frequencies()[6:]
    assert_allclose(frequencies(K, M)[6:], free, rtol=tol if read is openfast else 1e-8 + tol)


def test_a_modal_joint_is_the_same_body(body, tmp_path):
    """Rigid motions from groups 12, 14 and 15, the others from 9 and 10."""
    found = groups(rom.export(body, tmp_path / "rod.fem"))
    r = body.n_modes
    M, K = (numbers(found[k], r, r) for k in (9, 10))
    m, (c, *about) = float(found[12][0]), numbers(found[12][1:], 4, 3)
    C = m * np.cross(np.eye(3), c).T
    J = about + m * (c @ c * np.eye(3) - np.outer(c, c))
    rigid = np.block([[m * np.eye(3), C], [C.T, J]])
    assert_allclose(rigid, inertia(body), rtol=1e-12, atol=1e-12 * m)
    coupling = np.vstack([numbers(found[k], 3, r) for k in (14, 15)])
    whole = np.block([[rigid, coupling], [coupling.T, M]])
    stiff = np.zeros_like(whole)
    stiff[6:, 6:] = K
    assert_allclose(frequencies(stiff, whole)[6:], body.frequencies()[6:], rtol=1e-9)


def test_every_format_is_here_or_has_a_test_of_its_own():
    """Elsewhere: vtu in test_universal, radioss in test_programs, fmu in test_fmu_body."""
    here = {*WHOLE, *READERS}
    assert set(FORMATS) - here == {"vtu", "fmu", "radioss"}
